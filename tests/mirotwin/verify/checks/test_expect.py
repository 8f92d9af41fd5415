"""What a scenario may say in `[expect]`, and what is said of what it may not."""

import re

import pytest

from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import load, parse
from mirotwin.verify.checks.expect import ALWAYS_ON, expectations_of, says_anything

TWO = """
name = "two"
duration_s = 1.0
{all}
[[network]]
[[network.robot]]
slot = 0
reference.kind = "line"
{one}
[[network.robot]]
slot = 2
reference.kind = "arc"
"""


def names(all_, one=""):
    scenario = parse(TWO.format(all=all_, one=one), "two")
    return {
        place: [check.name for check in checks] for place, checks in expectations_of(scenario, "two").items()
    }


def test_every_run_has_the_checks_that_are_always_on():
    assert names("") == {(0, 0): list(ALWAYS_ON), (0, 2): list(ALWAYS_ON)}
    assert not says_anything(load("line").scenario)


@pytest.mark.parametrize("name", ["fig6", "fig7", "fig8", "fig9", "fig10"])
def test_the_scenarios_of_the_paper_expect_a_robot_that_accepts_frames_and_tracks(name):
    assert set(load(name).scenario.expect) == {"frames_accepted_min", "tracks_within_cm"}


def test_a_robot_may_expect_otherwise_than_all():
    all_ = "[expect]\ninside_pitch = true\ntracks_within_cm = 3\n"
    one = (
        "[network.robot.expect]\ntracks_within_cm = { limit_cm = 2.0, from_s = 0.5 }\ninside_pitch = false\n"
    )
    assert names(all_, one) == {
        (0, 0): [*ALWAYS_ON, "tracks_within_cm"],
        (0, 2): [*ALWAYS_ON, "inside_pitch", "tracks_within_cm"],
    }
    scenario = parse(TWO.format(all=all_, one=one), "two")
    first, second = (checks[-1] for checks in expectations_of(scenario, "two").values())
    assert (first.limit_cm, first.from_s, second.limit_cm, second.from_s) == (2.0, 0.5, 3.0, None)
    assert says_anything(scenario)


def test_who_asks_for_a_check_that_is_none_is_told_how_one_is_made():
    both = "; `mirotwin scenarios checks` lists them, `mirotwin examples checks` writes one"
    with pytest.raises(ScenarioError, match=both):
        names("[expect]\nfast = 1\n")


WRONG = {
    "tracks_within_m = 0.03": "tracks_within_m: there is no such check; use tracks_within_cm, in centim",
    "setles_within_s = 1": "setles_within_s: there is no such check; did you mean settles_within_s?",
    "tracks_within_cm = true": "tracks_within_cm: limit_cm is missing; give it: tracks_within_cm = ..",
    "tracks_within_cm = '3 cm'": "tracks_within_cm: expected a number in centimetres, got a string",
    "tracks_within_cm = -1": "tracks_within_cm: -1 is out of range; must be > 0.0 in centimetres",
    "tracks_within_cm = {limit_m = 1}": "tracks_within_cm.limit_m: unknown key; use limit_cm, in",
    "tracks_within_cm = {limit_cm = 1, from_s = -1}": "tracks_within_cm.from_s: -1 is out of range",
    "settles_within_s = 1.01": "settles_within_s: 1.01 s is not before the end of the run, 1.001 s",
    "inside_pitch = 1": "inside_pitch: expected true or false, got 1; write inside_pitch = true",
    "no_fault = false": "no_fault: this check is always on; remove the key",
    "failsafe_stop_ms = 5": "failsafe_stop_ms: 5 is out of range; must be > 10.0 in milliseconds",
    "failsafe_stop_ms = [110]": "failsafe_stop_ms: expected a number in milliseconds, got an array",
    "frames_accepted_min = 1.5": "frames_accepted_min: expected a whole number, got a number (1.5)",
    "never_happens.until_tick = 24000\nnever_happens.condition = { event = 'edge', pin = 'rxd' }": (
        "never_happens.condition.event: 'edge' is not one of the choices"
    ),
}


@pytest.mark.parametrize("lines", WRONG)
def test_what_cannot_be_expected_is_said_with_its_path(lines):
    with pytest.raises(ScenarioError, match=re.escape(f"two: expect.{WRONG[lines]}")):
        names(f"[expect]\n{lines}\n")


@pytest.mark.parametrize("value", ["true", "'v<0.05'", "3"])
def test_a_check_that_takes_a_table_is_answered_with_one_that_can_be_used(value):
    table = '{ condition = { event = "fault" }, until_tick = 24000000 }'
    said = f"two: expect.never_happens: never_happens takes a table; write never_happens = {table}; event: answer, "
    with pytest.raises(ScenarioError, match=re.escape(said)):
        names(f"[expect]\nnever_happens = {value}")
    assert names(f"[expect]\nnever_happens = {table}")[0, 0] == [*ALWAYS_ON, "never_happens"]


def test_the_path_of_one_robots_expectation_is_its_own():
    with pytest.raises(
        ScenarioError, match=r"two: network\[0\]\.robot\[0\]\.expect\.inside_pitsch: there is"
    ):
        names("", "[network.robot.expect]\ninside_pitsch = true\n")


def test_a_setting_is_named_as_it_was_given():
    with pytest.raises(ScenarioError, match=r"fig6: --expect inside_pitch=3: expected true or false, got 3"):
        load("fig6", ["expect.inside_pitch=3"], expectations_of)
    with pytest.raises(
        ScenarioError, match=r"fig6: --set network.robot.expect.inside_pitch=3: expected true or"
    ):
        load("fig6", ["network.robot.expect.inside_pitch=3"], expectations_of)
