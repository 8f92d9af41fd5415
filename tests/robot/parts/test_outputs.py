"""TXD, the shift clock and the data of mode 0, and the clock of timer 2 on the nets of a board."""

import hashlib
import random
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.plugins import PluginError
from miro_exact.state import Flat
from miro_robot.parts.nets import Observer
from tests import children
from tests.robot.parts.scripted import A, Answer, D, Q, W, board_of, scripted, wired
from tests.states import restore, snapshot

TXD, RXD, T2 = (3, 1), (3, 0), (1, 0)
BAUD = "MOV TMOD,#20h\nMOV TH1,#0FDh\nMOV TL1,#0FDh\nSETB TR1\nMOV SCON,#50h\n"
SEND = BAUD + "loop:\nMOV SBUF,#5Ah\nJNB TI,$\nCLR TI\nMOV SBUF,#0\nJNB TI,$\nCLR TI\nSJMP loop"
SHIFT = "MOV SCON,#0\nloop:\nMOV SBUF,#0A6h\nJNB TI,$\nCLR TI\nINC 30h\nSJMP loop"


def heard(program, pin, tick=60_000):
    """The edges of a pin on which a part listens, and the board."""
    board = board_of(program, wired({pin: "n"}, [{A: "n"}]), [scripted("a")], stop_on_fault=False)
    observer = Observer([board.nets.number("n")])
    board.nets.observe(observer)
    board.run(tick)
    assert [call[0] for call in board.parts[0].heard] == [edge[0] for edge in observer.edges]
    return [(at, level) for at, _, level in observer.edges], board


@pytest.mark.parametrize("mode", ["#50h", "#90h", "#0D8h", "#98h"], ids=["1", "2", "3", "2 with TB8"])
def test_txd_has_the_edges_of_the_transmitter(mode):
    edges, board = heard(SEND.replace("#50h", mode), TXD)
    assert edges == [edge for edge in board.cpu.txd.edges() if edge[0] < board.cpu.cycles * 12]
    assert len(edges) > 20


def test_mode_0_clocks_its_bits_on_txd_and_gives_them_on_rxd():
    clock, board = heard(SHIFT, TXD, 3_000)
    assert clock == [edge for edge in board.cpu.txd.edges() if edge[0] < board.cpu.cycles * 12]
    data, board = heard(SHIFT, RXD, 3_000)
    assert data == [
        edge for edge in board.cpu.peripherals.shift.data.edges() if edge[0] < 12 * board.cpu.cycles
    ]
    first = [tick for tick, level in clock if level][:8]
    bits = [[level for tick, level in data if tick <= rise] for rise in first]
    assert [seen[-1] if seen else 1 for seen in bits] == [0xA6 >> bit & 1 for bit in range(8)]


@pytest.mark.parametrize("reload", [0xFFFF, 0xFFFE, 0xFF00, 0xFC01])
def test_timer_2_gives_a_quarter_of_the_crystal_over_its_reload_value(reload):
    low, high = f"#0{reload & 255:X}h", f"#0{reload >> 8:X}h"
    program = f"MOV RCAP2L,{low}\nMOV RCAP2H,{high}\nMOV TL2,{low}\nMOV TH2,{high}\nMOV T2MOD,#2\nMOV T2CON,#4\nSJMP $"
    edges, _ = heard(program, T2, 20_000)
    ticks = [tick for tick, _ in edges][1:]  # the first is the output, low, that takes the pin over
    assert {after - before for before, after in pairwise(ticks)} == {2 * (0x10000 - reload)}
    assert ticks[-1] > 19_000 - 4 * 0x400


def test_the_latch_holds_txd_low():
    edges, _ = heard(BAUD + "CLR P3.1\nMOV SBUF,#55h\nSJMP $", TXD)
    assert [level for _, level in edges] == [0]


def test_a_change_of_mode_lets_go_of_txd_and_of_the_data_at_once():
    edges, board = heard(BAUD + "MOV SBUF,#0\nMOV R7,#200\nDJNZ R7,$\nMOV SCON,#0\nSJMP $", TXD)
    assert edges == board.cpu.txd.edges()
    data, board = heard("MOV SCON,#0\nMOV SBUF,#0\nNOP\nNOP\nNOP\nMOV SCON,#40h\nMOV 30h,P3\nSJMP $", RXD)
    assert [level for _, level in data] == [0, 1]
    assert board.cpu.peek_iram(0x30) & 1 == 1


def test_power_down_stops_a_character():
    edges, board = heard(BAUD + "MOV SBUF,#55h\nMOV R7,#250\nDJNZ R7,$\nMOV PCON,#2\nSJMP $", TXD)
    assert edges == board.cpu.txd.edges()
    assert 0 < len(edges) < 10


def test_a_part_answers_txd_before_the_program_looks():
    answering = scripted("a", answers=[Answer(A, D)])
    board = board_of(
        "MOV SCON,#0\nMOV SBUF,#0\nNOP\nMOV 30h,P1\nMOV 31h,P1\nSJMP $",
        wired({TXD: "out", (1, 5): "in"}, [{A: "out", D: "in"}]),
        [answering],
    )
    board.run(600)
    falls = [tick for tick, level in board.cpu.txd.edges() if not level]
    assert answering.heard[0][0] == falls[0]
    reads = [board.cpu.peek_iram(0x30) >> 5 & 1, board.cpu.peek_iram(0x31) >> 5 & 1]
    assert 0 in reads


# In pieces

