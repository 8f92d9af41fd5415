"""Going forward and back through a run: steps, stacks and writers are right, and nothing changes by it."""

import random
import sys
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import CYCLE_TICKS
from miro_exact.state import Flat
from miro_robot.image.debug_info import Sources
from miro_robot.inspect.marks import MarkInspector
from miro_robot.inspect.writes import cpu_bit
from miro_robot.mcs51.opcodes import disassemble
from mirotwin.debug import timeline as timelines
from mirotwin.debug.console import Console
from mirotwin.debug.session import Session
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline, Trap
from mirotwin.debug.verbs import do
from mirotwin.shell.progress import ProgressBar
from tests.alone import Alone
from tests.mirotwin.debug import proofs
from tests.mirotwin.debug.proofs import LIBRARY, MIX
from tests.mirotwin.debug.runs import ASM, SECOND, debugger_of, golden_digest, robot_run
from tests.mirotwin.shell.test_screen import Screen
from tests.mirotwin.verify.firmwares import image
from tests.mutants.sdcc import needs_sdcc
from tests.naive.debugger import history, next_line

END = SECOND // 16


@pytest.fixture(scope="module")
def moments():
    return history(robot_run(), END)


@pytest.fixture
def debugger():
    return debugger_of(robot_run())


def stand(debugger, moment):
    debugger.go_to(moment.cycle * CYCLE_TICKS)
    assert debugger.cpu.pc == moment.pc


def test_each_instruction_that_was_executed_is_listed_as_one(moments, debugger):
    listed = {row.address: row.text for row in debugger.symbols.listing}
    executed, symbols = {moment.pc for moment in moments}, debugger.symbols
    texts = {pc: disassemble(symbols.image.code, pc, symbols.names) for pc in executed}
    assert {pc: listed.get(pc) for pc in executed} == texts


def test_an_instruction_over_the_place_of_a_vector_is_listed_whole():
    over = image("MOV 30h,#1\n" * 5 + "SJMP $")  # timer 0 would go to 0Bh, within the fourth
    assert [row.address for row in Symbols(over, Sources([])).listing] == [0, 3, 6, 9, 12, 15]


