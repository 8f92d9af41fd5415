"""The verbs of the debugger's console: gdb's words, instructions where C is there, help, completion, history."""

import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_robot.image.debug_info import Sources
from miro_robot.image.variables import Variable, type_named
from miro_robot.mcs51.opcodes import LENGTH, disassemble
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.session import Session
from mirotwin.debug.shown import as_text, in_form
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.debug.verbs import VERBS, completions, do, is_command
from mirotwin.runs.inspected_run import InspectedRun
from tests.alone import Alone
from tests.mirotwin.debug.runs import ASM, debugger_of, robot_run
from tests.mirotwin.program import COMMAND
from tests.mirotwin.terminal import terminal
from tests.mirotwin.verify.firmwares import image


@pytest.fixture
def session():
    return Session(debugger_of(robot_run()))


@pytest.fixture
def bare():
    run = InspectedRun(Alone(image(ASM)).world)
    return Session(Debugger(Timeline(run), Symbols(run.image, Sources([]))))


def said(session, *lines):
    for line in lines:
        do(session, line)
    return session.lines[:]


def cycles(session):
    return session.debugger.cpu.cycles


def test_instructions_are_shown_where_c_is_there(session):
    code, names = session.symbols.image.code, session.symbols.names
    lines = said(session, "break failsafe_tick", "c", "x/4i $pc")
    address = session.debugger.cpu.pc
    for index, line in enumerate(lines):
        mark, shown, rest = line[:2], line[3:9], line[9:]
        assert (mark, int(shown, 16)) == ("=>" if index == 0 else "  ", address)
        assert rest.endswith(disassemble(code, address, names))
        address += LENGTH[code[address]]
    following = said(session, "x")
    assert int(following[0][3:9], 16) == address
    assert len(following) == 4


def test_a_list_of_an_address_is_of_instructions_and_that_of_a_function_of_lines(session):
    first = session.symbols.image.symbols.find("failsafe_tick").address
    for place in (f"{first:#x}", "*failsafe_tick"):
        listed = said(session, f"list {place}")
        assert any(line.startswith(f"   {first:#06x} <_failsafe_tick>") for line in listed)
        assert any(line.startswith("   ; ") and "failsafe.c:" in line for line in listed)
    assert all(re.match(r"..  +\d+  ", line) for line in said(session, "list failsafe_tick"))


def test_a_function_is_disassembled_from_its_first_to_its_last_instruction(session):
    function = next(one for one in session.symbols.debug.functions if one.name == "_failsafe_tick")
    listed = [line for line in said(session, "disas failsafe_tick") if "<" in line and ";" not in line[:6]]
    assert listed[0].startswith(f"   {function.first:#06x} ")
    assert listed[-1].endswith("RET")
    assert sum(len(line.split(">", 1)[1][:10].split()) for line in listed) == function.end - function.first


def test_memory_is_shown_in_units_and_forms_as_it_is(session):
    said(session, "goto 100ms")
    cpu = session.debugger.cpu
    (line,) = said(session, "x/4xb 0x30")
    assert line == "iram[0x30]:  " + "  ".join(f"{cpu.peek_iram(at):#04x}" for at in range(0x30, 0x34))
    (line,) = said(session, "x/2dh iram[0x30]")
    pairs = [bytes(cpu.peek_iram(at + byte) for byte in (0, 1)) for at in (0x30, 0x32)]
    assert line.split(":  ")[1].split() == [
        f"{int.from_bytes(pair, 'little', signed=True)}" for pair in pairs
    ]
    assert said(session, "x/3ub &failsafe:age") == said(session, "x/3ub failsafe:age")
    assert said(session, "x $sp")[0].startswith(f"iram[{cpu.sp:#x}]:")
    assert len(said(session, "x/20xb 0")) == 3


def test_the_words_of_gdb_do_what_the_verbs_do(session):
    pairs = [
        ("tb main", "c"), ("b 49", "continue"), ("rc", "reverse-continue"), ("s", "step"), ("rs", "reverse-step"),
        ("n", "next"), ("rn", "reverse-next"), ("si", "stepi"), ("ni", "nexti"), ("rsi", "reverse-stepi"),
        ("u", "until"), ("fin", "finish"), ("bt", "where"), ("f", "frame"), ("i b", "info breakpoints"), ("p", "print"),
        ("l", "list"), ("disas", "disassemble"), ("d", "delete"), ("i r", "info registers"), ("tb", "tbreak"),
    ]  # fmt: skip
    from mirotwin.debug.verbs import named

    for short, long in pairs:
        assert named(short.split()[0]) is named(long.split()[0]) or short in ("tb main", "b 49", "rc")
    assert {named("rc"), named("reverse-continue")} == {named("rcontinue")}


def test_a_temporary_breakpoint_stops_once(session):
    assert "breakpoint 1" in said(session, "tbreak failsafe_tick", "c")[0]
    assert session.debugger.breakpoints == []
    assert "the run ends here" in said(session, "c")[0]


