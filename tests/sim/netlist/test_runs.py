"""Every run of `digests.json` is the same with the net list in place of the compiled board, period by period."""

import json

import pytest

from miro_protocol.actions import Power, Reset
from miro_sim.scenario.file import load
from tests.sim.digests import GOLDEN, SHORT
from tests.sim.netlist.runs import Comparison, compared, pair

RUNS = list(json.loads(GOLDEN.read_text()))
OFTEN = (
    "silent",
    "two_teams",
    "curve",
    '"gaussian"',
    '"clicks"',
    "grip=0.1",
    "noise_force",
    "friction=1",
    "ratio=5",
)
FEW = [name for name in RUNS if any(word in name for word in OFTEN)]


def test_the_short_run_has_its_digest_by_either_board():
    one = compared(SHORT)
    assert (one.difference, one.is_golden, one.periods) == ("", True, 15)
    assert one.events > 600


@pytest.mark.parametrize("name", FEW)
def test_a_run_begins_the_same(name):
    one = compared(name, 0.3)
    assert one.difference == ""
    assert one.periods == 9


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_a_run_is_the_same_to_its_end(name):
    assert compared(name).difference == ""


ACTIONS = [
    [Reset(7_000_000, 0, 0, 1), Reset(7_000_123, 0, 0, 0)],
    [Power(7_000_000, 0, 0, 0), Power(9_400_007, 0, 0, 1)],
    [
        Power(7_000_000, 0, 0, 0),
        Reset(7_500_000, 0, 0, 1),
        Power(9_400_007, 0, 0, 1),
        Reset(9_600_000, 0, 0, 0),
    ],
]


@pytest.mark.parametrize("actions", ACTIONS, ids=["reset", "power", "both"])
@pytest.mark.parametrize("variant", ["ideal", "realistic"])
def test_so_is_one_whose_robot_is_reset_or_switched_off_on_its_way(actions, variant):
    scenario = load("fig6", (f"variant={variant}", "duration_s=0.8")).scenario
    comparison = Comparison(pair(scenario, 7))
    for world in comparison.worlds:
        for action in actions:
            world.do(action)
    while not comparison.worlds[0].finished:
        assert comparison.step() == ""
