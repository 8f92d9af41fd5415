"""References that no robot could drive, or that the law cannot follow, are refused with place and remedy."""

import re

import pytest
from click.testing import CliRunner

from miro_sim.scenario.file import ScenarioError, parse
from mirotwin.commands import main

TEXT = """
name = "drive"
duration_s = {duration_s}
[[network]]
[[network.robot]]
reference = {{ {reference} }}
controller = {{ {controller} }}
"""
POLAR = 'law = "yang_kim"'
FREE = 'law = "body_frame"'
PLACE = "my.toml: network[0].robot[0].reference: "
CIRCLE = 'kind = "arc", curvature_per_m = 8.0, heading_deg = -45.0'
THROUGH = 'kind = "line", start_x_cm = 20.0, start_y_cm = 20.0, heading_deg = -135.0, drive_s = 2.0'
WAY = 'kind = "waypoints", points = [{ x_cm = 0.0, y_cm = 0.0, heading_deg = 10.0 }, { x_cm = 60.0, y_cm = 20.0 }, '


def text(reference, controller=POLAR, duration_s=6.0):
    return TEXT.format(reference=reference, controller=controller, duration_s=duration_s)


def refusal(*arguments):
    with pytest.raises(ScenarioError) as caught:
        parse(text(*arguments), "my.toml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("reference", "controller", "expected"),
    [
        (
            'kind = "line", speed_m_s = 1.2, drive_s = 0.9',
            POLAR,
            "more than the controller's max_v_m_s = 0.95; drive",
        ),
        (
            f"{CIRCLE}, drive_s = 2",
            f"{FREE}, max_w_rad_s = 1.5",
            "more than the controller's max_w_rad_s = 1.5; drive",
        ),
        (
            'kind = "line", speed_m_s = 0.4, ramp_s = 0.04, drive_s = 2',
            POLAR,
            "more than the controller's max_v_dot_m_s2 = 8; drive it more slowly, or raise controller.max_v_dot_m_s2",
        ),
        (
            f"{CIRCLE}, drive_s = 2",
            f"{FREE}, max_w_dot_rad_s2 = 3.1",
            "it needs 3.2 rad/s2, more than the controller's",
        ),
        (
            f"{CIRCLE}, speed_m_s = 1.2, drive_s = 1.5",
            f"{FREE}, max_v_m_s = 2, max_w_rad_s = 20",
            "a wheel needs 1.526 m/s; it reaches 1.46 m/s; drive it more slowly, or turn less",
        ),
        (f"{WAY}], speed_m_s = 1.0, accel_m_s2 = 3.0, lateral_accel_m_s2 = 9.0", POLAR, "it needs 0.9"),
    ],
)
def test_what_is_beyond_wheels_or_law_is_refused(reference, controller, expected):
    message = refusal(reference, controller)
    assert re.match(re.escape(PLACE) + r"after \d+\.\d\d s, at \(-?\d+\.\d, -?\d+\.\d\) cm, ", message)
    assert expected in message


def test_what_limits_just_allow_is_not_refused():
    parse(
        text('kind = "line", speed_m_s = 0.4, ramp_s = 0.5, drive_s = 2', f"{POLAR}, max_v_m_s = 0.4"),
        "my.toml",
    )
    parse(text('kind = "line", drive_s = 2', f"{POLAR}, max_v_dot_m_s2 = 0.4"), "my.toml")


def test_a_start_at_full_speed_is_a_change_within_one_camera_frame():
    parse(text('kind = "line", speed_m_s = 0.26, ramp_s = 0.0, drive_s = 2'), "my.toml")
    assert "needs 8.991 m/s2" in refusal('kind = "line", speed_m_s = 0.3, ramp_s = 0.0, drive_s = 2')


@pytest.mark.parametrize(
    ("reference", "expected"),
    [
        (CIRCLE, "passes the origin: after 4.17 s, at (-0.0, 0.0) cm, it is 0.04 cm away"),
        (
            THROUGH,
            "away, and the law 'yang_kim', which has polar coordinates, needs 2.4 cm; lead it past the origin",
        ),
        (
            'kind = "line", start_x_cm = 1.0, drive_s = 3.0',
            "after 0.00 s, at (1.0, 0.0) cm, it is 1.00 cm away",
        ),
        ('kind = "sine", start_x_cm = -4.0, drive_s = 3.0', "or choose another law, such as body_frame"),
        (f"{WAY}{{ x_cm = 40.0, y_cm = 50.0 }}, {{ x_cm = 1.0, y_cm = 1.0 }}]", "it is 1.41 cm away"),
    ],
)
def test_a_path_past_the_origin_is_refused_under_a_law_in_polar_coordinates_only(reference, expected):
    message = refusal(reference, POLAR, 11.0)
    assert message.startswith(PLACE + "passes the origin: after ")
    assert expected in message
    parse(text(reference, FREE, 5.0), "my.toml")


@pytest.mark.parametrize(
    "reference",
    [
        'kind = "line"',
        'kind = "line", speed_m_s = 0.0',
        'kind = "line", drive_s = 0.3',
        'kind = "line", start_x_cm = 10.0, start_y_cm = 2.5',
        'kind = "sine"',
        f"{WAY}]",
    ],
)
def test_a_path_that_starts_in_the_origin_or_keeps_away_from_it_is_not_refused(reference):
    parse(text(reference, POLAR, 5.0), "my.toml")


def test_a_closed_path_may_belong_to_a_run_of_a_day():
    closed = (
        'kind = "waypoints", closed = true, points = [{ x_cm = 20, y_cm = 10 }, { x_cm = 70, y_cm = 20 }, '
    )
    parse(text(f"{closed}{{ x_cm = 30, y_cm = 50 }}]", FREE, 86_400.0), "my.toml")
    parse(
        text('kind = "arc", start_x_cm = 50, curvature_per_m = 5.0, heading_deg = 0.0', FREE, 86_400.0),
        "my.toml",
    )


@pytest.mark.parametrize(
    ("reference", "expected"),
    [
        ('kind = "waypoints"', "reference.points: this key is missing"),
        ('kind = "waypoints", points = []', "reference.points: there are 0; give 2 to 200"),
        ('kind = "waypoints", points = [3]', "reference.points[0]: expected a table, got a whole number (3)"),
        (f"{WAY}{{ x_cm = 66.0, y_cm = 20.0 }}]", "reference.points[2]: less than 7.5 cm from points[1]"),
        (
            f"{WAY}{{ x_cm = nan, y_cm = 20.0 }}]",
            "reference.points[2].x_cm: nan is not a number that can be used",
        ),
        (
            f"{WAY}{{ x_cm = 80.0, y = 20.0 }}]",
            "reference.points[2].y: unknown key; use y_cm, in centimetres",
        ),
        (f"{WAY}{{ x_cm = 118.0, y_cm = 20.0 }}]", "reference: leaves the pitch after"),
        (
            'kind = "sine", wavelength_cm = 0.0',
            "reference.wavelength_cm: 0.0 is out of range; must be >= 1.0",
        ),
        ('kind = "sine", amplitude_cm = inf', "reference.amplitude_cm: inf is not a number that can be used"),
        (CIRCLE, "reference: passes the origin"),
    ],
)
def test_the_command_line_ends_with_one_line_and_exit_code_2(reference, expected, tmp_path):
    file = tmp_path / "my.toml"
    file.write_text(text(reference, POLAR, 12.0))
    result = CliRunner().invoke(main, ["run", str(file), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1
    assert expected in result.stderr
