"""Starts off the pitch, and references that leave it, or that no robot or law could drive, are refused with place."""

import cmath
import math
import re
from itertools import product

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from miro_host.posture import Posture
from miro_sim.pitch import ground as pitch
from miro_sim.scenario.build import reference_for
from miro_sim.scenario.file import ScenarioError, parse
from tests.exact.distribution import install

DRIVE = """
name = "drive"
duration_s = {duration_s}
[[network]]
[[network.robot]]
reference = {{ {reference} }}
controller = {{ {controller} }}
"""
POLAR = 'law = "yang_kim"'
FREE = 'law = "body_frame"'
LINE = 'kind = "line"'
PLACE = "my.toml: network[0].robot[0].reference: "
CIRCLE = 'kind = "arc", curvature_per_m = 8.0, heading_deg = -45.0'
THROUGH = f"{LINE}, start_x_cm = 20.0, start_y_cm = 20.0, heading_deg = -135.0, drive_s = 2.0"
WAY = 'kind = "waypoints", points = [{ x_cm = 0.0, y_cm = 0.0, heading_deg = 10.0 }, { x_cm = 60.0, y_cm = 20.0 }, '


def drive_text(reference, controller=POLAR, duration_s=6.0):
    return DRIVE.format(reference=reference, controller=controller, duration_s=duration_s)


def accepted(*arguments):
    parse(drive_text(*arguments), "my.toml")


