"""Mistakes in calls, registers, serial port, timers and memory: each is found, and the idiom beside it is not."""

import pytest

from miro_robot.image.debug_info import DebugInfo
from miro_robot.inspect import sanitizer as found
from miro_robot.inspect.sanitizer import Sanitizer
from miro_robot.inspect.sanitizer_layout import Layout
from miro_robot.inspect.watcher import attach
from miro_robot.mcs51.cpu import Cpu
from tests.robot.mcs51.asm import assemble
from tests.robot.mcs51.rig import cpu_with
from tests.robot.sanitizer.lines import receive

PUT_GENERIC = 0x200


def mistakes(text, cycles=3000, ram=-1, received=b""):
    """(mistake, which) of all that is noted while `text` runs; `received` comes at 9600 baud, from 1 ms on."""
    cpu = cpu_with(text)
    watcher = Sanitizer(Layout({}, {}, {}, {}, set(), PUT_GENERIC, DebugInfo()), ram)
    attach(cpu, watcher)
    receive(cpu, received)
    cpu.run(cycles)
    return {(mistake, which) for mistake, _, _, which in watcher.notes}


INTERRUPT = """
    LJMP start
    ORG 0Bh
    {routine}
    ORG 40h
start:
    MOV SP,#50h
    MOV TMOD,#02h
    MOV IE,#82h
    SETB TR0
loop:
    MOV R7,#5
    INC A
    MOV DPTR,#1234h
    SJMP loop
sub:
    INC 30h
    RET
end_of_interrupt:
    RETI
"""


@pytest.mark.parametrize(
    ("routine", "wanted"),
    [
        ("INC A\n RETI", {(found.REGISTERS, 8)}),
        ("SETB C\n RETI", {(found.REGISTERS, 11)}),
        ("INC DPTR\n RETI", {(found.REGISTERS, 10)}),
        ("INC R7\n RETI", {(found.REGISTERS, 7)}),
        ("INC B\n RETI", {(found.REGISTERS, 9)}),
        ("SETB RS0\n RETI", {(found.REGISTERS, 12)}),
        ("PUSH PSW\n SETB RS0\n INC R7\n POP PSW\n RETI", set()),
        ("PUSH ACC\n INC A\n POP ACC\n RETI", set()),
        ("RET", {(found.RET_OF_INTERRUPT, 1)}),
        ("LCALL end_of_interrupt\n RETI", set()),  # lowers its level
        ("LCALL end_of_interrupt\n RET", set()),
        ("LCALL sub\n LCALL end_of_interrupt\n RET", set()),
        ("MOV 32h,#lo\n PUSH 32h\n PUSH 33h\n RETI\nlo:\n RET", set()),  # as RTX51 does
        ("LCALL end_of_interrupt\n INC R7\n RET", {(found.REGISTERS, 7)}),
        ("LCALL sub\n RETI", set()),
        ("POP 31h\n POP 30h\n PUSH 30h\n PUSH 31h\n RETI", set()),
        ("INC 51h\n RETI", {(found.OVERWRITTEN, 0)}),
        ("PUSH ACC\n RETI", {(found.UNBALANCED, 0)}),
    ],
)
def test_interrupt_routines(routine, wanted):
    assert mistakes(INTERRUPT.format(routine=routine)) == wanted


PROGRAM = """
    MOV SP,#50h
    MOV R6,#20
loop:
    {body}
    DJNZ R6,loop
end:
    SJMP end
sub:
    {sub}
"""

ODD = "MOV A,R6\n JB ACC.0,odd\n"
"""Skips what stands before the label `odd` in every second turn."""


