"""Firmware that polls HI sees it at the first S5P2 that has it, wherever in a cycle the LM629 raises it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.clock import CYCLE_TICKS
from miro_robot.lm629.options import Lm629Options
from tests.example_count import examples
from tests.naive import polled_pins
from tests.robot.board.rig import START as VECTORS
from tests.robot.board.rig import board_with
from tests.robot.board.test_step_by_step import tell_left
from tests.robot.mcs51 import asm
from tests.states import snapshot

RESET_CLOCKS = 300
PULSE = "CLR P2.5\nNOP\nNOP\nSETB P2.5"
FELL_TICK, ROSE_TICK = 6 * CYCLE_TICKS, 9 * CYCLE_TICKS
START = f"LJMP main\nDB 0\nINC R5\nRETI\nORG 30h\nmain:\nMOV TMOD,#1\nSETB TR0\n{PULSE}"
"""Timer 0 counts cycles; /INT0 counts in R5. The pulse falls at the end of cycle 5."""
END = "CLR TR0\nSJMP $"
CYCLES = 1000
RSTI = 0x1D
BOOTED = f"{VECTORS}{PULSE}\nMOV R7,#0\nDJNZ R7,$\nDJNZ R7,$"


def program(loop, delay=0, setup=()):
    return "\n".join([START, *setup, *["NOP"] * delay, *loop, END])


def told(cpu):
    """What firmware can have learned of HI, and the cycle at which it left its loop."""
    return (
        cpu.instructions,
        cpu.cycles,
        cpu.sfr(0x8C) << 8 | cpu.sfr(0x8A),
        [cpu.peek_iram(at) for at in range(256)],
        cpu.a,
    )


def both(text, clocks):
    board = board_with(text, options=Lm629Options(reset_clocks=clocks), stop_on_fault=False)
    board.run(CYCLES * CYCLE_TICKS)
    edges = polled_pins.hi_edges(board.left.options, FELL_TICK, ROSE_TICK, CYCLES * CYCLE_TICKS)
    assert len(edges) == 2
    return told(board.cpu), told(polled_pins.run(asm.assemble(text), edges, CYCLES))


LOOPS = {
    "JB": ["JB P3.2,$"],
    "MOV C": ["hear:", "MOV C,P3.2", "JC hear"],
    "MOV A": ["hear:", "INC R3", "MOV A,P3", "JB ACC.2,hear"],
    "MUL": ["hear:", "MUL AB", "JB P3.2,hear"],
    "three cycles": ["hear:", "NOP", "JB P3.2,hear"],
}


@pytest.mark.parametrize("loop", LOOPS.values(), ids=LOOPS)
@pytest.mark.parametrize("delay", range(6))
@pytest.mark.parametrize("clocks", range(RESET_CLOCKS, RESET_CLOCKS + 3))
def test_a_loop_that_polls_hi_ends_where_one_ends_that_looks_at_every_cycle(loop, delay, clocks):
    ours, theirs = both(program(loop, delay), clocks)
    assert ours == theirs


@pytest.mark.parametrize("delay", range(2))
@pytest.mark.parametrize("clocks", range(RESET_CLOCKS, RESET_CLOCKS + 12))
def test_a_loop_of_two_cycles_is_left_by_its_first_pass_whose_s5p2_is_not_before_the_edge(delay, clocks):
    hi_tick = ROSE_TICK + 4 * clocks
    cycle = 9 + delay
    while CYCLE_TICKS * cycle + 9 < hi_tick:
        cycle += 2
    (_, _, counted, _, _), _ = both(program(LOOPS["JB"], delay), clocks)
    assert (
        counted == cycle + 2 - 5 + 1
    )  # TR0 counts from cycle 5 on; CLR TR0 ends with the cycle after the loop


@pytest.mark.parametrize("delay", range(3))
@pytest.mark.parametrize("clocks", range(120, 132))
def test_a_loop_that_waits_for_hi_to_fall_is_left_at_the_first_s5p2_after_busy(delay, clocks):
    rsti = [*tell_left(RSTI, 0)][:-2]  # without the pause after the last byte
    lines = [*["NOP"] * delay, "MOV TMOD,#1", "SETB TR0", "JNB P3.2,$", "CLR TR0", "SJMP $"]
    text = "\n".join([BOOTED, *rsti, *lines])
    options = Lm629Options(busy_clocks=clocks, reset_clocks=RESET_CLOCKS)
    whole, pieces = (board_with(text, options=options) for _ in range(2))
    whole.run(30_000)
    latched_tick, opcode, _ = whole.left.commands[-1]
    assert (opcode, whole.left.hi) == (RSTI, 0)
    cycle = begin = latched_tick // CYCLE_TICKS + delay + 3
    while CYCLE_TICKS * cycle + 9 < latched_tick + 4 * clocks:
        cycle += 2
    assert whole.cpu.sfr(0x8C) << 8 | whole.cpu.sfr(0x8A) == cycle + 2 - begin + 1
    for tick in range(latched_tick, 30_001):
        pieces.run(tick)
    assert snapshot(pieces) == snapshot(whole)


STEPS = st.sampled_from(
    [
        "NOP",
        "MUL AB",
        "INC R3",
        "MOV 30h,P3",
        "MOV A,P3",
        "MOV C,P3.2",
        "ADDC A,R3",
        "XRL 31h,A",
        "ORL C,/P3.3",
    ]
)
SETUPS = st.sampled_from([(), ("SETB IT0", "MOV IE,#81h"), ("MOV IE,#81h",), ("MOV IE,#81h", "MOV R5,#250")])


@examples(60)
@given(
    st.lists(STEPS, max_size=8), st.integers(0, 5), st.integers(RESET_CLOCKS, RESET_CLOCKS + 11), SETUPS,
    st.lists(st.integers(1, CYCLES * CYCLE_TICKS), max_size=30),
)  # fmt: skip
def test_any_loop_learns_what_one_learns_that_looks_at_every_cycle(steps, delay, clocks, setup, cuts):
    text = program(["hear:", *steps, "JB P3.2,hear", *steps, "MOV 32h,A"], delay, setup)
    ours, theirs = both(text, clocks)
    assert ours == theirs
    whole, pieces = (
        board_with(text, options=Lm629Options(reset_clocks=clocks), stop_on_fault=False) for _ in range(2)
    )
    for cut in [*sorted(cuts), CYCLES * CYCLE_TICKS]:
        pieces.run(cut)
    whole.run(CYCLES * CYCLE_TICKS)
    assert snapshot(pieces) == snapshot(whole)
