"""Marked instructions are asked about each time before they are executed, and that changes nothing."""

from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.state import Flat
from miro_robot.bare.machine import BareMachine
from miro_robot.inspect.marks import MarkInspector
from tests.mirotwin.debug.runs import ASM
from tests.mirotwin.verify.bare.firmwares import image

CYCLES = 2000
PLACES = st.sets(st.integers(0, 0x60), max_size=8)


def machine():
    return BareMachine(image(ASM), stop_on_fault=False)


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
