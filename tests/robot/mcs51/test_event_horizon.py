"""A CPU that knows when its next event is does the same as one that looks at each instruction.

Restoring a state makes the CPU work out its next event again. So one CPU runs, another one is put into its own state
before every instruction, and both must be in the same state in the end. Pins move meanwhile, and the run may end where
the CPU falls asleep.
"""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from miro_robot.mcs51.cpu import ASLEEP, Cpu
from tests.robot.mcs51.asm import assemble
from tests.robot.mcs51.rig import RecordingBus
from tests.states import restore, snapshot

BYTE = st.sampled_from([0, 1, 2, 0x7F, 0x80, 0xF0, 0xFA, 0xFD, 0xFE, 0xFF])
WRITES = st.one_of(
    st.builds("MOV {},#{}".format, st.sampled_from(["TL0", "TH0", "TL1", "TH1"]), BYTE),
    st.builds("MOV TMOD,#{}".format, st.sampled_from([0x11, 0x22, 0x21, 0x12, 0x03, 0x20, 0x99, 0x55])),
    st.builds("MOV IE,#{}".format, st.sampled_from([0x82, 0x88, 0x8A, 0x90, 0x9A, 0xBF, 0x1A, 0xA0, 0x85])),
    st.builds("MOV IP,#{}".format, st.sampled_from([0, 2, 8, 0x10, 0x1A])),
    st.builds(
        "{} {}".format,
        st.sampled_from(["SETB", "CLR", "CPL"]),
        st.sampled_from(["TR0", "TR1", "TF0", "TF1", "IT0", "IE0", "RI", "TI", "EA", "ET0", "ET1", "ES"]),
    ),
    st.builds("ANL {},#{}".format, st.sampled_from(["TCON", "SCON"]), BYTE),
    st.builds("ORL TCON,#{}".format, BYTE),
    st.builds("MOV SBUF,#{}".format, BYTE),
    st.builds("{} P3.{}".format, st.sampled_from(["SETB", "CLR", "CPL"]), st.sampled_from([0, 2, 3, 4, 5])),
    st.builds("MOV SCON,#{}".format, st.sampled_from([0x10, 0x50, 0x52, 0x70, 0x90, 0x98, 0xD0])),
    st.builds("MOV T2CON,#{}".format, st.sampled_from([0x04, 0x06, 0x0C, 0x0D, 0x0F, 0x34])),
    st.sampled_from(
        ["MOV PCON,#1", "MOV PCON,#80h", "MOV PCON,#0", "NOP", "MUL AB", "MOV A,TL0", "MOV A,TL1"]
    ),
)
BODY = st.lists(WRITES, max_size=4)
PROGRAM = """
LJMP main
ORG 000Bh
LJMP timer0
ORG 001Bh
LJMP timer1
ORG 0023h
LJMP serial
ORG 002Bh
LJMP timer2
ORG 0040h
timer0:
INC 30h
{0}
RETI
timer1:
INC 31h
{1}
RETI
serial:
INC 32h
{2}
RETI
timer2:
INC 33h
CLR TF2
CLR EXF2
RETI
main:
MOV T2CON,#{3}
MOV RCAP2H,#0FFh
MOV RCAP2L,#0FDh
MOV TH2,#0FFh
MOV TL2,#0FDh
MOV SCON,#{5}
MOV TMOD,#11h
MOV TCON,#50h
MOV IE,#9Ah
loop:
{4}
SJMP loop
"""
CYCLES = 400


PINS = st.lists(st.tuples(st.integers(0, 12 * CYCLES), st.sampled_from([1, 3]), BYTE), max_size=12).map(
    sorted
)


def state_after(code, levels, pins, asleep, again):
    cpu = Cpu(RecordingBus())
    cpu.load(code)
    cpu.stop_asleep = asleep
    for number, level in enumerate(levels):
        cpu.rxd.append(12 * 37 * (number + 1), level)
    for tick, port, value in pins:
        cpu.set_external(port, value, tick)
    if not again:
        cpu.run(CYCLES)
    while again and cpu.cycles < CYCLES:
        restore(cpu, snapshot(cpu))
        if cpu.step() == ASLEEP:
            break
    return snapshot(cpu)


@pytest.mark.slow
@settings(max_examples=40)
@given(
    *[BODY] * 4,
    st.sampled_from([0x34, 0x04, 0x14, 0x0C, 0x0F]),
    st.sampled_from([0x50, 0x90, 0xD0, 0x10]),
    st.lists(st.integers(0, 1), max_size=12),
    PINS,
    st.integers(0, 1),
)
@example(
    ["CLR TF0"],
    ["CLR TR1", "MOV TL1,#250", "MOV TH1,#255", "SETB TR1"],
    ["CLR RI"],
    ["MOV PCON,#1"],
    0x34,
    0x50,
    [0],
    [],
    0,
)
@example(["NOP"], ["CLR TF0", "MOV TL0,#250"], ["CLR TI"], ["CLR TF1", "MOV SBUF,#1"], 0x34, 0x50, [], [], 0)
@example(["NOP"], ["NOP"], ["NOP"], ["MOV TH0,#255", "MOV TL0,#254", *["NOP"] * 4], 0x34, 0x50, [], [], 0)
def test_it_takes_every_interrupt_when_one_that_looks_at_each_instruction_does(
    timer0, timer1, serial, loop, t2con, scon, levels, pins, asleep
):
    parts = ["\n".join(part) for part in (timer0, timer1, serial)]
    code = assemble(PROGRAM.format(*parts, t2con, "\n".join(loop), scon))
    in_one = state_after(code, levels, pins, asleep, again=False)
    assert in_one == state_after(code, levels, pins, asleep, again=True)
