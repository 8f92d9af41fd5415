"""The marker of a test: which keys it has, and which one holds."""

import pytest

from miro_exact.bad_input import BadInput
from mirotwin.testing.rig import Rig
from mirotwin.verify.checks.expect import ALWAYS_ON
from mirotwin.verify.rig_options import marker_options, rig_options
from tests.mirotwin.testing.rigs import HERE


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"scnario": "fig6"}, "there is no key 'scnario'; did you mean scenario?"),
        ({"scenario": "fig16"}, "fig16: no such scenario; did you mean fig6?"),
        ({"scenario": "gone.toml"}, "gone.toml: no such file"),
        ({"scenario": 6}, "scenario=6; give a built-in scenario's name, a path, or a table"),
        ({"scenario": {"network.radio.latncy_s": 1}}, r"--set network\.radio\.latncy_s=1: unknown key"),
        ({"settings": "a=1"}, "settings='a=1'; give a list"),
        ({"settings": ["a"]}, r"settings=\['a'\]; give a list"),
        ({"firmware": "gone.ihx"}, "gone.ihx: there is no such file"),
        ({"seed": -1}, "seed: -1 is out of range"),
        ({"seed": True}, "seed=True; give a whole number"),
        ({"expect": {"no_fualt": True}}, "expect.no_fualt: there is no such check"),
        ({"boot": 1}, "boot=1; give True or False"),
    ],
)
def test_a_marker_that_cannot_be_met_is_refused_with_the_remedy(keys, said):
    mark = dict(keys)
    with pytest.raises(BadInput, match=said):
        Rig(rig_options(marker_options([((), mark)]), HERE, None, mark.get("seed", 0)))


def test_a_marker_without_names_is_refused():
    with pytest.raises(BadInput, match="'fig6' has no name; write scenario='fig6'"):
        marker_options([(("fig6",), {})])


def test_the_innermost_marker_holds_and_settings_and_expectations_add_up():
    inner = {"seed": 1, "settings": ["duration_s=2"], "expect": {"inside_pitch": True}}
    outer = {
        "seed": 2,
        "scenario": {"duration_s": 9},
        "settings": ["duration_s=3", "network.robots=5"],
        "expect": {"inside_pitch": False, "frames_accepted_min": 1},
    }
    found = marker_options([((), inner), ((), outer)])
    assert found.seed == 1
    assert found.settings == ("duration_s=3", "network.robots=5", "duration_s=2")
    assert found.expect == {"inside_pitch": True, "frames_accepted_min": 1}
    made = rig_options(found, HERE, None, 0)
    assert (made.scenario.duration_s, made.scenario.networks[0].robots) == (2, 5)
    assert [check.name for check in made.expected[0, 0]][len(ALWAYS_ON) :] == [
        "inside_pitch",
        "frames_accepted_min",
    ]


def test_a_table_as_scenario_changes_keys_of_the_silent_one():
    table = {"network.radio": {"profile": "fade15", "keyup_s": 0.002}, "duration_s": 5}
    made = rig_options(marker_options([((), {"scenario": table})]), HERE, None, 0)
    assert made.scenario.networks[0].radio.keyup_s == 0.002
    assert made.scenario.networks[0].host == "silent"
