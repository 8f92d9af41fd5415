"""The mean interrupt latency of a program that computes all the time, as a benchmark with a timer's ticks does.

A real AT89S52 was measured so (docs/fidelity.md): a tick is a constant and the latency of its interrupt, 3.41 to 3.58
machine cycles in the mean. The program here has the same shape: timer 0 in mode 1, reloaded by its own routine, and a
main loop of instructions of 1, 2 and 4 cycles. The routine puts TL0 on P1 first of all: the latency and 1.

The measured 3.41 to 3.58: a run of Dhrystone takes 10438 cycles. A tick is 1382 timer cycles, 18 until the reload, and
the mean latency L; its routine costs 55. From 20000 x 10438 / (1382 + 18 + L - 55) = 154815 ticks follows L = 3.449.
The printed 7740 us allows 3.41 to 3.58 (3.0 would print 7743, 4.0 7737). Processor and timer share a crystal, so its
tolerance cancels.
"""

from collections import Counter
from fractions import Fraction
from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive.mcs51_latency import answers
from tests.robot.mcs51.rig import cpu_with

OF_LENGTH = {1: "INC A", 2: "MOV 30h,31h", 4: "MUL AB"}
ROUTINE = (2, 2, 2, 2, 2, 2, 2, 1, *[2] * 15, 2, 2, 2)  # 51 cycles
RELOAD_AFTER = (
    12  # cycles: TL0 is written at the end of the sixth instruction, and counts from the next cycle on
)
PROGRAM = """
LJMP main
ORG 000Bh
MOV P1,TL0
LJMP tick
ORG 0040h
tick:
PUSH ACC
PUSH PSW
MOV P1,#0FFh
MOV TL0,#{low}
MOV TH0,#{high}
MOV R7,#15
wait:
DJNZ R7,wait
POP PSW
POP ACC
RETI
main:
MOV TMOD,#01h
MOV TL0,#00h
MOV TH0,#0FFh
MOV IE,#82h
SETB TR0
loop:
{loop}
SJMP loop
"""
FIRST = 255  # cycle of the first overflow, after SETB TR0
COUNTS = 1388
MIX = [1] * 31 + [2] * 15 + [4] * 2  # and the SJMP: 49 instructions, 71 cycles


def measured(lengths, counts, number):
    """(cycle of the overflow, latency) as the program itself tells them, cycles counted from the loop's begin."""
    reload = 0x10000 - counts
    loop = "\n".join(OF_LENGTH[length] for length in lengths)
    cpu = cpu_with(PROGRAM.format(low=reload & 0xFF, high=reload >> 8, loop=loop))
    cpu.run_until_any((cpu_loop(cpu),), 100)
    begin = cpu.cycles
    found = []
    while len(found) < number:
        cpu.run(cpu.cycles + 5_000)
        told = [(tick // 12 - begin, latch) for port, latch, tick in cpu.bus.ports if port == 1]
        found = [(after - 2 - latch, latch - 1) for after, latch in told if latch != 0xFF]
    return found[:number]


def cpu_loop(cpu):
    """The address behind SETB TR0."""
    return cpu.code.index(bytes.fromhex("D28C")) + 2


def test_each_instruction_of_the_loop_in_turn_delays_a_tick_by_its_length():
    """Calculated by hand from 4316E section 2.16. From the routine's end to the next overflow the main loop has
    12 + 1388 - 51 = 1349 cycles, 19 turns of 71. So the poll meets the first cycle of the instruction that RETI went
    back to, and is answered after its last: 3 cycles for a length of 1, 4 for 2, 6 for 4. Next comes its successor.
    """
    found = measured(MIX, COUNTS, 4 * 49 + 1)
    spacings = Counter(second - first for (first, _), (second, _) in pairwise(found))
    assert spacings == {1403: 4 * 31, 1404: 4 * 16, 1406: 4 * 2}
    latencies = [latency for _, latency in found[:-1]]
    assert Counter(latencies) == {3: 4 * 31, 4: 4 * 16, 6: 4 * 2}
    mean = Fraction(sum(latencies), len(latencies))
    assert mean == Fraction(169, 49)
    assert round(mean, 3) == Fraction(3449, 1000)


def carries_into_th0(counts):
    """Whether TL0 overflows between the writes to TL0 and TH0: the second write then loses the carry."""
    return -counts % 256 >= 0xFE


@settings(max_examples=30)
@given(
    st.lists(st.sampled_from([1, 2, 4]), min_size=1, max_size=40),
    st.integers(150, 700).filter(lambda counts: not carries_into_th0(counts)),
)
def test_any_loop_is_interrupted_where_the_rules_say(lengths, counts):
    found = measured(lengths, counts, 12)
    assert found == answers([*lengths, 2], ROUTINE, RELOAD_AFTER, counts, FIRST, 12)
