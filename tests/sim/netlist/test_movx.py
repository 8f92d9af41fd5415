"""LM629 on the external bus: strobes of a MOVX, and lines on an output latch, make the same faults on either board."""

import msgspec
import pytest

from miro_robot.board_spec import LatchSpec
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring
from miro_sim.scenario.board_file import load_board
from tests.robot.board.rig import MS, RESET, START, board_with, image_of, raw_movx_wiring
from tests.robot.board.test_faults import READ, WRITE, latched_wiring
from tests.sim.netlist.net_board import NetBoard

SIDES = ("left", "right")
STRAY = START + "MOV DPTR,#0D300h\nguilty:\nMOVX @DPTR,A\nSJMP $"


def rewired(change):
    """MIRO's board with the wires of both LM629 changed."""
    spec = load_board("miro")
    wires = {
        side: {pin: change(pin, to) for pin, to in spec.parts[side].pins.items() if pin not in ("a", "b")}
        for side in SIDES
    }
    parts = {
        name: msgspec.structs.replace(part, pins=part.pins | wires.get(name, {}))
        for name, part in spec.parts.items()
    }
    return msgspec.structs.replace(spec, parts=parts)


def both(text, wiring, spec, stops):
    twin = NetBoard(Plant(), stop_on_fault=stops, image=image_of(text), spec=spec)
    twin.cpu.rxd.settled_tick = 1 << 60
    boards = (board_with(text, wiring, stop_on_fault=stops), twin)
    for board in boards:
        board.run(3 * MS)
    return boards


@pytest.mark.parametrize("stops", [True, False])
@pytest.mark.parametrize(
    ("text", "wiring", "spec"),
    [
        (WRITE, raw_movx_wiring(), rewired(lambda pin, to: {"wr": "P3.6", "rd": "P3.7"}.get(pin, to))),
        (READ, raw_movx_wiring(), rewired(lambda pin, to: {"wr": "P3.6", "rd": "P3.7"}.get(pin, to))),
        (STRAY, load_wiring(), load_board("miro")),
    ],
    ids=["strobes that write", "strobes that read", "an address on P2"],
)
def test_what_a_movx_breaks_it_breaks_on_the_net_list(text, wiring, spec, stops):
    compiled, twin = both(text, wiring, spec, stops)
    assert compiled.faults
    assert compiled.faults == twin.faults
    assert compiled.left.commands == twin.left.commands
    assert compiled.cpu.peek_iram(0x40) == twin.cpu.peek_iram(0x40)


def test_strobes_on_an_output_latch_do_the_same():
    def put(*values):
        return "".join(f"MOV A,#{value}\nMOVX @DPTR,A\n" for value in values)

    text = START + "MOV DPTR,#0\n" + put("0DFh", "0FFh") + RESET[RESET.index("MOV R6") :] + "MOV P1,#2\n"
    text += put("0FEh", "0F6h", "0F2h", "0F6h", "0FEh") + "MOV P1,#0FFh\nSJMP $"
    spec = rewired(lambda pin, to: to.replace("P2.", "CTRL.").replace("P0.", "P1."))
    spec = msgspec.structs.replace(spec, straps={}, latches={"CTRL": LatchSpec(address=0)}, pull_ups=())
    compiled, twin = both(text, latched_wiring(), spec, True)
    assert compiled.faults == twin.faults == []
    assert [command[1] for command in twin.left.commands] == [0x02]
    assert compiled.left.commands == twin.left.commands


@pytest.mark.parametrize("pin", [6, 7])
@pytest.mark.parametrize("text", [WRITE, READ])
def test_strobes_of_a_movx_on_a_shorted_pin_do_the_same(text, pin):
    spec = rewired(lambda pin, to: {"wr": "P3.6", "rd": "P3.7"}.get(pin, to))
    twin = NetBoard(Plant(), stop_on_fault=False, image=image_of(text), spec=spec)
    twin.cpu.rxd.settled_tick = 1 << 60
    compiled = board_with(text, raw_movx_wiring(), stop_on_fault=False)
    for board in (compiled, twin):
        board.hold_pin(3, pin, 0)
        board.run(3 * MS)
    assert compiled.left.commands == twin.left.commands
    assert compiled.cpu.peek_iram(0x40) == twin.cpu.peek_iram(0x40)
