"""Noise in the control signal: bounded, in what is sent and nowhere else, past the CRC."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.rng import Stream
from miro_host.pilot import STANDSTILL, WheelCommand
from miro_host.wheels import Wheels, wheel_command
from miro_protocol.decoder import Decoder, Received
from miro_sim.scenario.keys import ControlNoise
from miro_sim.world.network import noisy
from tests.sim.world.rig import world_of

WHEELS = Wheels()
TEXT = """
name = "noisy"
duration_s = 0.5
[camera]
kind = "gaussian"
position_error_cm = 0
heading_error_deg = 0
[[network]]
radio.profile = "wire"
{}
[[network.robot]]
slot = 1
reference.kind = "line"
wheel_radius_mismatch = 0.0
"""


def command(v_m_s, w_rad_s):
    return WheelCommand(*wheel_command(WHEELS, v_m_s, w_rad_s), v_m_s, w_rad_s)


@given(st.integers(0, 2**63 - 1), st.integers(0, 10**6), st.floats(0, 1), st.floats(0, 40))
def test_what_is_sent_is_a_command_within_the_bounds(seed, period, v_bound, w_bound):
    """At 0.2 m/s no wheel limit is met below 0.2 + 0.4 m/s; beyond it the limit holds."""
    bounds = ControlNoise(v_m_s=v_bound, w_rad_s=w_bound)
    left, right = noisy(command(0.2, 1.0), bounds, WHEELS, Stream(seed, "net0/robot0/control"), period)
    assert max(abs(left), abs(right)) <= 16_633
    v_m_s = (left + right) / 2 / WHEELS.units_per_m_s
    w_rad_s = (right - left) / WHEELS.units_per_m_s / WHEELS.track_m
    if v_bound + 0.034 * w_bound < 1.2:
        assert abs(v_m_s - 0.2) <= v_bound + 1e-4
        assert abs(w_rad_s - 1.0) <= w_bound + 2e-3


def test_no_bounds_are_no_noise_and_no_rounding():
    odd = WheelCommand(123, -456, 0.0, 0.0)  # not what v and w would give
    assert noisy(odd, ControlNoise(), WHEELS, Stream(1, "a"), 3) == (123, -456)


def test_draws_are_even_over_the_bounds_and_new_in_each_period():
    def speed(period):
        return (
            sum(noisy(STANDSTILL, ControlNoise(v_m_s=0.1), WHEELS, Stream(5, "a"), period))
            / 2
            / WHEELS.units_per_m_s
        )

    speeds = [speed(period) for period in range(4000)]
    assert len(set(speeds)) > 1500
    assert abs(sum(speeds) / 4000) < 4 * 0.1 / (3 * 4000) ** 0.5
    assert sum(abs(speed) < 0.05 for speed in speeds) == pytest.approx(2000, abs=4 * 32)
    assert speed(17) == speed(17)


def run(lines, seed=2, periods=12):
    world = world_of(TEXT.format(lines), seed=seed)
    return world, [world.step() for _ in range(periods)]


def sent(periods):
    decoder = Decoder(3)
    data = b"".join(run.data for period in periods for run in period.wire if run.direction == ">")
    return [event.message(3).velocities[1] for event in decoder.feed(data) if isinstance(event, Received)]


def test_frames_carry_noise_that_the_controller_does_not_know_of_and_pass_the_crc():
    world, periods = run("control_noise = { v_m_s = 0.05, w_rad_s = 0.5 }")
    meant = [(p.robots[0].control.left, p.robots[0].control.right) for p in periods]
    got = sent(periods)
    assert len(got) == 12
    assert all(one != other for one, other in zip(got, meant, strict=True))
    robot = world.networks[0].robots[0]
    assert (robot.counter(0), robot.counter(1)) == (12, 0)


def test_without_bounds_the_frames_carry_what_the_controller_said():
    for lines in ("", "control_noise = { v_m_s = 0.0, w_rad_s = 0.0 }"):
        _, periods = run(lines)
        assert sent(periods) == [(p.robots[0].control.left, p.robots[0].control.right) for p in periods]


def test_the_robot_drives_what_it_was_sent():
    quiet, noisy = run("")[1], run("control_noise = { w_rad_s = 4.0 }")[1]
    assert quiet[-1].robots[0].truth.theta_rad == pytest.approx(0.0, abs=1e-3)
    assert abs(noisy[-1].robots[0].truth.theta_rad) > 0.01
