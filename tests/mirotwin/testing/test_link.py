"""What the link fixture does: sending, expecting, silence."""

import pytest

from miro_exact.bad_input import BadInput
from miro_exact.clock import ms
from miro_protocol.frames import TeamFrame, TelemetryFrame
from miro_sim.world import conditions
from mirotwin.testing.waiting import WaitFailed
from tests.mirotwin.testing.rigs import rig


def test_numbers_count_by_themselves_and_velocities_go_by_slot():
    one = rig()
    link, robot = one.links[0], one.robots[0]
    assert [link.send(velocities={0: (100, -100)}).seq for _ in range(3)] == [0, 1, 2]
    one.world.run_for(ms(5))
    assert robot.wheels.commanded == (100, -100)
    assert (robot.read("last_left"), robot.read("last_right")) == (100, -100)
    link.send(velocities={1: (7, 7)})
    one.world.run_for(ms(5))
    assert robot.wheels.commanded == (0, 0)
    assert robot.wheels.mode == ("drive", "drive")
    assert robot.read("frames_accepted") == 4


def test_a_frame_of_ones_own_brings_its_number_and_the_next_one_follows_it():
    link = rig().links[0]
    link.send(TeamFrame(0, 62, ((1, 2), (3, 4), (5, 6))))
    assert [link.ping().seq, link.poll(2).seq, link.send(velocities={}, seq=9).seq] == [63, 2, 9]
    assert link.velocities == [(0, 0), (0, 0), (0, 0)]


def test_a_poll_asks_the_robot_in_its_turn_and_keeps_the_velocities():
    one = rig(settings=["network.robots=5", "network.robot.slot=4"])
    link = one.links[0]
    link.send(velocities={4: (300, 300)})
    assert link.poll(4).seq == 4
    assert link.expect(within=ms(40), slot=4).seq == 4
    assert one.robots[0].wheels.commanded == (300, 300)
    assert link.poll(4).seq == 9


def test_a_poll_that_the_robot_would_take_for_an_old_frame_is_refused():
    link = rig(settings=["network.robots=5", "network.robot.slot=4"]).links[0]
    link.send(velocities={}, seq=59)
    with pytest.raises(ValueError, match="no number that is fresh after 59 asks robot 4"):
        link.poll(4)


def test_a_character_with_a_bad_stop_bit_spoils_its_frame():
    one = rig()
    one.links[0].send(velocities={0: (50, 50)}, bad_stop=[10])
    one.world.run_for(ms(5))
    assert one.robots[0].read("frames_accepted") == 0
    one.links[0].send(velocities={0: (50, 50)})
    one.world.run_for(ms(5))
    assert one.robots[0].read("frames_accepted") == 1


def test_without_wait_time_stands_and_frames_queue():
    one = rig()
    begun = one.world.tick
    first, second = (one.links[0].send(velocities={}, wait=False) for _ in range(2))
    assert one.world.tick == begun
    assert first.end_tick == second.tick
    later = one.links[0].send(b"\x00\xff", at_tick=second.end_tick + ms(7))
    assert (later.tick, later.seq) == (second.end_tick + ms(7), None)
    assert one.world.tick == later.end_tick


def test_answers_that_nobody_has_taken_stay():
    one = rig(
        settings=[
            'network.robot=[{slot = 0, reference = {kind = "line", start_x_cm = 20.0, drive_s = 1.0}}, '
            '{slot = 1, reference = {kind = "line", start_x_cm = 20.0, start_y_cm = 40.0, drive_s = 1.0}}]'
        ]
    )
    link = one.links[0]
    link.poll(0)
    one.world.run_for(ms(25))
    link.poll(1)
    one.robots[0].break_at("motion_stop")  # a wait of somebody else, while both answers come
    assert link.expect(TelemetryFrame, slot=1, within=0).slot == 1
    assert link.expect(TelemetryFrame, within=0).slot == 0
    with pytest.raises(WaitFailed, match="no answer within 0 ms"):
        link.expect(TelemetryFrame, within=0)
    assert [answer.slot for _, answer in link.answers] == [0, 1]


def test_the_wait_of_the_world_and_that_of_the_link_take_nothing_from_each_other():
    one = rig()
    one.links[0].poll(0)
    one.links[0].expect(within=ms(40))
    started = one.world.run_until(conditions.Command(name="STT"), within=0)
    assert started.tick < one.world.tick
    heard = one.world.run_until(conditions.Answer(), within=0)
    assert heard.tick == one.links[0].answers[0][0]


def test_an_answer_stops_the_world_at_the_end_of_its_last_character():
    one = rig()
    one.links[0].poll(0)
    one.links[0].expect(within=ms(40))
    assert one.world.tick == one.links[0].answers[0][0]


def test_an_answer_of_other_content_is_not_the_one_that_was_asked_for():
    one = rig()
    one.links[0].poll(0)
    with pytest.raises(WaitFailed, match="no answer with accepted=7 within 40 ms"):
        one.links[0].expect(accepted=7, within=ms(40))
    assert one.links[0].expect(accepted=1, within=0).slot == 0


def test_what_failed_says_what_happened_instead():
    one = rig()
    one.links[0].poll(1)
    with pytest.raises(
        WaitFailed, match=r"(?s)no answer within 40 ms, from tick \d+ .*robot0: command left STT"
    ) as caught:
        one.links[0].expect(within=ms(40))
    assert caught.value.tick == caught.value.begun_tick + ms(40)


def test_silence_is_kept_or_broken_at_the_first_character():
    one = rig()
    begun = one.world.tick
    one.links[0].expect_silence(ms(20))
    assert one.world.tick == begun + ms(20)
    one.links[0].poll(0)
    with pytest.raises(WaitFailed, match=r"(?s)silence for 40 ms: broken.*heard 55h"):
        one.links[0].expect_silence(ms(40))
    one.links[0].expect(within=ms(40))
    one.links[0].expect_silence(ms(1))


def test_characters_are_found_in_what_was_heard():
    one = rig()
    one.links[0].poll(0)
    tick = one.links[0].expect_bytes(b"\x55\x55\xff\x2d", within=ms(40))
    assert tick == one.world.tick
    assert tick < one.links[0].expect_bytes(b"\xd4", within=ms(40))
    with pytest.raises(WaitFailed, match="55 55 not heard within 30 ms"):
        one.links[0].expect_bytes(b"\x55\x55", within=ms(30))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({}, "nothing to send: give a frame, bytes, or velocities"),
        ({"velocities": {3: (1, 1)}}, "slot 3 does not exist on a network of 3 robots"),
        ({"velocities": {0: (40000, 1)}}, r"slot 0 left = 40000: must be -32767..32767"),
        ({"frame": b"\x00", "bad_stop": [1]}, "net0: "),
    ],
)
def test_what_cannot_be_sent_is_refused(keys, said):
    with pytest.raises(ValueError, match=said):
        rig().links[0].send(**keys)


def test_a_field_that_telemetry_does_not_have_is_refused():
    with pytest.raises(BadInput, match="telemetry has no field 'acepted'; it has seq, slot, flags"):
        rig().links[0].expect(acepted=1, within=1)


@pytest.mark.parametrize(
    "wait",
    [
        lambda link: link.expect(within=0.08),
        lambda link: link.expect_bytes(b"\x55", within=0.08),
        lambda link: link.expect_silence(0.08),
    ],
)
def test_seconds_where_ticks_belong_are_refused(wait):
    with pytest.raises(ValueError, match=r"is no whole number of ticks; mirotwin.ms\(40\) gives one"):
        wait(rig().links[0])
