"""Steps, stacks and writers are those that a list of all moments of the run tells."""

import random
import sys
from itertools import pairwise

import pytest

from miro_exact.clock import CYCLE_TICKS
from mirotwin.debug.console import Console
from mirotwin.shell.progress import ProgressBar
from tests.mirotwin.debug.runs import SECOND, debugger_of, robot_run
from tests.mirotwin.shell.test_progress import Screen
from tests.naive.debugger import history, last_change, next_line

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


def some(moments, count, seed):
    return sorted(random.Random(seed).sample(range(len(moments) // 2), count))


def test_stacks_are_those_of_the_calls_that_were_made(moments, debugger):
    for at in some(moments, 60, 1):
        stand(debugger, moments[at])
        frames = debugger.frames()
        assert [frame.pc for frame in frames[1:]] == [back for back, _, _ in reversed(moments[at].calls)]
        assert [frame.by_interrupt for frame in frames[:-1]] == [
            one for _, _, one in reversed(moments[at].calls)
        ]


def test_next_stops_where_another_line_of_the_function_or_its_caller_begins(moments, debugger):
    starts, line = set(debugger.symbols.line_begins), debugger.symbols.line
    on_lines = [at for at in some(moments, 300, 2) if moments[at].pc in starts and line(moments[at].pc)][:30]
    for at in on_lines:
        stand(debugger, moments[at])
        debugger.step("over")
        expected = next_line(moments, at, starts, line)
        assert (debugger.cpu.cycles, debugger.cpu.pc) == (expected.cycle, expected.pc)


def test_a_line_back_undoes_a_line_forward(moments, debugger):
    line = debugger.symbols.line
    debugger.breakpoints.clear()
    for at in some(moments, 12, 3):
        stand(debugger, moments[at])
        debugger.step("over")  # to where a line begins
        stops = []
        for _ in range(6):
            frames = debugger.frames()
            stops.append((debugger.timeline.tick, line(debugger.cpu.pc), len(frames)))
            debugger.step("over")
        depth = min(deep for _, _, deep in stops)
        outer = [stop for stop in stops if stop[2] == depth]
        if len(outer) < len(stops):
            continue  # it returned meanwhile: a line back goes over the call as a whole
        debugger.go_to(stops[-1][0])
        for tick, _, _ in reversed(stops[:-1]):
            debugger.step("over", back=True)
            assert debugger.timeline.tick == tick


def test_finish_returns_to_the_caller_and_its_reverse_to_the_call(moments, debugger):
    deep = [at for at in some(moments, 200, 4) if moments[at].calls][:20]
    for at in deep:
        back, _, _ = moments[at].calls[-1]
        stand(debugger, moments[at])
        debugger.step("out")
        assert debugger.cpu.pc == back
        stand(debugger, moments[at])
        debugger.step("out", back=True)
        call = moments[max(to for to in range(at) if moments[to].calls == moments[at].calls[:-1])]
        assert (debugger.cpu.cycles, debugger.cpu.pc) == (call.cycle, call.pc)


def test_an_instruction_forward_and_back_are_neighbours(moments, debugger):
    for at in some(moments, 40, 5):
        stand(debugger, moments[at + 1])
        debugger.step("into", back=True, by_instruction=True)
        slept = debugger.cpu.idle
        assert slept or (debugger.cpu.cycles, debugger.cpu.pc) == moments[at][:2]
        debugger.step("into", by_instruction=True)
        assert slept or (debugger.cpu.cycles, debugger.cpu.pc) == moments[at + 1][:2]


def test_the_last_writer_is_the_last_instruction_that_changed_it_or_a_later_one_that_did_not(
    moments, debugger
):
    names = [one for one in debugger.symbols.variables_in("") if one.space == "iram"]
    chance = random.Random(6)
    for at in some(moments, 25, 6):
        variable = chance.choice(names)
        stand(debugger, moments[at])
        found = debugger.last_writer(debugger.bytes_of(variable.name))
        changed = last_change(moments, at, variable.address, variable.type.size)
        assert debugger.cpu.cycles == moments[at].cycle
        assert changed is None or (found is not None and found[0] >= changed.cycle * CYCLE_TICKS)
        if found is not None:
            writer = next(one for one in moments if one.cycle * CYCLE_TICKS == found[0])
            assert found[1][0].pc == writer.pc


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
        debugger.go_on()
        forward.append(debugger.cpu.cycles)
    assert set(changes) <= set(forward)
    backward = []
    while debugger.go_on(back=True).startswith("breakpoint"):
        backward.append(debugger.cpu.cycles)
    assert backward == forward[-2::-1]


def test_hits_are_counted_from_the_begin_of_the_run_in_both_directions(debugger):
    place = debugger.symbols.at("failsafe_tick")[0]
    debugger.add("each", place)
    cycles = []
    for _ in range(7):
        debugger.go_on()
        cycles.append(debugger.cpu.cycles)
    debugger.breakpoints.clear()
    debugger.add("third", place, count="% 3")
    assert debugger.go_on(back=True) == "breakpoint 2"
    assert debugger.cpu.cycles == cycles[5]
    debugger.go_on(back=True)
    assert debugger.cpu.cycles == cycles[2]
    debugger.go_on()
    assert debugger.cpu.cycles == cycles[5]


def test_a_log_point_tells_and_does_not_stop(debugger, capsys):
    one = debugger.add("log", debugger.symbols.at("failsafe_tick")[0])
    one.log = lambda moment: "tick"
    debugger.add("stop", debugger.symbols.at("failsafe_fresh")[0])
    console = Console(debugger)
    console.run("continue")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) > 3
    assert all(line.endswith("tick") for line in lines[:-1])
    assert "breakpoint 2" in lines[-1]


def test_a_long_search_shows_a_bar_and_tells_after_it(debugger, capsys, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(ProgressBar, "PATIENCE_S", 0.0)
    monkeypatch.setattr(sys, "stderr", screen := Screen())
    assert Console(debugger).run("continue")
    assert "continue" in screen.getvalue()
    assert "the run ends here" in capsys.readouterr().out