def drive_refusal(*arguments):
    with pytest.raises(ScenarioError) as caught:
        accepted(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


WHEELS = "a wheel needs 1.526 m/s; it reaches 1.46 m/s; drive it more slowly, or turn less"
RAISE = "drive it more slowly, or raise controller.max_v_dot_m_s2"


@pytest.mark.parametrize(
    ("reference", "controller", "expected"),
    [
        (
            f"{LINE}, speed_m_s = 1.2, drive_s = 0.9",
            POLAR,
            "more than the controller's max_v_m_s = 0.95; drive",
        ),
        (f"{CIRCLE}, drive_s = 2", f"{FREE}, max_w_rad_s = 1.5", "the controller's max_w_rad_s = 1.5; drive"),
        (f"{LINE}, speed_m_s = 0.4, ramp_s = 0.04, drive_s = 2", POLAR, f"max_v_dot_m_s2 = 8; {RAISE}"),
        (f"{CIRCLE}, drive_s = 2", f"{FREE}, max_w_dot_rad_s2 = 3.1", "it needs 3.2 rad/s2, more than the"),
        (f"{CIRCLE}, speed_m_s = 1.2, drive_s = 1.5", f"{FREE}, max_v_m_s = 2, max_w_rad_s = 20", WHEELS),
        (f"{WAY}], speed_m_s = 1.0, accel_m_s2 = 3.0, lateral_accel_m_s2 = 9.0", POLAR, "it needs 0.9"),
    ],
)
def test_what_is_beyond_wheels_or_law_is_refused(reference, controller, expected):
    message = drive_refusal(reference, controller)
    assert re.match(re.escape(PLACE) + r"after \d+\.\d\d s, at \(-?\d+\.\d, -?\d+\.\d\) cm, ", message)
    assert expected in message


def test_what_limits_just_allow_is_not_refused():
    accepted(f"{LINE}, speed_m_s = 0.4, ramp_s = 0.5, drive_s = 2", f"{POLAR}, max_v_m_s = 0.4")
    accepted(f"{LINE}, drive_s = 2", f"{POLAR}, max_v_dot_m_s2 = 0.4")


def test_a_start_at_full_speed_is_a_change_within_one_camera_frame():
    accepted(f"{LINE}, speed_m_s = 0.26, ramp_s = 0.0, drive_s = 2")
    assert "needs 8.991 m/s2" in drive_refusal('kind = "line", speed_m_s = 0.3, ramp_s = 0.0, drive_s = 2')


@pytest.mark.parametrize(
    ("reference", "expected"),
    [
        (CIRCLE, "passes the origin: after 4.17 s, at (-0.0, 0.0) cm, it is 0.04 cm away"),
        (THROUGH, "the law 'yang_kim', which has polar coordinates, needs 2.4 cm; lead it past the origin"),
        (f"{LINE}, start_x_cm = 1.0, drive_s = 3.0", "after 0.00 s, at (1.0, 0.0) cm, it is 1.00 cm away"),
        ('kind = "sine", start_x_cm = -4.0, drive_s = 3.0', "or choose another law, such as body_frame"),
        (f"{WAY}{{ x_cm = 40.0, y_cm = 50.0 }}, {{ x_cm = 1.0, y_cm = 1.0 }}]", "it is 1.41 cm away"),
    ],
)
def test_a_path_past_the_origin_is_refused_under_a_law_in_polar_coordinates_only(reference, expected):
    message = drive_refusal(reference, POLAR, 11.0)
    assert message.startswith(PLACE + "passes the origin: after ")
    assert expected in message
    accepted(reference, FREE, 5.0)


@pytest.mark.parametrize(
    "reference",
    [
        *(LINE, f"{LINE}, speed_m_s = 0.0", f"{LINE}, drive_s = 0.3"),
        f"{LINE}, start_x_cm = 10.0, start_y_cm = 2.5",
        'kind = "sine"',
        f"{WAY}]",
    ],
)
def test_a_path_that_starts_in_the_origin_or_keeps_away_from_it_is_not_refused(reference):
    accepted(reference, POLAR, 5.0)


def test_a_closed_path_may_belong_to_a_run_of_a_day():
    points = "{ x_cm = 20, y_cm = 10 }, { x_cm = 70, y_cm = 20 }, { x_cm = 30, y_cm = 50 }"
    accepted(f'kind = "waypoints", closed = true, points = [{points}]', FREE, 86_400.0)
    accepted('kind = "arc", start_x_cm = 50, curvature_per_m = 5.0, heading_deg = 0.0', FREE, 86_400.0)


@pytest.mark.parametrize(
    ("reference", "expected"),
    [
        ('kind = "waypoints"', "reference.points: this key is missing"),
        ('kind = "waypoints", points = []', "reference.points: there are 0; give 2 to 200"),
        ('kind = "waypoints", points = [3]', "reference.points[0]: expected a table, got a whole number (3)"),
        (f"{WAY}{{ x_cm = 66.0, y_cm = 20.0 }}]", "reference.points[2]: less than 7.5 cm from points[1]"),
        (f"{WAY}{{ x_cm = nan, y_cm = 20 }}]", "points[2].x_cm: nan is not a number that can be used"),
        (f"{WAY}{{ x_cm = 80, y = 20 }}]", "reference.points[2].y: unknown key; use y_cm, in centimetres"),
        (f"{WAY}{{ x_cm = 118.0, y_cm = 20.0 }}]", "reference: leaves the pitch after"),
        ('kind = "sine", wavelength_cm = 0.0', "wavelength_cm: 0.0 is out of range; must be >= 1.0"),
        ('kind = "sine", amplitude_cm = inf', "amplitude_cm: inf is not a number that can be used"),
        (CIRCLE, "reference: passes the origin"),
    ],
)
def test_points_and_sizes_that_make_no_path_are_named_with_their_place(reference, expected):
    assert expected in drive_refusal(reference, POLAR, 12.0)


TEXT = """
name = "place"
duration_s = {duration_s}
[[network]]
[[network.robot]]
slot = 1
[[network.robot]]
{start}
reference = {{ {reference} }}
"""
HERE = "network[0].robot[1]"
SPOTS = st.builds(Posture, st.floats(-0.3, 1.4), st.floats(-0.3, 1.1), st.floats(-math.pi, math.pi))


def text(start="", reference=LINE, duration_s=1.0):
    whole = TEXT.format(duration_s=duration_s, start=start, reference=reference)
    return whole.replace("slot = 1\n", f"slot = 1\nreference = {{ {LINE}, drive_s = 1.0 }}\n")


def refusal(*arguments, **options):
    with pytest.raises(ScenarioError) as caught:
        parse(text(*arguments, **options), "my.toml")
    return str(caught.value)


@given(SPOTS)
@example(Posture(1.1625, 0.0, 0.0))
@example(Posture(1.1625, 0.0, math.pi / 4))
def test_a_robot_is_on_the_pitch_when_its_four_corners_are(at):
    half, turned = 0.0375, cmath.exp(1j * at.theta_rad)
    spots = [
        complex(at.x_m, at.y_m) + turned * complex(*corner) for corner in product((-half, half), repeat=2)
    ]
    room = min(min(spot.real + 0.10, 1.20 - spot.real, spot.imag + 0.10, 0.80 - spot.imag) for spot in spots)
    if abs(room) > 1e-12:
        assert pitch.holds(at) == (room > 0.0)


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        (
            "start_error_x_cm = 900\nstart_error_y_cm = -900",
            f"my.toml: {HERE}.start_error_x_cm: the robot starts off the pitch: a square of 7.5 cm there takes"
            " x = 896.25 to 903.75 cm; the pitch has -10 to 120 cm; start nearer to the reference",
        ),
        ("start_error_y_cm = 76.3", f"{HERE}.start_error_y_cm: the robot starts off the pitch"),
        ("start_error_y_cm = 75\nstart_error_theta_rad = 0.78", "takes y = 69.70 to 80.30 cm"),
        ("start_error_x_cm = -6.3", "takes x = -10.05 to -2.55 cm"),
    ],
)
def test_a_start_off_the_pitch_is_refused(start, expected):
    assert expected in refusal(start)


