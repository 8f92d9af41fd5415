"""A processor with parts around it: exact to the tick, whatever pieces it is run in."""

import hashlib
import random

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from miro_exact.plugins import PluginError
from miro_exact.state import Flat
from miro_robot.empty_board import EmptyBoard
from miro_robot.mcs51.cpu import STOPPED
from miro_robot.parts.keys import HIGH, LOW, RELEASED
from miro_robot.parts.led import Led
from miro_robot.parts.netlist import Netlist, PartPin
from miro_sim.scenario.terminal import PinEvent
from tests import children
from tests.alone import Alone
from tests.robot.mcs51.asm import image_of
from tests.robot.parts.scripted import (
    A,
    Answer,
    D,
    Q,
    Scripted,
    ScriptedPart,
    W,
    board_of,
    place,
    scripted,
    wired,
)
from tests.states import restore, snapshot

P1, P2, P3 = 1, 2, 3
INTERRUPTS = """
LJMP main
ORG 3
INC 30h
MOV 31h,TL0
RETI
ORG 13h
INC 32h
RETI
ORG 40h
main:
MOV TMOD,#15h
MOV TCON,#55h
MOV T2CON,#0Dh
MOV IE,#85h
"""
POLL = """
loop:
MOV A,P1
MOVX @DPTR,A
INC DPTR
MOV A,P2
XRL A,33h
MOV 33h,A
MOV A,P3
MOVX @DPTR,A
INC DPTR
SJMP loop
"""
REGISTERS = """
loop:
MOV TCON,#55h
MOV TL0,#0F0h
ANL TCON,#5Fh
MOV TMOD,#1Dh
MOV TMOD,#15h
CPL P3.2
MOV P1,#0FDh
MOV A,TCON
MOVX @DPTR,A
INC DPTR
MOV P1,#0FFh
SETB P3.2
MOV T2CON,#0Fh
MOV A,TL0
MOVX @DPTR,A
INC DPTR
MOV T2CON,#0Dh
SJMP loop
"""
SLEEP = "loop:\nORL PCON,#1\nMOV A,P1\nMOVX @DPTR,A\nINC DPTR\nSJMP loop\n"
P1_0, P3_2 = (P1, 0), (P3, 2)
PINS = [(P1, 0), (P1, 1), (P1, 5), (P2, 3), (P3, 2), (P3, 3), (P3, 4), (P3, 7)]
END = 9_000


def of_edges(program, edges):
    """A board on which a part at each pin pulls it low and lets it go."""
    parts, ports = [], {}
    for number, pin in enumerate(PINS):
        events = [(tick, D, RELEASED if level else LOW) for tick, *at, level in edges if tuple(at) == pin]
        parts.append(scripted(f"part{number}", events))
        ports[pin] = f"n{number}"
    return board_of(program, wired(ports, [{D: f"n{number}"} for number in range(len(PINS))]), parts)


@st.composite
def edge_lists(draw):
    ticks = draw(st.lists(st.integers(1, END - 200), max_size=30, unique=True))
    levels = dict.fromkeys(PINS, 1)
    edges = []
    for tick in sorted(ticks):
        pin = draw(st.sampled_from(PINS))
        levels[pin] ^= 1
        edges.append((tick, *pin, levels[pin]))
    return edges


TWICE_IN_A_CYCLE = [(1, *P1_0, 0), (70, *P3_2, 0), (82, *P3_2, 1), (454, *P1_0, 1), (464, *P1_0, 0)]
"""Pins are sampled once in the cycle from 453 to 465, in which a MOVX begins that moves the pins of its bus at 464."""


@pytest.mark.parametrize("program", [POLL, REGISTERS, SLEEP], ids=["polled", "registers", "asleep"])
@given(edge_lists())
@example(TWICE_IN_A_CYCLE)
def test_an_edge_from_a_part_is_one_from_a_file_of_pins(program, edges):
    bare = Alone(image_of(INTERRUPTS + program), pins=tuple(PinEvent(*edge) for edge in edges))
    bare.board.stop_at_end = False
    bare.world.run_to(END)
    board = of_edges(INTERRUPTS + program, edges)
    board.cpu.rxd.settled_tick = bare.cpu.rxd.settled_tick
    board.run(END)
    assert snapshot(board.cpu) == snapshot(bare.cpu)
    assert board.xram() == bare.board.xram()


# In pieces

