"""Logs of a PC and of a robot's board, and cursors that read them on."""

import pytest

from miro_protocol.decoder import TelemetryDecoder
from miro_protocol.frames import TelemetryFrame, encode, seal
from miro_protocol.table import TELEMETRY
from miro_protocol.transmission import Transmission
from miro_robot.event_log import START_LOST, EventLog
from miro_sim.world.events import KEPT, BoardLog, Cursor, Event, HostLog

RECEIVED, SENT, REACHED = 0, 1, 4  # of a board's log, which keeps 2048 events
CAPACITY = 2048


def robot_log():
    return BoardLog(EventLog(), 0, 2)


def host_log():
    return HostLog(0, lambda start_tick: start_tick + 7, 3)


def test_a_cursor_gives_what_was_noted_after_it_was_made_once():
    log = robot_log()
    log.log.note(SENT, 5, 0, 0x41)
    cursor = Cursor(log)
    log.log.note(SENT, 6, 0, 0x42)
    assert cursor.read() == [(1, Event(tick=6, what="transmitted", slot=2, value=0x42))]
    assert cursor.read() == []


def test_a_cursor_on_a_pc_may_read_events_of_some_kinds_alone():
    log = host_log()
    every, some, none = Cursor(log), Cursor(log), Cursor(log)
    log.note_heard([(0x55, True, 10)])
    log.note(Event(tick=11, what="answer"))
    assert [(serial, event.what, event.tick) for serial, event in every.read()] == [
        (0, "heard", 17),
        (1, "answer", 11),
    ]
    assert [(serial, event.what) for serial, event in some.read(("heard", "sent"))] == [(0, "heard")]
    assert [(serial, event.what) for serial, event in none.read(("answer",))] == [(1, "answer")]
    log.cut(1)
    log.note(Event(tick=12, what="sent"))
    assert [(serial, event.what) for serial, event in log.since(0, ("answer", "sent"))] == [(1, "sent")]


def test_what_a_pc_sent_and_was_answered_are_events_when_its_log_is_read():
    log = host_log()
    cursor = Cursor(log)
    (answer,) = TelemetryDecoder().feed(encode(TelemetryFrame(seq=3, slot=2), 3), 1000)
    log.note(Transmission(5, ">", b"ab", 0, (1,)))
    log.note(answer)
    assert [event for _, event in cursor.read(("sent", "answer"))] == [
        Event(tick=5, what="sent", data=b"ab", good_stop=False),
        Event(tick=answer.last_tick + 7, what="answer", value=2, frame=answer),
    ]


def test_an_answer_that_no_robot_gives_is_of_no_slot():
    log = host_log()
    cursor = Cursor(log)
    (answer,) = TelemetryDecoder().feed(seal(TELEMETRY, bytes([2 << 6, 0xC0, *[0] * 8])), 0)
    log.note(answer)
    assert [event.value for _, event in cursor.read()] == [-1]


def test_a_cursor_on_a_robot_may_read_events_of_some_kinds_alone():
    log = robot_log()
    cursor = Cursor(log)
    for kind in (RECEIVED, SENT, REACHED):
        log.log.note(kind, 5, 1, 0x41)
    assert [(serial, event.what) for serial, event in cursor.read(("reached", "fault"))] == [(2, "reached")]
    assert cursor.read() == []


@pytest.mark.slow
def test_a_cursor_counts_what_was_dropped_before_it_was_read():
    robot, host = robot_log(), host_log()
    on_robot, on_host = Cursor(robot), Cursor(host)
    for tick in range(CAPACITY + 3):
        robot.log.note(SENT, tick, 0, 0)
    for tick in range(KEPT + 4):
        host.note(Event(tick=tick, what="sent"))
    assert (on_robot.lost, on_host.lost) == (3, 4)
    assert list(host.since(0, ("sent",))) == list(host.since(0))
    assert [on_robot.read()[0][0], on_host.read()[0][0]] == [3, 4]
    assert (on_robot.lost, on_host.lost) == (0, 0)


def test_a_start_that_another_one_replaced_is_an_event_of_its_chip():
    log = robot_log()
    log.log.note(START_LOST, 7, 1, 0)
    ((_, event),) = log.since(0)
    assert event == Event(tick=7, what="start_lost", slot=2, side="right")
    assert str(event) == "tick 7: net0/robot2: start_lost right"