def test_a_number_after_a_step_is_how_often(session):
    said(session, "goto 100ms", "si", "si", "si")
    three = cycles(session)
    said(session, "goto 100ms", "stepi 3")
    assert cycles(session) == three
    said(session, "r stepi 3", "next 4")
    four = cycles(session)
    said(session, "goto 100ms", "n", "n", "n", "n")
    assert cycles(session) == four
    said(session, "goto 0s", "b failsafe_tick", "c", "c", "c")
    third = cycles(session)
    assert "breakpoint 1" in said(session, "goto 0s", "continue 3")[0]
    assert cycles(session) == third


def test_a_step_by_instruction_shows_the_instruction(session):
    shown = said(session, "break failsafe_tick", "c", "stepi")[0]
    cpu = session.debugger.cpu
    assert shown.endswith("   " + disassemble(cpu.code, cpu.pc, session.symbols.names))


def test_nexti_goes_over_a_call_and_back_over_it(bare):
    said(bare, "break 0x3b", "c")
    assert disassemble(bare.debugger.cpu.code, bare.debugger.cpu.pc).startswith("LCALL")
    begun, sp = cycles(bare), bare.debugger.cpu.sp
    said(bare, "ni")
    assert (bare.debugger.cpu.pc, bare.debugger.cpu.sp) == (0x3E, sp)
    said(bare, "rni")
    assert cycles(bare) == begun


def test_until_leaves_a_loop_and_takes_places(session):
    said(session, "break main", "c")
    first = session.line_here().line
    said(session, "until 49")
    assert session.line_here().line == 49
    said(session, "until")
    assert session.line_here().line > 49 > first
    said(session, "until failsafe_tick")
    assert session.symbols.function(session.debugger.cpu.pc) == "failsafe_tick"
    said(session, "advance main.c:49")
    assert session.line_here().line == 49


def test_frames_are_gone_through_and_their_names_are_meant(session):
    said(session, "break failsafe_tick", "c")
    assert said(session, "up")[0].startswith("*#1  ")
    assert said(session, "info frame")[0].startswith("*#1  ")
    pc = session.here().place
    assert said(session, "p/x $pc") == [f"$pc = {pc:#06x}"]
    assert said(session, "down")[0].startswith("*#0  ")
    assert said(session, "frame 1")[0].startswith("*#1  ")
    assert said(session, "bt 1")[-1].startswith(" #0  ")
    with pytest.raises(BadInput, match="outermost"):
        do(session, "up")


def test_a_frame_says_where_it_returns_to_and_what_it_pushed(bare):
    said(bare, "break 0x44", "c")  # behind PUSH ACC
    cpu = bare.debugger.cpu
    lines = said(bare, "info frame")
    assert lines[1] == "    entered at 0x0042"
    assert "returns to 0x003e (0x003e in " in lines[2]
    assert lines[3] == f"    pushed since: {cpu.peek_iram(cpu.sp):02x} from iram[{cpu.sp:#x}] on"


def test_displays_are_shown_at_each_stop_until_they_are_taken_away(session):
    said(session, "goto 100ms", "display/x failsafe:age", "display/2i $pc")
    shown = said(session, "si")
    assert [line[:3] for line in shown[1:]] == ["1: ", "2: ", "2: "]
    assert shown[1].startswith("1: failsafe:age = 0x")
    assert [line.split(":")[0] for line in said(session, "info display")] == ["1", "2"]
    assert len(said(session, "undisplay 2", "si")) == 2
    assert len(said(session, "undisplay", "si")) == 1


def test_registers_are_those_of_the_processor_by_gdbs_names(session):
    said(session, "goto 100ms")
    cpu = session.debugger.cpu
    listed = dict(line.split()[:2] for line in said(session, "info registers"))
    assert (int(listed["PC"]), int(listed["SP"]), int(listed["R7"])) == (
        cpu.pc,
        cpu.sp,
        cpu.peek_iram(cpu.bank + 7),
    )
    assert said(session, "info registers $sp scon") == said(session, "i r SP SCON")
    assert said(session, "p $sp + 1") == [f"$sp + 1 = {cpu.sp + 1} ({cpu.sp + 1:#x})"]


def test_locals_say_what_they_are_or_why_they_have_no_value(session):
    lines = said(session, "break take_body", "c", "info locals")
    assert lines
    assert all(re.match(r"\w+( = |: \w+ is not live)", line) for line in lines)


def test_a_line_says_where_its_code_is(session):
    (line,) = said(session, "info line failsafe.c:147")
    first, end = (int(word.rstrip(","), 16) for word in re.findall(r"0x\w+,?", line))
    assert session.symbols.line(first).line == session.symbols.line(end - 1).line == 147
    assert session.symbols.line(end) != session.symbols.line(first)


@pytest.mark.parametrize(
    ("form", "text"),
    [("x", "0xfe"), ("d", "-2"), ("u", "254"), ("o", "0o376"), ("t", "0b11111110"), ("c", "254 'þ'")],
)
def test_a_number_is_written_in_the_base_that_is_asked_for(form, text):
    assert in_form(254, form, 1) == text
    assert in_form([254, 254], form, 1) == f"[{text}, {text}]"