BUSY = (
    INTERRUPTS
    + """
loop:
INC P1
MOV A,P1
MOVX @DPTR,A
INC DPTR
MOV P0,A
XRL P2,#41h
CPL P3.5
MOV A,P2
ADD A,34h
MOV 34h,A
JNB P3.3,loop
CPL P3.6
SJMP loop
"""
)


def random_board(seed):
    """Parts that answer each other and the CPU, with delays and without, by chance."""
    chance = random.Random(seed)
    ports = {
        (port, bit): f"p{port}{bit}"
        for port in range(4)
        for bit in range(8)
        if (port, bit) not in ((3, 0), (3, 1))
    }
    names = list(ports.values())
    parts, wiring = [], []
    for number in range(6):
        events = sorted(
            (chance.randint(1, 20_000), chance.choice([D, D, W]), chance.choice([LOW, RELEASED]))
            for _ in range(6)
        )
        answers = [
            Answer(
                chance.choice([A, W]),
                D,
                chance.choice([None, LOW]),
                chance.randint(0, 1),
                chance.choice([0, 5, 300]),
            ),
            Answer(A, W, chance.choice([LOW, RELEASED]), 0, chance.randint(1, 90)),
        ]
        parts.append(scripted(f"part{number}", events, answers[: chance.randint(0, 2)]))
        wiring.append(
            {A: chance.choice(names), D: chance.choice(names), W: chance.choice([*names, "x", "y"])}
        )
    return board_of(BUSY, wired(ports, wiring), parts, stop_on_fault=False)


@given(st.integers(0, 1 << 30), st.lists(st.integers(1, 9_000), max_size=20))
def test_pieces_and_saved_states_change_no_bit(seed, pieces):
    whole, cut, loaded = (random_board(seed) for _ in range(3))
    try:
        whole.run(30_000)
    except PluginError:
        return
    tick = 0
    for piece in pieces:
        tick = min(tick + piece, 30_000)
        cut.run(tick)
        loaded.run(tick)
        state = Flat(loaded).save()
        loaded = random_board(seed)
        restore(loaded, state)
        assert snapshot(loaded) == state
    for board in (cut, loaded):
        board.run(30_000)
        assert snapshot(board) == snapshot(whole)
    assert cut.faults == whole.faults
    assert [part.heard for part in cut.parts] == [part.heard for part in whole.parts]


def digest():
    """Over the states of some boards, at many ticks."""
    states = hashlib.sha256()
    for seed in range(12):
        board = random_board(seed)
        for tick in range(1_000, 20_000, 1_777):
            try:
                board.run(tick)
            except PluginError as error:
                states.update(str(error).encode())
                break
            states.update(snapshot(board))
    return states.hexdigest()


def test_both_engines_do_the_same():
    assert children.same_uncompiled(digest)


def test_a_part_that_reaches_no_pin_does_not_hold_the_cpu_up():
    part = scripted("a", [(tick, D, 2 * (tick & 1)) for tick in range(100, 200)])
    board = board_of(POLL, wired({}, [{D: "n"}]), [part])
    board.run(150)
    assert part.heard[-1][0] == 149
    board.run(1_000)
    assert part.heard[-1][0] == 199


# What the CPU writes


def test_a_part_hears_of_a_write_when_the_pin_moves_and_answers_at_once():
    part = scripted("a", answers=[Answer(A, D)])
    netlist = wired({(P1, 3): "out", (P2, 0): "in"}, [{A: "out", D: "in"}])
    board = board_of("CLR P1.3\nMOV A,P2\nMOV 30h,A\nSJMP $", netlist, [part])
    board.run(120)
    assert part.heard[0][:3] == (12, "changed", 1 << A)
    assert board.cpu.peek_iram(0x30) == 0xFE


def test_all_bits_of_a_port_move_at_once():
    part = scripted("a")
    board = board_of("MOV P1,#0F3h\nSJMP $", wired({(P1, 2): "x", (P1, 3): "y"}, [{A: "x", W: "y"}]), [part])
    board.run(120)
    assert [call[:3] for call in part.heard] == [(24, "changed", 1 << A | 1 << W)]


def test_contention_stops_the_run_after_the_instruction():
    board = board_of(
        "NOP\nCLR P1.2\nNOP\nSJMP $", wired({(P1, 2): "n"}, [{Q: "n"}]), [scripted("a", [(3, Q, HIGH)])]
    )
    assert board.run(10_000) == STOPPED
    assert board.cpu.cycles == 2
    assert [(fault.tick, fault.pc) for fault in board.faults] == [(24, 1)]