def test_a_start_at_the_very_edge_is_none_of_these():
    for start in ("start_error_y_cm = 76.2", "start_error_x_cm = -6.2", "start_error_y_cm = 74"):
        parse(text(start), "my.toml")


@pytest.mark.parametrize(
    ("reference", "duration_s", "expected"),
    [
        (LINE, 60.0, "reference: leaves the pitch after 6.07 s of 60 s: a square of 7.5 cm there takes x ="),
        (LINE, 86_400.0, "let it stop before, drive_s = 6.05, or slow it down"),
        (f"{LINE}, heading_deg = 180.0", 6.0, "leaves the pitch after 0.57 s of 6 s"),
        (f"{LINE}, heading_deg = 90.0, drive_s = 5.0", 60.0, "takes y ="),
        (f"{LINE}, speed_m_s = 1.46, ramp_s = 1000.0", 86_400.0, "leaves the pitch after 39."),
        ('kind = "arc", curvature_per_m = 1.0', 6.0, "reference: leaves the pitch after"),
    ],
)
def test_a_reference_that_leads_off_the_pitch_is_refused(reference, duration_s, expected):
    message = refusal("", reference, duration_s)
    assert message.startswith(f"my.toml: {HERE}.reference")
    assert expected in message


@pytest.mark.parametrize(
    "reference",
    [
        f"{LINE}, drive_s = 6.0",
        f"{LINE}, drive_s = 0.0",
        f"{LINE}, speed_m_s = 0.0",
        f"{LINE}, speed_m_s = 1e-5",
        'kind = "arc", drive_s = 6.0',
        'kind = "arc", curvature_per_m = 30.0, drive_s = 0.5, heading_deg = 0.0',
    ],
)
def test_a_reference_that_stands_in_time_may_belong_to_a_run_of_any_length(reference):
    parse(text("", reference, 86_400.0), "my.toml")


def test_the_remedy_that_is_named_is_one():
    for reference in (LINE, 'kind = "arc", curvature_per_m = 1.0'):
        message = refusal("", reference, 20.0)
        drive_s = message.partition("drive_s = ")[2].partition(",")[0]
        parse(text("", f"{reference}, drive_s = {drive_s}", 20.0), "my.toml")


def test_drive_s_says_when_the_reference_stands():
    scenario = parse(text("", f"{LINE}, drive_s = 2.0", 5.0), "my.toml")
    reference = reference_for(scenario.networks[0].robot[1], 5.0)
    assert reference.at(2.0).posture.x_m == pytest.approx(0.2 * 1.5)
    assert reference.at(4.9).posture == reference.at(2.0).posture


FOREIGN = """
import msgspec
from miro_host.posture import Posture
from miro_host.references.arc import StraightLine
from miro_host.references.interface import ReferenceParameters

class Odd(ReferenceParameters, frozen=True, kw_only=True, tag="odd"):
    how: str

    def trajectory(self, duration_s):
        if self.how == "not made":
            raise RuntimeError("no file of points")
        return Path(self.how) if self.how != "none" else None

class Path:
    def __init__(self, how):
        self.how = how

    def at(self, t_s):
        found = StraightLine().at(min(t_s, 1.0))
        if t_s > 2.0 and self.how == "fails":
            raise KeyError("t_s")
        if t_s > 2.0 and self.how == "leaves":
            return msgspec.structs.replace(found, posture=Posture(2.0, 0.0, 0.0))
        if t_s > 2.0 and self.how == "turns":
            return msgspec.structs.replace(found, posture=Posture(0.0, 0.0, 1e300))
        return found
"""


@pytest.mark.parametrize(
    ("how", "expected"),
    [
        (
            "leaves",
            "leaves the pitch after 2.00 s of 3 s: a square of 7.5 cm there takes x = 196.25 to .* "
            "the pitch has -10 to 120 cm; choose other parameters for it, or duration_s = 1.96",
        ),
        ("turns", "leaves the pitch: angle must be within"),
        ("fails", r"reference 'odd' failed at 2.002000 s: KeyError: 't_s' \("),
        ("not made", r"reference 'odd' cannot be made: RuntimeError: no file of points \("),
        ("none", r"`trajectory` returned None \(.* return an object with the method `at`"),
    ],
)
def test_a_reference_of_another_distribution_is_checked_at_each_camera_frame(
    tmp_path, monkeypatch, how, expected
):
    monkeypatch.syspath_prepend(str(tmp_path))
    install(tmp_path, "odd", "1", {"odd": "plug_odd:Odd"}, "references", plug_odd=FOREIGN)
    message = refusal("", f'kind = "odd", how = "{how}"', 3.0)
    assert message.startswith(f"my.toml: {HERE}.reference: ")
    assert re.search(expected, message)
    parse(text("", 'kind = "odd", how = "good"', 86_400.0), "my.toml")