@pytest.mark.parametrize(
    ("body", "sub", "wanted"),
    [
        ("LCALL sub", "RET", set()),
        ("LCALL sub", "INC 30h\n RETI", {(found.RETI_OF_CALL, 0)}),
        ("LCALL sub", "PUSH ACC\n RET", {(found.UNBALANCED, 0)}),
        ("LCALL sub", "POP 30h\n RET", {(found.UNBALANCED, 0)}),
        ("LCALL sub", "MOV 51h,#0\n RET", {(found.OVERWRITTEN, 0)}),
        ("LCALL sub", "POP DPH\n POP DPL\n CLR A\n JMP @A+DPTR", set()),  # as Keil's ?C?CCASE
        ("MOV DPTR,#there\n PUSH DPL\n PUSH DPH\n RET\nthere:\n NOP", "RET", set()),
        ("PUSH ACC\n POP ACC", "RET", set()),
        ("PUSH ACC", "RET", {(found.LEAK, 0)}),
        ("LCALL sub", "POP DPH\n POP DPL\n PUSH ACC\n PUSH DPL\n PUSH DPH\n RET", {(found.LEAK, 0)}),
        ("LCALL sub", "MOV R5,#4\nmore:\n PUSH ACC\n DJNZ R5,more\n MOV SP,#52h\n RET", set()),
        ("PUSH ACC\n PUSH B", "RET", {(found.LEAK, 0)}),
        ("MOV 30h,SP\n PUSH ACC\n PUSH B\n MOV SP,30h", "RET", set()),
        (f"{ODD} PUSH ACC\nodd:\n NOP", "RET", {(found.LEAK, 0)}),
        (f"PUSH ACC\n{ODD} NOP\nodd:\n POP ACC", "RET", set()),
        (f"PUSH ACC\n PUSH B\n{ODD} POP B\nodd:\n POP ACC", "RET", {(found.LEAK, 0)}),
        (f"PUSH ACC\n PUSH B\n{ODD} NOP\nodd:\n POP B\n POP ACC", "RET", set()),
        ("PUSH ACC\n LCALL sub", "RET", {(found.LEAK, 0)}),  # a parameter that its caller leaves there
        ("PUSH ACC\n LCALL sub\n DEC SP", "RET", set()),
        ("INC SP\n LCALL sub", "RET", {(found.LEAK, 0)}),
        ("LCALL sub\naway:\n NOP", "DEC SP\n LJMP away", {(found.LEAK, 0)}),  # half of the return address
        ("LCALL sub\naway:\n NOP", "DEC SP\n DEC SP\n LJMP away", set()),
        ("LCALL sub\naway:\n NOP", "LJMP away", {(found.LEAK, 0)}),  # all of it
        ("LCALL middle\naway:\n NOP", "RET\nmiddle:\n LCALL sub\n LJMP away", {(found.LEAK, 0)}),
        ("LCALL sub\naway:\n NOP", "MOV A,R6\n JB ACC.1,out\n RET\nout:\n LJMP away", {(found.LEAK, 0)}),
        ("MOV 30h,SP\n LCALL sub\naway:\n NOP", "MOV SP,30h\n LJMP away", set()),  # as longjmp
        ("MOV R5,#9\n LCALL sub", "DJNZ R5,deeper\n RET\ndeeper:\n LCALL sub\n RET", set()),  # recursion
        ("LCALL sub\n LCALL other", "RET\nother:\n LJMP sub", set()),  # a call at the end, made a jump
    ],
)
def test_calls_and_the_stack(body, sub, wanted):
    assert mistakes(PROGRAM.format(body=body, sub=sub)) >= wanted
    assert bool(mistakes(PROGRAM.format(body=body, sub=sub))) == bool(wanted)


SERIAL = """
    MOV TMOD,#21h
    MOV TH1,#0F3h
    MOV PCON,#80h
    MOV SCON,#50h
    SETB TR1
loop:
    {body}
    SJMP loop
"""


@pytest.mark.parametrize(
    ("body", "received", "wanted"),
    [
        ("MOV SBUF,#55h\n MOV R7,#9\nwait:\n DJNZ R7,wait", b"", {(found.CUT_OFF, 0)}),
        ("MOV SBUF,#55h\nwait:\n JNB TI,wait\n CLR TI", b"", set()),
        ("JNB RI,loop\n CLR RI\n MOV A,SBUF", b"abc", set()),
        ("JNB RI,loop\n MOV A,SBUF\n CLR RI", b"abc", set()),
        ("JNB RI,loop\n CLR RI", b"abc", {(found.UNREAD, 0)}),
        ("JBC RI,got\n SJMP loop\ngot:\n NOP", b"abc", {(found.UNREAD, 0)}),
        ("JBC RI,got\n SJMP loop\ngot:\n MOV A,SBUF", b"abc", set()),
        ("NOP", b"abc", {(found.OVERRUN, 0)}),
        ("NOP", b"a", set()),
        ("JNB RI,loop\n ANL SCON,#0FEh", b"abc", {(found.UNREAD, 0)}),
    ],
)
def test_the_serial_port(body, received, wanted):
    assert mistakes(SERIAL.format(body=body), 12_000, received=received) == wanted


