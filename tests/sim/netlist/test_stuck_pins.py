"""A port pin of a robot that is shorted does the same on the net list as on the compiled board, tick by tick."""

import pytest

from miro_protocol.actions import Fault
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.file import load
from tests.sim.netlist.runs import Comparison, pair

MS = 24_000
SCENARIO = load("silent", ["duration_s=0.6", "stop_on_fault=false"]).scenario
PINS = (
    "P0.0",
    "P0.3",
    "P0.7",
    "P1.0",
    "P2.0",
    "P2.1",
    "P2.2",
    "P2.3",
    "P2.4",
    "P2.5",
    "P3.2",
    "P3.3",
    "P3.6",
)


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("pin", PINS)
def test_a_shorted_pin_does_the_same_to_every_field(pin, level):
    frames = [
        Transmission(round((60 + 33.37 * seq) * MS), DOWN, encode(TeamFrame(0, seq, ((2279, -900),) * 3), 3))
        for seq in range(15)
    ]
    faults = [
        Fault(200 * MS + 7 * level, 0, 0, f"pin {pin} {level}"),
        Fault(400 * MS + 5, 0, 0, f"pin {pin} ok"),
    ]
    comparison = Comparison(pair(SCENARIO, 0, [*frames, *faults]))
    while not comparison.worlds[0].finished:
        assert comparison.step() == ""
