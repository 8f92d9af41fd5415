"""The pitch: starts and references that are not on it are refused with place and limits."""

import math
import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from miro_host.posture import Posture
from miro_sim.pitch import ground as pitch
from miro_sim.scenario.build import reference_for
from miro_sim.scenario.file import ScenarioError, builtin_names, load, parse
from tests.host.distribution import install

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
LINE = 'kind = "line"'
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
    corners = [
        (
            at.x_m + ahead * math.cos(at.theta_rad) - aside * math.sin(at.theta_rad),
            at.y_m + ahead * math.sin(at.theta_rad) + aside * math.cos(at.theta_rad),
        )
        for ahead in (-0.0375, 0.0375)
        for aside in (-0.0375, 0.0375)
    ]
    room = min(min(x + 0.10, 1.20 - x, y + 0.10, 0.80 - y) for x, y in corners)
    if abs(room) > 1e-12:
        assert pitch.holds(at) == (room > 0.0)


@pytest.mark.parametrize("name", builtin_names())
def test_the_built_in_scenarios_are_on_the_pitch(name):
    load(name)


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
        (
            'kind = "arc", curvature_per_m = 8.0, heading_deg = -45.0',
            60.0,
            "reference: passes the origin: after",
        ),
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
from miro_host.references.line import StraightLine
from miro_host.references.interface import ReferenceParameters

class Odd(ReferenceParameters, frozen=True, kw_only=True, tag="odd"):
    how: str

    def trajectory(self, duration_s):
        if self.how == "not made":
            raise RuntimeError("no file of points")
        return Path(self.how)

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