TIMED = """
    MOV TMOD,#11h
    SETB TR0
    SETB TR1
    MOV T2CON,#4
loop:
    {body}
    SJMP loop
far:
    MOV R6,#20
far1:
    DJNZ R6,far1
    RET
low:
    MOV R7,TL0
    RET
high:
    MOV R6,TH0
    RET
now:
    MOV R6,TH0
    MOV R7,TL0
    MOV A,TH0
    XRL A,R6
    JNZ now
    RET
"""


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        ("MOV A,TL0\n MOV B,TH0\n LCALL far", {(found.TIMER, 0)}),
        ("MOV B,TH0\n MOV A,TL0\n LCALL far", {(found.TIMER, 0)}),
        ("again:\n MOV B,TH0\n MOV R7,TL0\n MOV A,TH0\n CJNE A,B,again\n LCALL far", set()),
        ("CLR TR0\n MOV A,TL0\n MOV B,TH0\n SETB TR0\n LCALL far", set()),
        ("MOV A,TL0\n LCALL far", set()),
        ("MOV A,TL1\n MOV B,TH1\n LCALL far", {(found.TIMER, 1)}),
        ("CLR TR1\n MOV A,TL1\n MOV B,TH1\n SETB TR1\n LCALL far", set()),
        ("MOV A,TH2\n MOV B,TL2\n LCALL far", {(found.TIMER, 2)}),
        ("CLR TR2\n MOV A,TH2\n MOV B,TL2\n SETB TR2\n LCALL far", set()),
        ("MOV A,RCAP2L\n MOV B,RCAP2H\n LCALL far", set()),  # a capture stands still
        ("LCALL low\n LCALL high\n LCALL far", {(found.TIMER, 0)}),
        ("LCALL now\n LCALL far", set()),
        ("MOV TMOD,#12h\n MOV A,TL0\n MOV B,TH0\n LCALL far", set()),  # TH0 is only what TL0 begins with
        ("MOV A,TL0\n MOV B,TH1\n LCALL far", set()),
    ],
)
def test_halves_of_a_timer(body, wanted):
    assert mistakes(TIMED.format(body=body)) == wanted


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("MOV DPTR,#1000h\n MOVX @DPTR,A", {(found.NO_RAM, 0x1000)}),
        ("MOV DPTR,#1000h\n MOVX A,@DPTR", {(found.NO_RAM, 0x1000)}),
        ("MOV P2,#1\n MOV R0,#7\n MOVX A,@R0", {(found.UNWRITTEN, 0x107)}),
        ("MOV DPTR,#0FFh\n MOVX @DPTR,A\n MOVX A,@DPTR", set()),
        ("MOV DPTR,#700h\n CLR A\n MOVC A,@A+DPTR", {(found.NO_CODE, 0x700)}),
        ("MOV DPTR,#0\n MOV A,#2\n MOVC A,@A+DPTR", set()),
        ("MOV B,#80h\n LCALL 200h", {(found.CONST, 0)}),
        ("MOV B,#40h\n LCALL 200h", set()),
    ],
)
def test_memory(text, wanted):
    assert mistakes(f"{text}\nend:\n SJMP end\n ORG 200h\n RET", ram=0x800) == wanted


COPY = """
    MOV DPTR,#{first}
    MOV R7,#17
next:
    CLR A
    MOVC A,@A+DPTR
    INC DPTR
    DJNZ R7,next
end:
    SJMP end
    ORG {there}
    NOP
    ORG 200h
    RET
"""


@pytest.mark.parametrize(
    ("first", "there", "wanted"),
    [
        ("1F0h", "1F0h", []),  # over a gap of 15 bytes
        ("1F1h", "1F0h", [0x1F1]),  # begins in it
        ("1B0h", "1B0h", [0x1B1]),  # too long a gap
        ("200h", "1F0h", [0x201]),  # beyond the end
    ],
)
def test_a_block_that_is_copied_may_have_a_gap(first, there, wanted):
    code = assemble(COPY.format(first=first, there=there))
    cpu, watcher = Cpu(), Sanitizer(Layout({}, {}, {}, {}, set(), PUT_GENERIC, DebugInfo()))
    at = int(there[:-1], 16)
    cpu.load(code, ((0, 0x20), (at, at + 1), (0x200, 0x201)))
    attach(cpu, watcher)
    cpu.run(1000)
    assert sorted(which for _, _, _, which in watcher.notes)[:1] == wanted