def test_contention_of_two_parts_stops_it_at_the_same_place_whatever_the_pieces():
    def contending():
        parts = [scripted("a", [(1_000, Q, HIGH)]), scripted("b", [(500, D, LOW)])]
        return board_of("loop:\nSJMP loop", wired({}, [{Q: "n"}, {D: "n"}]), parts)

    whole, cut = contending(), contending()
    assert whole.run(100_000) == STOPPED
    assert [cut.run(tick) for tick in (400, 700, 5_000)] == [0, 0, STOPPED]
    assert cut.cpu.cycles == whole.cpu.cycles == 82
    assert cut.faults == whole.faults


# Straps, RST, supply


def test_what_ties_a_pin_holds_it_from_the_beginning():
    board = board_of("MOV 30h,P3\nSJMP $", wired({(P3, 4): "n"}, [], lows=["n"]))
    board.run(120)
    assert board.cpu.peek_iram(0x30) == 0xEF


def test_a_reset_moves_all_ports_and_parts_go_on():
    part = scripted("a", [(600, D, LOW)])
    board = board_of("MOV P1,#0\nSJMP $", wired({(P1, 2): "n", (P1, 3): "m"}, [{A: "n", D: "m"}]), [part])
    board.run(120)
    board.set_reset(1)
    board.run(1_200)
    assert [call[:2] for call in part.heard] == [
        (24, "changed"),
        (120, "changed"),
        (600, "due"),
        (600, "changed"),
    ]


class Kept(ScriptedPart):
    """Counts how often it was started."""

    STATE = {"starts": ("q", 0, 99)}

    def __init__(self, keys, place):
        ScriptedPart.__init__(self, keys, place)
        self.starts = 0

    def start(self, tick):
        self.starts += 1
        self.drive(Q, LOW)


def test_without_supply_parts_let_go_and_hear_nothing():
    part = Kept(Scripted(), place("a"))
    board = board_of(
        "SETB P1.2\nMOV P1,#0\nSJMP $", wired({(P1, 2): "n", (P1, 7): "m"}, [{A: "n", Q: "m"}]), [part]
    )
    net = board.nets.number("m")
    board.run(120)
    assert (part.starts, board.nets.levels[net]) == (1, 0)
    board.set_power(0)
    board.run(1_200)
    assert board.nets.levels[net] == 1
    assert [call[0] for call in part.heard] == [0, 36]
    board.put("a", "drive", LOW, 1_300)
    assert board.nets.levels[net] == 1
    state = snapshot(board)
    restore(board, state)
    assert snapshot(board) == state
    board.set_power(1)
    board.run(3_000)
    assert (part.starts, board.nets.levels[net]) == (2, 0)


# Tests put and read


def test_a_put_comes_first_on_its_tick():
    part = scripted("a", [(601, D, LOW)])
    board = board_of("SJMP $", wired({(P1, 2): "n", (P1, 3): "m"}, [{Q: "n", A: "n", D: "m"}]), [part])
    board.run(599)
    board.put("a", "drive", LOW, 601)
    assert board.nets.levels[board.nets.number("n")] == 0
    board.run(700)
    assert [call[:2] for call in part.heard] == [(601, "changed"), (601, "due"), (601, "changed")]


def test_a_put_acts_between_two_instructions():
    part = scripted("a")
    board = board_of("MUL AB\nMOV A,P1\nSJMP $", wired({(P1, 2): "n"}, [{Q: "n", A: "n"}]), [part])
    board.run(13)
    board.put("a", "drive", LOW, 13)
    assert part.heard[0][0] == 48
    board.run(72)
    assert board.cpu.a == 0xFB


class Odd(ScriptedPart):
    value = 1.0

    def read(self, name, tick):
        return self.value if self.value is not None else 1 // 0

    def put(self, name, value, tick):
        raise RuntimeError("broken")


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (float("nan"), "part 'a' (scripted), tick 0, value count: is NaN; repair the part"),
        (float("-inf"), "part 'a' (scripted), tick 0, value count: is -inf; repair the part"),
        (1 << 63, "part 'a' (scripted), tick 0, value count: has more than 63 bits; repair the part"),
        ([], "part 'a' (scripted), tick 0, value count: is list; return a number, a text or a boolean"),
        (None, "part 'a' (scripted), tick 0, value count: ZeroDivisionError: "),
    ],
)
def test_a_value_that_cannot_be_is_refused(value, said):
    board = board_of(
        netlist=wired({}, [{}]), parts=[scripted("a", cls=type("Odd", (Odd,), {"value": value}))]
    )
    with pytest.raises(PluginError) as raised:
        board.value("a", "count")
    assert str(raised.value).startswith(said)