def some(moments, count, seed):
    return sorted(random.Random(seed).sample(range(len(moments) // 2), count))


def test_next_stops_where_another_line_of_the_function_or_its_caller_begins(moments, debugger):
    starts, line = set(debugger.symbols.line_begins), debugger.symbols.line
    on_lines = [at for at in some(moments, 300, 2) if moments[at].pc in starts and line(moments[at].pc)][:30]
    for at in on_lines:
        stand(debugger, moments[at])
        debugger.move("next")
        expected = next_line(moments, at, starts, line)
        assert (debugger.cpu.cycles, debugger.cpu.pc) == (expected.cycle, expected.pc)


def test_a_line_back_undoes_a_line_forward(moments, debugger):
    line = debugger.symbols.line
    debugger.breakpoints.clear()
    for at in some(moments, 12, 3):
        stand(debugger, moments[at])
        debugger.move("next")  # to where a line begins
        stops = []
        for _ in range(6):
            frames = debugger.frames()
            stops.append((debugger.timeline.tick, line(debugger.cpu.pc), len(frames)))
            debugger.move("next")
        depth = min(deep for _, _, deep in stops)
        outer = [stop for stop in stops if stop[2] == depth]
        if len(outer) < len(stops):
            continue  # it returned meanwhile: a line back goes over the call as a whole
        debugger.go_to(stops[-1][0])
        for tick, _, _ in reversed(stops[:-1]):
            debugger.move("rnext")
            assert debugger.timeline.tick == tick


def test_finish_returns_to_the_caller_and_its_reverse_to_the_call(moments, debugger):
    deep = [at for at in some(moments, 200, 4) if moments[at].calls][:20]
    for at in deep:
        back, _, _ = moments[at].calls[-1]
        stand(debugger, moments[at])
        debugger.move("finish")
        assert debugger.cpu.pc == back
        stand(debugger, moments[at])
        debugger.move("rfinish")
        call = moments[max(to for to in range(at) if moments[to].calls == moments[at].calls[:-1])]
        assert (debugger.cpu.cycles, debugger.cpu.pc) == (call.cycle, call.pc)


def test_an_instruction_forward_and_back_are_neighbours(moments, debugger):
    for at in some(moments, 40, 5):
        stand(debugger, moments[at + 1])
        debugger.move("rstepi")
        slept = debugger.cpu.idle
        assert slept or (debugger.cpu.cycles, debugger.cpu.pc) == moments[at][:2]
        debugger.move("stepi")
        assert slept or (debugger.cpu.cycles, debugger.cpu.pc) == moments[at + 1][:2]


def test_a_step_back_takes_no_checkpoint_that_lies_within_the_instruction(moments, debugger):
    timeline = debugger.timeline
    pairs = [(one, other) for one, other in pairwise(moments) if other.cycle - one.cycle <= 4]
    for before, after in pairs[100:110]:
        stand(debugger, before)
        timeline._run_to(before.cycle * CYCLE_TICKS + 3)
        timeline._save()
        stand(debugger, after)
        assert timeline.step_back()
        assert (debugger.cpu.cycles, debugger.cpu.pc) == (before.cycle, before.pc)


def test_a_watch_stops_at_each_change_in_both_directions(moments, debugger):
    age = debugger.bytes_of("ticks")
    changes = [
        before.cycle
        for before, after in pairwise(moments)
        if before.ram[age.first : age.end] != after.ram[age.first : age.end]
    ][:12]
    debugger.watch("ticks")
    forward = []
    while len(forward) < 40 and debugger.cpu.cycles < changes[-1]:
        debugger.move("continue")
        forward.append(debugger.cpu.cycles)
    assert set(changes) <= set(forward)
    backward = []
    while debugger.move("rcontinue").startswith("breakpoint"):
        backward.append(debugger.cpu.cycles)
    assert backward == forward[-2::-1]


def first_hits(debugger, count):
    """The cycles of a breakpoint's first hits; it is removed at the last of them."""
    debugger.add("failsafe_tick")
    cycles = []
    for _ in range(count):
        debugger.move("continue")
        cycles.append(debugger.cpu.cycles)
    debugger.breakpoints.clear()
    return cycles


def test_hits_are_counted_from_the_begin_of_the_run_in_both_directions(debugger):
    cycles = first_hits(debugger, 7)
    debugger.add("failsafe_tick", count="% 3")
    assert debugger.move("rcontinue") == "breakpoint 2"
    assert debugger.cpu.cycles == cycles[5]
    debugger.move("rcontinue")
    assert debugger.cpu.cycles == cycles[2]
    debugger.move("continue")
    assert debugger.cpu.cycles == cycles[5]


def test_a_log_point_tells_and_does_not_stop(debugger, capsys):
    one = debugger.add("failsafe_tick")
    one.log = lambda moment: "tick"
    debugger.add("failsafe_fresh")
    console = Console(debugger)
    console.onecmd("continue")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) > 3
    assert all(line.endswith("tick") for line in lines[:-1])
    assert "breakpoint 2" in lines[-1]


@pytest.mark.parametrize("log_first", [False, True])
def test_a_log_where_another_breakpoint_stops_tells_each_time_once(debugger, log_first):
    pair = [debugger.add("failsafe_tick") for _ in range(2)]
    pair[0 if log_first else 1].log = lambda moment: "tick"
    for _ in range(3):
        debugger.move("continue")
        assert [(one.cycle, one.text) for one in debugger.log_outputs] == [(debugger.cpu.cycles, "tick")]
    third = debugger.cpu.cycles
    debugger.move("rcontinue")
    second = debugger.cpu.cycles
    debugger.move("continue")
    assert [one.cycle for one in debugger.log_outputs] == [second, third]


def test_counted_hits_are_those_of_the_whole_run_after_an_interruption(debugger):
    cycles = first_hits(debugger, 60)
    debugger.add("failsafe_tick", count="5")
    debugger.timeline.interrupted = lambda: True
    assert debugger.move("rcontinue") == "interrupted"
    debugger.timeline.interrupted = lambda: False
    debugger.go_to(cycles[-1] * CYCLE_TICKS)
    debugger.move("rcontinue")
    assert debugger.cpu.cycles == cycles[4]


def test_a_run_that_goes_on_within_an_instruction_begins_at_the_next_one():
    run = robot_run()
    run.to(1_200_100)
    while run.cpu.cycles * CYCLE_TICKS == run.world.tick:
        run.to(run.world.tick + 1)
    debugger = debugger_of(run)
    begun = debugger.cpu.cycles
    debugger.move("continue")
    for move in ("rcontinue", "rstepi"):
        assert debugger.move(move) == "the run begins here"
        assert debugger.cpu.cycles == begun
    debugger.add("failsafe_tick", count="2")
    debugger.go_to(SECOND)
    assert debugger.move("rcontinue") == "breakpoint 1"


def test_until_that_is_interrupted_does_not_say_that_there_is_no_event(debugger):
    session = Session(debugger)
    debugger.timeline.interrupted = lambda: True
    do(session, "until answer")
    assert "interrupted: " in session.lines[-1]
    debugger.timeline.interrupted = lambda: False
    do(session, "until touch")
    assert "no such event before the end: " in session.lines[-1]


def test_a_long_search_shows_a_bar_and_tells_after_it(debugger, capsys, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(ProgressBar, "PATIENCE_S", 0.0)
    monkeypatch.setattr(sys, "stderr", screen := Screen())
    console = Console(debugger)
    console.onecmd("continue")
    assert console.done
    assert "continue" in screen.getvalue()
    assert "the run ends here" in capsys.readouterr().out


def test_the_last_writer_is_that_of_brute_force():
    wrong, asked = proofs.wrong_writers(SECOND // 50, SECOND // 40, 40)
    assert wrong == []
    assert asked > 10


@pytest.mark.parametrize("later", [0, 1])  # at the first instruction of the routine, or behind it
def test_a_return_address_was_written_where_the_interrupt_came(moments, debugger, later):
    at = next(at for at, moment in enumerate(moments) if moment.calls and moment.calls[-1][2])
    stand(debugger, moments[at])
    pushed = debugger.bytes_of(f"iram[{debugger.cpu.sp}]")
    stand(debugger, moments[at + later])
    tick, frames = debugger.last_writer(pushed)
    assert (tick // CYCLE_TICKS, frames[0].pc) == (moments[at - 1].cycle, moments[at - 1].pc)
    assert debugger.cpu.cycles == moments[at + later].cycle


PROGRAMS = {"mix": (MIX,), "library": (LIBRARY,), "stack-auto": (LIBRARY, "--stack-auto")}


SUMS = """unsigned char sum;
unsigned char one(void) {
return sum + 1;
}
unsigned char two(void) {
return sum + 2;
}
void main(void) {
for (;;) {
sum = one() + two();
sum = 0;
}
}
"""


@needs_sdcc
def test_next_out_of_a_function_passes_what_else_the_line_of_its_caller_calls(tmp_path):
    (tmp_path / "sums.c").write_text(SUMS)
    debugger = debugger_of(proofs.compiled(tmp_path, tmp_path / "sums.c"))
    debugger.add("one")
    debugger.move("continue")
    lines = []
    for move in ("next", "next", "rnext", "continue", "next", "step"):
        debugger.move(move)
        lines.append(debugger.symbols.line(debugger.cpu.pc).line)
    assert lines == [4, 11, 10, 3, 4, 6]


@needs_sdcc
def test_steps_back_undo_steps_through_functions_that_a_library_calls(tmp_path):
    debugger = debugger_of(proofs.compiled(tmp_path, LIBRARY))
    debugger.go_to(1_000_000)
    stops = []
    while len(stops) < 20:
        debugger.move("step")
        stops.append((debugger.timeline.tick, debugger.cpu.pc))
    for stop in reversed(stops[:-1]):
        debugger.move("rstep")
        assert (debugger.timeline.tick, debugger.cpu.pc) == stop


BUSY = """unsigned char ticks, sum;
void tick(void) __interrupt(1) {
ticks++;
}
void main(void) {
TMOD = 2;
IE = 0x82;
TR0 = 1;
for (;;)
sum = ticks % 7 % 5 % 3 % 7 % 5 % 3 % 7 % 5 % 3 % 7 % 5 % 3;
}
"""


@needs_sdcc
@pytest.mark.parametrize("verb", ["step", "next"])
def test_a_line_back_from_an_interrupt_goes_to_what_it_interrupted(tmp_path, verb):
    (tmp_path / "busy.c").write_text("#include <8052.h>\n" + BUSY)
    debugger = debugger_of(proofs.compiled(tmp_path, tmp_path / "busy.c"))
    debugger.go_to(6_000)
    debugger.add("tick")
    for _ in range(20):
        debugger.move("continue")
        entered = debugger.timeline.tick
        debugger.move(f"r{verb}")
        assert debugger.symbols.place(debugger.cpu.pc) == "busy.c:11 in main"
        debugger.go_to(entered)
        while debugger.cpu.peripherals.interrupts.in_service:
            debugger.move(verb)
        assert debugger.symbols.place(debugger.cpu.pc) == "busy.c:11 in main"


def test_next_by_instruction_passes_interrupts():
    debugger = debugger_of(proofs.assembled(ASM.replace("LCALL twice", "NOP")))
    debugger.go_to(600)
    interrupts = debugger.cpu.peek_iram(0x30)
    for _ in range(400):
        debugger.move("next", by_instruction=True)
        assert not any(one.by_interrupt for one in debugger.frames())
    assert debugger.cpu.peek_iram(0x30) > interrupts


@needs_sdcc
@pytest.mark.parametrize("program", PROGRAMS.values(), ids=PROGRAMS)
def test_stacks_of_a_program_of_sdcc_are_those_of_the_calls_and_interrupts(tmp_path, program):
    shadow = proofs.stacks(proofs.compiled(tmp_path, *program), SECOND // 10, 0.1)
    assert shadow.compared > 1000
    assert shadow.wrong == []


RUNS = {"the robot": (robot_run, SECOND // 10), "assembler": (lambda: proofs.assembled(ASM), SECOND // 50)}


@pytest.mark.parametrize(("run", "end_tick"), RUNS.values(), ids=RUNS)
def test_stacks_are_those_of_the_calls_and_interrupts(run, end_tick):
    shadow = proofs.stacks(run(), end_tick, 0.1)
    assert shadow.compared > 1000
    assert shadow.wrong == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_states_of_a_random_walk_are_those_of_an_unbroken_run(seed):
    debugger = debugger_of(robot_run())
    stops = list(proofs.walk(debugger, 80, SECOND // 2, seed))
    assert len(stops) == 80
    assert proofs.differences(stops, robot_run()) == []


def test_the_digest_at_the_end_of_a_walk_is_the_golden_one():
    debugger = debugger_of(robot_run(settings=["duration_s=0.5"]))
    list(proofs.walk(debugger, 20, SECOND // 4, 3))
    debugger.go_to(debugger.timeline.run.end_tick)
    assert debugger.timeline.run.world.digest == golden_digest("fig6 0.5 s seed 7")


def test_checkpoints_stay_within_their_budget_and_any_moment_can_be_gone_to(monkeypatch):
    monkeypatch.setattr(timelines, "BUDGET_BYTES", 40_000)
    timeline = Timeline(robot_run())
    timeline.go_to(SECOND)
    assert timeline.kept_bytes <= 40_000
    stops = []
    for tick in (20 * SECOND // 21, SECOND // 3, 0, SECOND // 2):
        timeline.go_to(tick)
        stops.append((timeline.tick, timeline.state()))
    assert proofs.differences(stops, robot_run()) == []


def test_a_step_back_from_a_sleep_is_its_begin_and_a_step_leads_to_what_wakes():
    debugger = debugger_of(robot_run())
    timeline, cpu = debugger.timeline, debugger.cpu
    debugger.go_to(SECOND // 10)
    timeline.step()
    while not cpu.idle:
        timeline.step()
    asleep, begun = cpu.pc, timeline.tick
    timeline.step()
    assert cpu.pc in debugger.symbols.unwinder.vectors
    timeline.step_back()
    assert (cpu.pc, timeline.tick, bool(cpu.idle)) == (asleep, begun, True)


def test_a_search_is_interrupted_between_two_pieces():
    timeline = Timeline(robot_run())
    timeline.interrupted = lambda: True
    assert timeline.find({0: Trap((0x1FFF,), lambda core: True)}) is None
    assert 0 < timeline.tick < SECOND // 10


def test_steps_leave_chips_and_encoders_where_a_straight_run_has_them():
    timeline = Timeline(robot_run())
    timeline.go_to(14_075_000)
    stops = []
    for _ in range(400):
        timeline.step()
        stops.append((timeline.tick, timeline.state()))
    assert proofs.differences(stops, robot_run()) == []


CYCLES = 2000
PLACES = st.sets(st.integers(0, 0x60), max_size=8)


def machine():
    return Alone(image(ASM), stop_on_fault=False)


def executed():
    """(cycle, address) of the instructions of a run, one by one."""
    cpu, found = machine().cpu, []
    while cpu.cycles < CYCLES:
        cycle, pc, before = cpu.cycles, cpu.pc, cpu.instructions
        cpu.step()
        if cpu.instructions > before:  # else an interrupt came first
            found.append((cycle, pc))
    return found


EXECUTED = executed()


def asked(run, places, enough=CYCLES, others=None):
    """What was asked in `run`, up to `enough` questions, and the run's state at its end."""
    found = []

    def ask():
        found.append((run.cpu.cycles, run.cpu.pc))
        return len(found) == enough

    inspector = MarkInspector(run.cpu, places, ask, others)
    for pause in range(100, CYCLES + 1, 100):
        run.run(pause=pause)
    inspector.detach()
    return found, Flat(run.cpu).save()


@settings(max_examples=40)
@given(PLACES, st.integers(1, 20))
def test_each_execution_is_asked_about_until_it_is_enough(places, enough):
    plain = machine()
    plain.run(pause=CYCLES)
    found, state = asked(machine(), places, enough)
    assert found == [one for one in EXECUTED if one[1] in places][:enough]
    assert state == Flat(plain.cpu).save()


def test_marks_of_the_owner_still_end_its_run():
    run, until = machine(), EXECUTED[50][1]
    found = []
    inspector = MarkInspector(
        run.cpu, {until, EXECUTED[3][1]}, lambda: bool(found.append(run.cpu.pc)), lambda: (until,)
    )
    run.run(until=until, pause=CYCLES)
    inspector.detach()
    assert run.cpu.pc == until
    assert found[-1] == until
    assert EXECUTED[3][1] in found


BITS = """
LJMP main
ORG 0Bh
CPL 01h
RETI
ORG 30h
main:
MOV SP,#50h
MOV 20h,#0
MOV TMOD,#02h
MOV IE,#82h
SETB TR0
again:
SETB 00h
INC 20h
SETB TR1
MOV R0,#20h
MOV @R0,#05h
CLR 02h
ORL 20h,#80h
CLR TR1
ANL TCON,#0BFh
MOV C,01h
MOV 02h,C
JBC 02h,again
SJMP again
"""
"""Bits of one byte that instructions of all forms write, beside an interrupt that writes another one."""


def bit_changes(run, bit, end_tick):
    """The cycles before instructions that change a bit, or name it."""
    cpu, found = run.cpu, []
    while run.cpu.cycles * CYCLE_TICKS < end_tick:
        cycle, pc, executed = cpu.cycles, cpu.pc, cpu.instructions
        opcode, operand = cpu.code_at(pc), cpu.code_at(pc + 1)
        old = cpu_bit(cpu, bit)
        run.to(cycle * CYCLE_TICKS + 1)
        if cpu.instructions == executed:
            continue
        named = opcode in (0x92, 0xB2, 0xC2, 0xD2) and operand == bit
        if named or cpu_bit(cpu, bit) != old:
            found.append(cycle)
    return found


@pytest.mark.parametrize("bit", [0, 1, 2, 7, 0x8C, 0x8E])
def test_a_watched_bit_stops_where_it_is_written_itself(bit):
    expected = bit_changes(proofs.assembled(BITS), bit, 6_000)
    debugger = debugger_of(proofs.assembled(BITS))
    name = {0x8C: "TR0", 0x8E: "TR1"}.get(bit) or f"iram[0x20].{bit}"
    debugger.watch(name)
    found = []
    debugger.go_to(6_000)
    while debugger.move("rcontinue") == "breakpoint 1":
        found.append(debugger.cpu.cycles)
    assert found[::-1] == expected
    debugger.go_to(6_000)
    writer = debugger.last_writer(debugger.bytes_of(name))
    assert writer is not None
    assert writer[0] // CYCLE_TICKS == expected[-1]


def test_counting_hits_is_interrupted_and_counts_on():
    debugger = debugger_of(robot_run())
    debugger.add("lm629_command", count=">= 40")
    debugger.go_to(SECOND)
    with debugger.timeline.interrupted_by(lambda: True):
        assert debugger.move("continue") == "interrupted"
    counted = debugger.breakpoints[0]
    assert len(counted.hits) == 0
    assert debugger.move("rcontinue") == "breakpoint 1"
    assert counted.hits.itemsize * len(counted.hits) < 10_000
