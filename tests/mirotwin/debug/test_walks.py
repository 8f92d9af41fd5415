"""Going back and forth changes nothing: each moment is that of a run that never stopped."""

import pytest

from mirotwin.debug import timeline as timelines
from mirotwin.debug.timeline import Timeline, Trap
from tests.mirotwin.debug.runs import SECOND, debugger_of, golden_digest, robot_run
from tests.mirotwin.debug.walks import differences, walk


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_states_of_a_random_walk_are_those_of_an_unbroken_run(seed):
    debugger = debugger_of(robot_run())
    stops = list(walk(debugger, 80, SECOND // 2, seed))
    assert len(stops) == 80
    assert differences(stops, robot_run()) == []


def test_the_digest_at_the_end_of_a_walk_is_the_golden_one():
    debugger = debugger_of(robot_run(settings=["duration_s=0.5"]))
    list(walk(debugger, 20, SECOND // 4, 3))
    debugger.go_to(debugger.timeline.run.end_tick)
    assert debugger.timeline.run.world.digest == golden_digest("fig6 0.5 s seed 7")


def test_checkpoints_stay_within_their_budget_and_any_moment_can_be_gone_to(monkeypatch):
    monkeypatch.setattr(timelines, "BUDGET_BYTES", 40_000)
    timeline = Timeline(robot_run())
    timeline.find({}, SECOND)
    assert timeline.kept_bytes <= 40_000
    stops = []
    for tick in (20 * SECOND // 21, SECOND // 3, 0, SECOND // 2):
        timeline.go_to(tick)
        stops.append((timeline.tick, timeline.state()))
    assert differences(stops, robot_run()) == []


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
    timeline = Timeline(robot_run(), lambda: True)
    assert timeline.find({0: Trap((0x1FFF,), lambda core: True)}) is None
    assert 0 < timeline.tick < SECOND // 10


def test_steps_leave_chips_and_encoders_where_a_straight_run_has_them():
    timeline = Timeline(robot_run())
    timeline.go_to(14_075_000)
    stops = []
    for _ in range(400):
        timeline.step()
        stops.append((timeline.tick, timeline.state()))
    assert differences(stops, robot_run()) == []
