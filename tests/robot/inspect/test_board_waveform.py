"""The waveform of a board of parts: every net, each edge on its tick."""

import io
from itertools import pairwise

from miro_exact.clock import NEVER_TICK
from miro_exact.rng import Stream
from miro_exact.state import FLAG
from miro_robot.board_spec import BoardSpec
from miro_robot.inspect.waveform import Waveform, net_signals
from miro_robot.parts.keys import HIGH, IN, LOW, STRONG, PartKeys, Pin, Place
from miro_robot.parts.led import Led
from miro_robot.parts.netlist import Netlist, PartPin
from miro_robot.parts.part import Part
from miro_robot.wired_board import WiredBoard
from tests.robot.inspect.reading import read
from tests.robot.mcs51.asm import image_of

DELAY_TICKS = 100
PULSES = """
again:
CPL P1.0
MOV R7,#20
DJNZ R7,$
SJMP again
"""
"""P1.0 changes every 44 machine cycles: 1 + 1 + 2 * 20 + 2."""
EDGE_TICKS = 12 * 44


class Echo(PartKeys, frozen=True, kw_only=True, tag="echo"):
    """Raises its output a fixed time after its input rises, and lowers it when that falls."""

    PINS = (Pin("in", IN), Pin("out", STRONG))

    def make(self, place):
        return EchoPart(self, place)


class EchoPart(Part):
    STATE = {"up": FLAG}

    def start(self, tick):
        self.up = 0
        self.drive(1, LOW)

    def changed(self, pins, tick):
        if self.level(0):
            self.next_tick = tick + DELAY_TICKS
        else:
            self.next_tick = NEVER_TICK
            self.drive(1, LOW)

    def due(self, tick):
        self.next_tick = NEVER_TICK
        self.drive(1, HIGH)


def board_of_parts():
    """P1.0 to the input of an echo, its output to P3.2; a LED at P1.0."""
    ports = [-1] * 32
    ports[8], ports[26] = 0, 1
    netlist = Netlist(
        names=("PULSE", "bridge.out1"),
        ports=tuple(ports),
        parts=((PartPin(0), PartPin(1)), (PartPin(0),)),
    )
    keys = (Echo(), Led())
    parts = [
        one.make(Place(name, 24_000_000, Stream(0, name), frozenset((0,)), {}))
        for name, one in zip("ab", keys, strict=True)
    ]
    return WiredBoard(BoardSpec(), image_of(PULSES), netlist, parts)


def recorded(board, ticks, **window):
    out = io.StringIO()
    waveform = Waveform(out, board, **window).attach(board.cpu)
    for tick in ticks:
        board.run(tick)
    waveform.close()
    return read(out.getvalue().encode())


def test_every_net_has_its_edges_on_the_ticks_at_which_ports_and_parts_move_it():
    vcd = recorded(board_of_parts(), [10_000])
    pulse = vcd.wires["PULSE"]
    assert [level for _, level in pulse[:4]] == [1, 0, 1, 0]
    assert {after - before for (before, _), (after, _) in pairwise(pulse[1:])} == {EDGE_TICKS}
    assert pulse == vcd.wires["p1_0"]
    rises = [tick + DELAY_TICKS for tick, level in pulse[1:] if level]
    answers = vcd.wires["bridge_out1"]
    assert [tick for tick, level in answers[1:] if level] == [tick for tick in rises if tick < vcd.last_tick]
    assert answers == vcd.wires["p3_2"]


def test_a_window_of_it_is_the_part_of_the_whole_however_it_is_cut():
    whole = recorded(board_of_parts(), [40_000])
    board = board_of_parts()
    board.run(15_000)
    window = recorded(board, range(15_500, 40_500, 500))
    assert window.first_tick > 15_000
    for wire in ("PULSE", "bridge_out1", "p1_0", "p3_2"):
        later = [change for change in whole.wires[wire] if window.first_tick < change[0] < 40_000]
        assert window.wires[wire][1:] == later
        assert window.wires[wire][0][1] == whole.level_at(wire, window.first_tick)


def test_names_that_viewers_would_take_for_one_stay_apart():
    assert [signal.name for signal in net_signals(["A.1", "A_1", "B"])] == ["A_1", "A_1_", "B"]


def test_two_waveforms_of_a_board_are_the_same():
    board = board_of_parts()
    files = io.StringIO(), io.StringIO()
    waveforms = [Waveform(file, board).attach(board.cpu) for file in files]
    board.run(2_000)
    for waveform in waveforms:
        waveform.close()
    assert files[0].getvalue() == files[1].getvalue()