LINES = [
    *("MOV SBUF,A", "INC A", "CLR TI", "MOV SCON,#50h", "MOV SCON,#0", "MOV SCON,#10h", "MOV SCON,#90h"),
    *("MOV SCON,#0D8h", "MOV TH1,#0FEh", "CPL TR1", "XRL T2CON,#4", "MOV T2MOD,#2", "MOV T2MOD,#0"),
    *(
        "MOV RCAP2L,#0F0h",
        "MOV RCAP2H,#0FFh",
        "XRL T2CON,#30h",
        "XRL P3,#3",
        "CPL P1.0",
        "CPL P3.1",
        "MUL AB",
    ),
    *("MOVX @DPTR,A", "MOV 30h,P1", "XRL PCON,#80h", "XRL TMOD,#0C0h", "CPL P3.5", "CPL P1.7", "NOP"),
    *("MOV R7,#9\nDJNZ R7,$", "MOV R7,#90\nDJNZ R7,$"),
]


def random_board(seed):
    chance = random.Random(seed)
    program = "LJMP main\nORG 40h\nmain:\n" + BAUD + "loop:\n"
    program += "\n".join(chance.choice(LINES) for _ in range(30)) + "\nLJMP loop"
    ports = {TXD: "txd", RXD: "rxd", T2: "t2", (1, 7): "p17", (3, 5): "p35", (2, 0): "p20"}
    for pin in chance.sample(sorted(ports), 2):
        del ports[pin]
    names = list(ports.values())
    parts, wiring = [], []
    for number in range(3):
        events = sorted((chance.randint(1, 9_000), D, chance.choice([0, 2])) for _ in range(5))
        answers = [Answer(A, D, None, chance.randint(0, 1), chance.choice([0, 3, 50]))]
        parts.append(scripted(f"part{number}", events, answers * chance.randint(0, 1)))
        wiring.append(
            {A: chance.choice(names), D: chance.choice([*names, "x"]), W: chance.choice(["x", "y"])}
        )
    board = board_of(program, wired(ports, wiring), parts, stop_on_fault=False)
    board.cpu.rxd.settled_tick = 0 if board.drives_rxd else 1 << 60
    return board


@given(st.integers(0, 1 << 30), st.lists(st.integers(1, 4_000), max_size=15))
def test_pieces_and_saved_states_change_no_bit(seed, pieces):
    whole, cut, loaded = (random_board(seed) for _ in range(3))
    try:
        whole.run(12_000)
    except PluginError:  # a ring of parts
        return
    tick, calls = 0, [[] for _ in loaded.parts]
    for piece in pieces:
        tick = min(tick + piece, 12_000)
        cut.run(tick)
        loaded.run(tick)
        state = Flat(loaded).save()
        calls = [before + part.heard for before, part in zip(calls, loaded.parts, strict=True)]
        loaded = random_board(seed)
        restore(loaded, state)
        for part in loaded.parts:
            part.heard.clear()
        assert snapshot(loaded) == state
    for board in (cut, loaded):
        board.run(12_000)
        assert snapshot(board) == snapshot(whole)
    heard = [part.heard for part in whole.parts]
    assert [part.heard for part in cut.parts] == heard
    assert [before + part.heard for before, part in zip(calls, loaded.parts, strict=True)] == heard


@given(st.integers(0, 1 << 30))
def test_levels_are_those_of_lines_and_latches(seed):
    """Nobody else is on the nets: what is there is what the serial port has put on its wires."""
    chance = random.Random(seed)
    program = "LJMP main\nORG 40h\nmain:\n" + BAUD + "loop:\n"
    kept = [line for line in LINES if "P3" not in line and "TMOD" not in line]
    program += "\n".join(chance.choice(kept) for _ in range(30)) + "\nLJMP loop"
    board = board_of(program, wired({TXD: "txd", RXD: "rxd"}, []), stop_on_fault=False)
    observer = Observer([board.nets.number("txd"), board.nets.number("rxd")])
    board.nets.observe(observer)
    board.run(12_000)
    end_tick = 12 * board.cpu.cycles
    for net, line in (("txd", board.cpu.txd), ("rxd", board.cpu.peripherals.shift.data)):
        number = board.nets.number(net)
        seen = [(tick, level) for tick, at, level in observer.edges if at == number]
        assert seen == [edge for edge in line.edges() if edge[0] < end_tick or edge in seen]


def digest():
    """Over the states of some boards, at many ticks."""
    states = hashlib.sha256()
    for seed in range(30):
        board = random_board(seed)
        for tick in range(1_000, 12_000, 1_777):
            try:
                board.run(tick)
            except PluginError as error:
                states.update(str(error).encode())
                break
            states.update(snapshot(board))
        states.update(repr([part.heard for part in board.parts]).encode())
    return states.hexdigest()


def test_both_engines_do_the_same():
    assert children.same_uncompiled(digest)


def test_a_register_written_again_brings_no_part_beyond_the_end_of_a_run():
    """The timer of the serial port is written in an instruction that goes over the tick at which a run ends."""
    program = BAUD + "loop:\nMOV TMOD,#20h\nMOV TMOD,#20h\nMOV TMOD,#20h\nSJMP loop"
    for end_tick in range(2_400, 2_496, 12):
        boards = []
        for netlist in (wired({TXD: "n", (1, 5): "q"}, [{A: "n", Q: "q"}]), wired({(1, 5): "q"}, [{Q: "q"}])):
            keys = scripted("a", events=[(end_tick + later, Q, later // 6 & 1) for later in range(0, 24, 6)])
            board = board_of(program, netlist, [keys])
            board.run(end_tick)
            boards.append((board.cpu.cycles, board.parts[0].next_tick, board.parts[0].events))
        assert boards[0] == boards[1]