@given(st.binary(max_size=40))
def test_bytes_are_a_text_where_they_can_be_read_up_to_their_end(data):
    text = as_text(data, False)
    if text is not None:
        assert text.isascii()
        assert data.rstrip(b"\0") == text.encode()
    assert as_text(data, True) == data.partition(b"\0")[0].decode("latin-1")


def test_an_array_of_bytes_that_holds_a_text_is_shown_as_one(session, monkeypatch):
    variable = Variable("line", "", 0x60, "iram", type_named("uint8[6]"), "")
    monkeypatch.setitem(session.symbols.variables.by_name, "line", (variable,))
    for at, byte in enumerate(b"READY\0"):
        session.debugger.cpu.poke_iram(0x60 + at, byte)
    assert said(session, "print line") == ['line = "READY"']
    assert said(session, "p/x line") == ["line = [0x52, 0x45, 0x41, 0x44, 0x59, 0x00]"]
    assert said(session, "x/s line") == ['iram[0x60]: "READY"']
    session.debugger.cpu.poke_iram(0x60, 7)
    assert said(session, "print line") == ["line = [7, 69, 65, 68, 89, 0]"]
    assert said(session, "p/s line") == ['line = "\\u0007EADY"']


def test_help_names_each_verb_and_says_what_it_takes(session):
    listed = said(session, "help")
    assert [line.split()[0] for line in listed[:-1]] == [verb.name for verb in VERBS]
    for verb in VERBS:
        for name in verb.names:
            lines = said(session, f"help {name}")
            assert lines[0].startswith(verb.name)
            assert verb.says in lines[0]


def test_no_two_verbs_have_a_name_in_common():
    names = [name for verb in VERBS for name in verb.names]
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    ("line", "becomes"),
    [
        ("rev", "reverse-continue"),
        ("break fail", "failsafe.c:"),
        ("break failsafe_ti", "failsafe_tick"),
        ("break main if failsafe:ag", "failsafe:age"),
        ("print lm629.left.pi", "pid"),
        ("print lm629.left.pid.", "kp"),
        ("print SCON.R", "RI"),
        ("print 3+lm629.le", "left"),
        ("until comm", "command"),
        ("until command si", "side="),
        ("until command side=l", "left"),
        ("until tic", "tick"),
        ("help ti", None),
        ("help tb", "tbreak"),
        ("info re", "registers"),
        ("p/x failsafe_ti", "failsafe_tick"),
        ("goto 1", None),
        ("nothing x", None),
        ("print nothing.", None),
    ],
)
def test_a_word_is_completed_by_what_may_stand_there(session, line, becomes):
    first, words = completions(session, line)
    whole = [line[:first] + word for word in words]
    assert all(one.startswith(line) for one in whole)
    if becomes is None:
        assert words == []
    else:
        assert becomes in words or any(one.endswith(becomes) for one in whole)


@given(st.text(max_size=30))
@example("u\x85")
def test_any_line_can_be_completed(line):
    first, words = completions(_SESSION, line)
    assert 0 <= first <= len(line)
    assert all((line[:first] + word).startswith(line) for word in words)


@given(
    st.one_of(
        st.text(max_size=30),
        st.builds(
            lambda verb, rest: f"{verb.name} {rest}",
            st.sampled_from(
                [
                    verb
                    for verb in VERBS
                    if not verb.repeats and verb.name not in ("goto", "until", "quit", "who")
                ]
            ),
            st.text(max_size=20),
        ),
    )
)
def test_any_line_is_done_or_refused(line):
    try:
        if line.strip()[:1] not in set("cfnsrgu"):
            do(_SESSION, line)
    except BadInput:
        pass


_SESSION = Session(debugger_of(robot_run()))


def test_in_an_editors_console_a_name_of_the_program_is_a_value():
    names = {"i", "x", "up"}
    for line in ("next", "r next", "bt", "b 49", "p/x age", "x/8i $pc", "info locals", "i b"):
        assert is_command(line, ()), line
    for line in ("x", "i", "b", "lm629.left", "i + 1", "up.left", "nothing"):
        assert not is_command(line, names), line


def test_a_terminal_has_completion_and_the_history_of_the_session_before(tmp_path):
    environment = {"XDG_STATE_HOME": str(tmp_path), "TERM": "dumb"}
    import os

    with terminal(*COMMAND, "debug", "fig6", env={**os.environ, **environment}) as screen:
        screen.until("(mirotwin) ")
        screen.type("break failsafe_ti\t\n")
        screen.until("breakpoint 1: failsafe.c:")
        screen.type("quit\n")
    assert (tmp_path / "mirotwin" / "debug_history").read_text().splitlines()[-2:] == [
        "break failsafe_tick",
        "quit",
    ]
    with terminal(*COMMAND, "debug", "fig6", env={**os.environ, **environment}) as screen:
        screen.until("(mirotwin) ")
        screen.type("\x10\x10\n")
        screen.until("breakpoint 1: failsafe.c:")
        screen.type("quit\n")