def test_a_put_that_raises_names_part_and_tick():
    board = board_of(netlist=wired({}, [{}]), parts=[scripted("a", cls=Odd)])
    with pytest.raises(PluginError, match=r"part 'a' \(scripted\), tick 7: put drive: RuntimeError: broken"):
        board.put("a", "drive", 1, 7)


# The end of a program


@pytest.mark.parametrize(
    ("program", "ended"),
    [
        ("SJMP $", 1),
        ("ORL PCON,#2", 1),
        ("ORL PCON,#1", 1),
        ("MOV IE,#81h\nORL PCON,#1", 0),
        ("MOV IE,#81h\nSJMP $", 0),
    ],
)
def test_a_program_has_ended_when_no_part_can_make_it_go_on(program, ended):
    part = scripted("a", [(900_000, D, LOW)])
    board = board_of(f"{program}\nSJMP $", wired({(P3, 2): "n"}, [{D: "n"}]), [part])
    board.run(600_000)
    assert board.ended == ended


def test_a_board_with_nothing_on_it_is_the_empty_board():
    program = (
        INTERRUPTS
        + "MOV R7,#200\nmore:\nCPL P1.0\nMOVX @DPTR,A\nINC DPTR\nDJNZ R7,more\nMOV IE,#0\nORL PCON,#1"
    )
    board = board_of(program, stop_on_fault=False)
    empty = EmptyBoard(board.spec, image_of(program), False)
    empty.cpu.rxd.settled_tick = 1 << 60
    for tick in range(1_000, 60_000, 3_001):
        board.run(tick)
        empty.run(tick)
        assert snapshot(board) == snapshot(empty) + bytes(8) + bytes(
            [0xFF] * 4
        )  # no latches, nothing from outside
    assert board.ended


def test_a_led_follows_its_pin():
    led = Led().make(place("lamp"))
    netlist = Netlist(names=("n",), ports=(-1,) * 16 + (0,) + (-1,) * 15, parts=((PartPin(0),),))
    board = board_of("CLR P2.0\nNOP\nSETB P2.0\nCLR P2.0\nSJMP $", netlist, [led])
    board.run(120)
    assert (board.value("lamp", "on"), board.value("lamp", "flashes")) == (1, 2)


# RXD

RECEIVE = """
LJMP main
ORG 23h
CLR RI
MOV A,SBUF
MOVX @DPTR,A
INC DPTR
CLR TI
RETI
ORG 40h
main:
MOV TMOD,#21h
MOV TH1,#0FDh
MOV TL1,#0FDh
MOV SCON,#50h
MOV PCON,#80h
SETB TR1
MOV IE,#90h
loop:
MUL AB
JB P3.0,loop
INC 30h
MOV A,SCON
ADD A,31h
MOV 31h,A
SJMP loop
"""
BIT_TICKS = 12 * 16 * 3


def sent(data, tick, bit_ticks):
    """Edges of RXD for some characters."""
    level = 1
    for value in data:
        for bit in (0, *(value >> number & 1 for number in range(8)), 1):
            if bit != level:
                yield tick, 3, 0, bit
            level = bit
            tick += bit_ticks


@given(
    st.binary(min_size=1, max_size=6),
    st.integers(1, 30_000),
    st.integers(-12, 12),
    st.lists(st.integers(1, 50_000)),
)
def test_a_part_on_rxd_is_heard_as_a_file_of_pins_is(data, tick, faster, pieces):
    edges = list(sent(data, tick, BIT_TICKS + faster))
    bare = Alone(image_of(RECEIVE), pins=tuple(PinEvent(*edge) for edge in edges))
    bare.board.stop_at_end = False
    bare.world.run_to(100_000)
    part = scripted("a", [(at, D, RELEASED if level else LOW) for at, _, _, level in edges])
    board = board_of(RECEIVE, wired({(P3, 0): "rxd"}, [{D: "rxd"}]), [part])
    board.cpu.rxd.settled_tick = bare.cpu.rxd.settled_tick
    for until in [*sorted(pieces), 100_000]:
        board.run(until)
    assert snapshot(board.cpu) == snapshot(bare.cpu)
    assert board.xram() == bare.board.xram()
    assert board.drives_rxd


def test_a_part_that_only_listens_at_p3_0_leaves_rxd_to_the_terminal():
    assert not board_of(netlist=wired({(P3, 0): "n"}, [{A: "n"}]), parts=[scripted("a")]).drives_rxd
