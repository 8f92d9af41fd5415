"""What the robot fixture does: wheels, breakpoints, memory, switches."""

import pytest

from miro_exact.bad_input import BadInput
from miro_exact.clock import ms
from miro_sim.world import conditions
from miro_sim.world.waits import WaitExpired
from mirotwin.testing.waiting import WaitFailed
from tests.mirotwin.testing.rigs import rig


def test_service_frames_reach_the_firmware():
    one = rig()
    one.links[0].set_acceleration(0, 1000)
    one.links[0].set_filter(0, 1, 2, 3, 4)
    one.world.run_for(ms(5))
    assert one.robots[0].read("acceleration") == [0xE8, 3, 0, 0]
    assert one.robots[0].read("filter[2]") == 2


def test_wheels_turn_stop_and_are_switched_off_as_the_failsafe_says():
    one = rig()
    link, robot = one.links[0], one.robots[0]
    link.drive({0: (2278, 1139)}, ms(500))  # 0.2 and 0.1 m/s
    left, right = robot.wheels.speed_m_s
    assert 0.19 < left < 0.21
    assert 0.09 < right < 0.11
    duties = []
    for _ in range(8):  # one sample's duty is noisy
        one.world.run_for(ms(5))
        duties.append(robot.wheels.pwm)
    left_duty, right_duty = (sum(duty[side] for duty in duties) for side in (0, 1))
    assert left_duty > right_duty > 0
    assert robot.wheels.left.position > robot.wheels.right.position > 0
    end = robot.break_at("motion_stop", within=ms(150))
    one.world.run_for(ms(1))
    assert robot.wheels.mode == ("stop", "stop")
    assert robot.wheels.commanded == (0, 0)
    robot.break_at("motion_off", within=ms(400))
    one.world.run_for(ms(1))
    assert robot.wheels.mode == ("off", "off")
    assert one.world.tick - end.tick > ms(389)


def test_a_breakpoint_stops_each_time_before_its_instruction():
    one = rig()
    link, robot = one.links[0], one.robots[0]
    ticks = []
    for _ in range(3):
        link.send(velocities={0: (5, 5)})
        ticks.append(robot.break_at("_motion_team", within=ms(10)).tick)
    assert robot.read("frames_accepted") == 3
    assert ticks == sorted(set(ticks))
    with pytest.raises(WaitFailed, match="motion_team was not reached within 10 ms"):
        robot.break_at("motion_team", within=ms(10))


def test_a_wait_without_an_end_ends_at_the_limit_of_virtual_time():
    one = rig(settings=["duration_s=0.3"])
    with pytest.raises(WaitFailed, match=r"limit of virtual time was reached, duration_s = 0\.3"):
        one.robots[0].break_at("motion_team")
    with pytest.raises(WaitFailed, match=r"no answer .* limit of virtual time was reached"):
        one.links[0].expect(within=ms(500))
    with pytest.raises(WaitFailed, match=r"silence .* limit of virtual time was reached"):
        one.links[0].expect_silence(ms(500))
    with pytest.raises(WaitExpired, match="the run ended"):
        one.world.run_until(conditions.Answer())


def test_a_symbol_that_is_no_function_is_refused_with_what_comes_close():
    robot = rig().robots[0]
    with pytest.raises(BadInput, match=r"motion_stap: there is no such function; did you mean motion_stop"):
        robot.break_at("motion_stap")
    with pytest.raises(BadInput, match="last_left: is no code"):
        robot.break_at("last_left")


def test_writing_into_a_robots_memory_is_remembered():
    one = rig()
    assert not one.written
    one.robots[0].write("last_left", -5)
    assert one.robots[0].read("last_left") == -5
    assert one.written


def test_a_reset_forgets_what_the_firmware_counted_and_comes_up_again():
    one = rig()
    link, robot = one.links[0], one.robots[0]
    link.drive({0: (300, 300)}, ms(100))
    assert robot.read("frames_accepted") == 3
    begun = one.world.tick
    robot.reset()
    assert ms(1) < one.world.tick - begun < ms(1) + 300
    assert robot.wait_until_up(within=ms(10)) < begun + ms(10)
    assert robot.read("frames_accepted") == 0
    link.poll(0)
    assert link.expect(within=ms(40)).accepted == 1


def test_a_robot_without_power_is_silent_and_comes_back():
    one = rig()
    link, robot = one.links[0], one.robots[0]
    robot.power_off()
    link.poll(0)
    link.expect_silence(ms(40))
    with pytest.raises(WaitFailed, match="has not turned its serial receiver on within 20 ms"):
        robot.wait_until_up(within=ms(20))
    robot.power_on()
    robot.wait_until_up()
    link.poll(0)
    link.expect(within=ms(40))


def test_a_radio_that_is_down_loses_frames_and_the_failsafe_stops_the_wheels():
    one = rig()
    link, robot = one.links[0], one.robots[0]
    link.drive({0: (300, 300)}, ms(100))
    link.radio("down")
    link.drive({0: (300, 300)}, ms(150))
    assert robot.wheels.mode == ("stop", "stop")
    link.radio("up")
    link.drive({0: (300, 300)}, ms(34))
    assert robot.wheels.mode == ("drive", "drive")
