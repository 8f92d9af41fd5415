"""What became of each transmission."""

import pytest

from miro_protocol.frames import TeamFrame
from mirotwin import ms
from mirotwin.report.page.link import LinkLog, lanes_of

HEARS = "net0/robot0 hears"


@pytest.fixture
def log(world):
    return LinkLog(world)


def fates(world, log):
    """Kinds at the robot after the period under way."""
    world.run_to(world.period_end)
    return [mark.kind for mark in log.marks() if mark.lane == HEARS and mark.kind != "noise"]


def test_a_frame_that_arrives_is_fresh_and_the_same_number_again_is_a_repetition(world, link, log):
    frame = TeamFrame(0, 9, ((0, 0), (0, 0), (0, 0)))
    link.send(frame)
    link.send(frame)
    world.run_for(ms(20))
    assert fates(world, log) == ["fresh", "repeated"]


def test_a_bad_stop_bit_damages_a_frame(world, link, log):
    link.send(velocities={0: (5, 5)}, bad_stop=[12])
    world.run_for(ms(40))
    link.send(velocities={0: (5, 5)})
    world.run_for(ms(40))
    assert fates(world, log) == ["damaged", "fresh"]
    damaged = next(mark for mark in log.marks() if mark.kind == "damaged")
    sent = next(mark for mark in log.marks() if mark.kind in ("sent", "raw"))
    assert (damaged.start_tick, damaged.end_tick) == (sent.start_tick, sent.end_tick)


def test_a_frame_on_a_radio_that_is_down_is_lost(world, link, log):
    link.radio("down")
    link.send(velocities={0: (5, 5)})
    world.run_for(ms(30))
    link.radio("up")
    link.send(velocities={0: (5, 5)})
    world.run_for(ms(30))
    assert fates(world, log) == ["lost", "fresh"]
    assert "net0 done to it" in lanes_of(log.marks())


def test_characters_that_are_no_frame_are_shown_as_such(world, link, log):
    link.send(b"\x01\x02\x03")
    world.run_for(ms(60))
    marks = log.marks()
    assert [mark.text for mark in marks if mark.lane == "net0 PC sends"] == ["3 characters"]
    assert [mark.kind for mark in marks if mark.lane == HEARS] == ["damaged"]


def test_a_valid_answer_is_told_from_a_damaged_one(world, link, log):
    link.poll(slot=0)
    world.run_for(ms(40))
    world.run_to(world.period_end)
    heard = [mark for mark in log.marks() if mark.lane == "net0 PC hears"]
    assert [mark.kind for mark in heard if mark.kind != "noise"] == ["answer"]
    assert any("slot=0" in mark.text for mark in heard)


def test_a_frame_under_way_at_the_end_is_not_lost(world, link, log):
    world.run_to(world.period_end)
    link.send(velocities={0: (5, 5)}, at_tick=world.period_end - ms(8), wait=False)
    world.run_to(world.period_end)
    begun = [mark for mark in log.marks() if mark.lane == HEARS and mark.kind != "noise"]
    assert [(mark.kind, mark.end_tick) for mark in begun] == [("open", world.tick)]
