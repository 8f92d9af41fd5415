"""Data breakpoints for reading, for SP, and by names; and what `where` says of a stack that is out of step."""

import pytest

from miro_exact.bad_input import BadInput
from miro_robot.image.debug_info import Sources
from miro_robot.image.symbol_files import Symbol
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.session import Session
from mirotwin.debug.symbols import Moment, Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.debug.verbs import do
from mirotwin.runs.inspected_run import InspectedRun
from tests.alone import Alone
from tests.mirotwin.debug.runs import ASM, SECOND, debugger_of, robot_run
from tests.mirotwin.verify.firmwares import image


def session_of(source):
    run = InspectedRun(Alone(image(source)).world)
    run.end_tick = SECOND // 50
    return Session(Debugger(Timeline(run), Symbols(run.image, Sources([]))))


def said(session, *lines):
    for line in lines:
        do(session, line)
    return session.lines[:]


def stops(session, count, move="c"):
    """(PC, SP) of the next stops."""
    found = []
    for _ in range(count):
        said(session, move)
        found.append((session.debugger.cpu.pc, session.debugger.cpu.sp))
    return found


LOOKS = """
SJMP main
ORG 10h
main:
MOV 30h,#5
MOV R0,#30h
MOV A,@R0
INC 30h
MOV DPTR,#table
CLR A
MOVC A,@A+DPTR
SJMP main
table:
DB 42
"""
BYTE_READ, INCREMENTED, TABLE_READ = 0x15, 0x16, 0x1C


def test_a_read_watch_stops_before_each_instruction_that_reads_the_byte_and_a_write_watch_before_no_other():
    session = session_of(LOOKS)
    assert said(session, "rwatch iram[0x30]") == ["breakpoint 1: before iram[0x30] is read"]
    assert [pc for pc, _ in stops(session, 3)] == [BYTE_READ, INCREMENTED, BYTE_READ]
    assert [pc for pc, _ in stops(session, 2, "rc")] == [INCREMENTED, BYTE_READ]
    session = session_of(LOOKS)
    said(session, "watch iram[0x30]")
    assert [pc for pc, _ in stops(session, 3)] == [0x10, INCREMENTED, 0x10]
    session = session_of(LOOKS)
    said(session, "awatch iram[0x30] if $sp == 7")
    assert [pc for pc, _ in stops(session, 3)] == [0x10, BYTE_READ, INCREMENTED]


def test_a_table_in_code_can_be_watched_for_reading_only():
    session = session_of(LOOKS)
    said(session, "rwatch code[0x1f]")
    assert [pc for pc, _ in stops(session, 2)] == [TABLE_READ, TABLE_READ]
    with pytest.raises(BadInput, match="lies in no memory that can be watched"):
        do(session, "watch code[0x1f]")


def test_a_variable_is_read_where_its_bytes_are(monkeypatch):
    """Stops are those of single steps at which the processor is about to read it."""
    session = Session(debugger_of(robot_run()))
    said(session, "rwatch failsafe:age", "goto 40ms")
    watched = session.debugger.breakpoints[0].watched
    found = list(_cycles(session, 12))
    said(session, "goto 40ms", "delete")
    stepped = []
    while len(stepped) < len(found):
        said(session, "stepi")
        cpu = session.debugger.cpu
        if not cpu.idle and watched.are_read(cpu):
            stepped.append(cpu.cycles)
    assert found == stepped


def _cycles(session, count):
    for _ in range(count):
        do(session, "c")
        yield session.debugger.cpu.cycles


def test_sp_is_watched_through_calls_pushes_returns_and_interrupts():
    session = session_of(ASM)
    said(session, "goto 1ms")
    moved, cpu = [], session.debugger.cpu
    for _ in range(400):
        before = cpu.cycles, cpu.sp
        said(session, "stepi")
        if cpu.sp != before[1]:
            moved.append((before, cpu.pc, cpu.cycles))
    said(session, "goto 1ms", "watch SP")
    entered = session.symbols.unwinder.vectors
    for before, after_pc, after in [one for one in moved if one[0][0] > cpu.cycles][:40]:
        said(session, "c")
        assert cpu.cycles == (after if after_pc in entered else before[0])
    said(session, "delete", "rwatch SP")
    assert session.debugger.breakpoints[0].addresses == set()


def test_the_last_writer_of_sp_is_the_last_push_call_or_return():
    session = session_of(ASM)
    said(session, "break 0x44", "c")  # behind PUSH ACC
    assert "0x0042" in said(session, "who SP")[1]
    said(session, "finish")
    assert "0x0048" in said(session, "who SP")[1]  # RET


TOO_MANY = """
MOV SP,#50h
LCALL outer
SJMP $
outer:
MOV A,SP
INC A
INC A
MOV SP,A
LCALL inner
SJMP $
inner:
NOP
SJMP inner
"""
TOO_FEW = """
MOV SP,#50h
LCALL outer
SJMP $
outer:
JNB 20h.0,over
PUSH ACC
over:
LCALL inner
SJMP $
inner:
NOP
SJMP inner
"""
LOST = """
MOV SP,#50h
LCALL outer
SJMP $
outer:
MOV A,SP
XRL A,#0A0h
MOV SP,A
NOP
LCALL inner
inner:
NOP
SJMP inner
"""


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (TOO_MANY, "the stack is out of step: frame 1 has 2 bytes between iram[0x53] and iram[0x54]"),
        (TOO_FEW, "the stack is out of step: frame 1 has 1 byte less than its instructions pushed"),
    ],
)
def test_a_stack_that_is_out_of_step_says_by_how_many_bytes_and_where(source, words):
    session = session_of(source)
    lines = said(session, "goto 1ms", "where")
    assert len([line for line in lines if "#" in line[:3]]) == 3
    assert lines[-1].strip().startswith(words)


def test_a_stack_that_nothing_explains_says_how_many_bytes_that_are():
    lines = said(session_of(LOST), "goto 1ms", "where")
    assert lines[-2].strip() == "the stack cannot be told from here on"
    assert lines[-1].strip().startswith("235 bytes of the stack, from iram[0x8] on, cannot be explained")


def test_a_stack_in_step_says_nothing_of_it():
    session = Session(debugger_of(robot_run()))
    for time in ("0s", "1ms", "50ms", "200ms"):
        assert not any(
            "step" in line or "explained" in line for line in said(session, f"goto {time}", "where")
        )


def test_what_a_name_means_at_an_instruction_is_worked_out_once(monkeypatch):
    session, asked = Session(debugger_of(robot_run())), []
    meaning = Moment._meaning
    monkeypatch.setattr(Moment, "_meaning", lambda *given: asked.append(given[1]) or meaning(*given))
    said(session, "break failsafe_tick if age == 20", "c")
    assert session.moment().find("age", "failsafe").address
    assert asked.count("age") == 2  # in the condition, and here with the file


def test_a_data_breakpoint_on_what_only_the_map_names_keeps_the_name(monkeypatch):
    session = session_of(LOOKS)
    assert session.moment().scope_of("counter", "") is None
    names = {"counter": Symbol(0x30, "iram"), "main": Symbol(0x10, "code")}
    monkeypatch.setattr(session.symbols.image.symbols, "find", names.get)
    assert session.moment().scope_of("counter", "") == ""
    assert session.moment().scope_of("main", "") is None
    said(session, "rwatch counter")
    assert [pc for pc, _ in stops(session, 1)] == [BYTE_READ]
