"""Watchers see what a CPU does, and change nothing of it."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_robot.inspect.counters import Activity, Counters
from miro_robot.inspect.watcher import Watcher, attach, detach
from tests.naive import watching
from tests.robot.mcs51.rig import cpu_with
from tests.states import snapshot

# Two timers at two priorities, a serial port, sleep, and a busy main loop with branches.
BUSY = """
    LJMP start
    ORG 0Bh
    LJMP timer0
    ORG 1Bh
    LJMP timer1
    ORG 23h
    LJMP serial
timer0:
    PUSH ACC
    MOV A,30h
    MUL AB
    INC 30h
    POP ACC
    RETI
timer1:
    INC 31h
    NOP
    RETI
serial:
    CLR TI
    INC 32h
    RETI
start:
    MOV SP,#40h
    MOV TMOD,#22h
    MOV TH0,#{th0:03X}h
    MOV TH1,#{th1:03X}h
    MOV SCON,#50h
    MOV IP,#{ip:03X}h
    MOV IE,#{ie:03X}h
    SETB TR0
    SETB TR1
    MOV SBUF,#55h
again:
    MOV R7,#{loops:03X}h
inner:
    DIV AB
    DJNZ R7,inner
    JB 10h,again
    ORL PCON,#01h
    SJMP again
"""


class Log(Watcher):
    """Notes everything it is told in the words of the naive twin."""

    def __init__(self):
        self.steps = []

    def executed(self, cpu, pc, start):
        self.steps.append(watching.Step("run", pc, start, cpu.cycles, cpu.pc, cpu.sp))

    def interrupted(self, cpu, source, pc, start):
        self.steps.append(watching.Step("call", pc, start, start + 2, 8 * source + 3, cpu.sp))

    def slept(self, cpu, start, end):
        self.steps.append(watching.Step("sleep", cpu.pc, start, end, cpu.pc, cpu.sp))


PROGRAMS = st.builds(
    BUSY.format,
    th0=st.integers(0, 0xE0),
    th1=st.integers(0, 0xC0),
    ip=st.sampled_from([0, 0x02, 0x08, 0x10, 0x1A]),
    ie=st.sampled_from([0x82, 0x88, 0x90, 0x8A, 0x9A]),
    loops=st.integers(1, 20),
)
CUTS = st.lists(st.integers(1, 700), min_size=1, max_size=12)


def run(cpu, cuts):
    for cut in cuts:
        cpu.run(cpu.cycles + cut)


def shown(steps):
    """Instructions and calls in their order; where sleep is cut depends on who looks."""
    return [(step.kind, step.start) for step in steps if step.kind != "sleep"]


@given(PROGRAMS, CUTS)
@settings(max_examples=25)
def test_a_watched_run_ends_in_the_same_state_and_tells_each_step(text, cuts):
    plain, watched, naive = cpu_with(text), cpu_with(text), cpu_with(text)
    log = Log()
    attach(watched, log)
    run(plain, cuts)
    run(watched, cuts)
    assert snapshot(watched) == snapshot(plain)
    taken = watching.steps(naive, plain.cycles)
    assert snapshot(naive) == snapshot(plain)
    assert shown(log.steps) == shown(taken)


@given(PROGRAMS, CUTS)
@settings(max_examples=25)
def test_counters_and_activity_equal_the_naive_twin(text, cuts):
    cpu, naive = cpu_with(text), cpu_with(text)
    counters, activity = Counters(), Activity()
    attach(cpu, counters, activity)
    run(cpu, cuts)
    taken = watching.steps(naive, cpu.cycles)
    ran, spent = watching.executions(taken), watching.cycles(taken)
    assert {at: counters.executed_at(at) for at in counters.addresses()} == ran
    assert {at: counters.cycles_at(at) for at in counters.addresses()} == spent
    assert activity.cycles == cpu.cycles
    asleep = [step.end - step.start for step in taken if step.kind == "sleep"]
    assert activity.asleep_cycles == sum(asleep)
    assert activity.highest_sp == max(7, *(step.sp for step in taken))
    durations = watching.routines(cpu, taken)
    for source in range(6):
        found, own = activity.interrupts[source], durations.get(source, [0])
        assert found.count == len(
            [step for step in taken if step.kind == "call" and step.pc_after == 8 * source + 3]
        )
        assert (found.worst_duration, found.total_cycles) == (max(own), sum(own))


def test_a_jump_is_counted_as_taken_only_when_it_leaves():
    cpu = cpu_with("MOV R0,#3\nagain:\nDJNZ R0,again\nend:\nSJMP end")
    counters = Counters()
    attach(cpu, counters)
    cpu.run(20)
    assert (counters.executed_at(2), counters.jumped_at(2)) == (3, 2)


@pytest.mark.parametrize(
    ("loop", "latency"),
    [
        ("ORL PCON,#01h", 3),  # out of sleep: flag latched in cycle n, first cycle of the routine n + 4
        ("DIV AB\n" * 4, 6),  # polling waits for the last of four cycles
        ("SETB EA\nDIV AB", 7),  # one more instruction runs after an access to IE
    ],
    ids=["sleep", "division", "access to IE"],
)
def test_the_worst_latency_is_that_of_the_data_sheet(loop, latency):
    """4316E section 2.16."""
    start = "LJMP main\nORG 0Bh\nRETI\nmain:\nMOV TMOD,#02h\nMOV TH0,#9Ch\nMOV IE,#82h\nSETB TR0\n"
    cpu = cpu_with(f"{start}again:\n{loop}\nSJMP again")
    activity = Activity()
    attach(cpu, activity)
    cpu.run(3000)
    assert activity.interrupts[1].worst_latency == latency
    assert activity.interrupts[1].count > 10


def test_a_detached_watcher_is_told_no_more_and_the_others_go_on():
    cpu = cpu_with("again:\nSJMP again")
    first, second = Counters(), Counters()
    attach(cpu, first)
    attach(cpu, second)
    cpu.run(10)
    detach(cpu, first)
    cpu.run(20)
    assert (first.executed_at(0), second.executed_at(0)) == (5, 10)
    detach(cpu, second)
    assert cpu.inspector is None
