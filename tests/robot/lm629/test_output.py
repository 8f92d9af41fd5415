"""The digital filter by rules F1 to F6 and against its slow twin, and the PWM stage: real edges, loaded at the sample,
phase from the end of reset.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK
from miro_robot.lm629.chip import PWM_TICKS, SAMPLE_TICKS, Lm629
from miro_robot.lm629.pid import Pid
from tests.example_count import examples
from tests.naive.lm629 import NaivePid
from tests.robot.lm629.bench import Bench


def test_four_pulses_a_sample_of_16_ticks_a_step_from_the_start_of_the_period():
    bench = Bench.running()
    bench.closed(-26, kp=10)
    start = bench.tick
    bench.edges.clear()
    bench.wait(SAMPLE_TICKS - 1)
    expected = []
    for period in range(4):
        at = start + period * PWM_TICKS
        expected += [(at, 1, 1, 0), (at + 32, 0, 1, 0)]
    assert [(start, 1, 1, 0), *bench.edges] == expected


def test_full_drive_is_127_of_128():
    bench = Bench.running()
    bench.closed(4000, kp=10)
    start = bench.tick
    bench.edges.clear()
    bench.wait(PWM_TICKS)
    assert bench.edges == [(start + 2032, 0, 0, 0), (start + 2048, 1, 0, 0)]


def test_without_drive_only_samples_are_events():
    bench = Bench.running()
    bench.closed(0, kp=10)
    assert bench.chip.next_tick == bench.chip.sample_tick == bench.tick + SAMPLE_TICKS
    seen = len(bench.edges)
    bench.sample(20)
    assert len(bench.edges) == seen


def test_the_drive_changes_at_the_sample_only():
    bench = Bench.running()
    bench.closed(0, kp=10)
    bench.wait(3000)
    bench.chip.trajectory.position = 100 * 65536
    bench.wait(SAMPLE_TICKS - 3001)
    assert bench.chip.pwm_magnitude == 0
    bench.wait(1)
    assert (bench.chip.pwm_magnitude, bench.chip.pwm) == (3, 1)


def test_samples_and_periods_count_from_the_end_of_reset():
    for release in (1000, 1001, 1004):
        chip = Lm629()
        assert chip.next_tick == NEVER_TICK
        chip.set_reset(900, 0)
        chip.set_reset(release, 1)
        end = -(-release // 4) * 4 + 6144 * 4
        assert chip.next_tick == end
        chip.advance(end)
        assert chip.next_tick == end + SAMPLE_TICKS
        assert chip.hi == 1


def test_reset_ends_a_pulse_at_once():
    for software in (False, True):
        bench = Bench.running()
        bench.closed(4000, kp=10)
        assert bench.chip.pwm == 1
        if software:
            bench.command("RESET")
            assert bench.chip.next_tick > bench.tick + 2 * SAMPLE_TICKS
        else:
            bench.chip.set_reset(bench.tick, 0)
            assert bench.chip.next_tick == NEVER_TICK
        assert (bench.chip.pwm, bench.chip.sign, bench.chip.pwm_magnitude, bench.chip.hi) == (0, 0, 0, 0)


def loop(kp=0, ki=0, kd=0, il=0, ds=0, saturates=True):
    pid = Pid(saturates)
    pid.load(kp, ki, kd, il, ds)
    return pid


@pytest.mark.parametrize(
    ("error", "drive", "sign", "magnitude"),
    [
        (25, 250, 0, 0),
        (26, 260, 0, 1),
        (-1, -10, 1, 1),
        (-26, -260, 1, 2),
        (3276, 32760, 0, 127),
        (3277, 32767, 0, 127),
        (-3277, -32768, 1, 127),
        (40000, 32767, 0, 127),
    ],
)
def test_proportional_term_and_output_stage(error, drive, sign, magnitude):
    assert loop(kp=10).step(error) == drive
    bench = Bench.running()
    bench.closed(error, kp=10)
    assert (bench.chip.sign, bench.chip.pwm_magnitude) == (sign, magnitude)


def test_all_terms_together():
    pid = loop(kp=20, ki=4, kd=100, il=500, ds=1)
    errors = [5, 12, 20, 25, 25, 20, 10, 0, -5, -5]
    drives = [pid.step(e) for e in errors]
    assert drives == [600, 740, 1900, 2000, 1000, 900, -1300, -1500, -1600, -1600]


def error_after_a_jam(saturates):
    """Counts that the motor is behind its desired position, a second after something held it for 0.1 s.

    A motor of first order with the robot's filter, at two thirds of its top speed.
    """
    pid = loop(kp=400, ki=40, kd=3000, il=2000, ds=3, saturates=saturates)
    desired = real = speed = 0.0
    for sample in range(3600):
        held = 300 <= sample < 600
        drive = pid.step(int(desired) - int(real))
        speed = 0.0 if held else speed + (6.0 * drive / 32768 - speed) / 60
        desired += 4.0 if sample > 60 else sample / 15
        real += speed
    return int(desired - real)


def test_a_motor_that_was_held_catches_up_with_its_desired_position():
    """SNVS781C p. 10 says so; with products that wrap (p. 12) it stays behind."""
    assert abs(error_after_a_jam(saturates=True)) < 100
    assert error_after_a_jam(saturates=False) > 1000


COEFFICIENT = st.integers(0, 300) | st.integers(0, 0x7FFF)


@examples(300)
@given(
    coefficients=st.tuples(COEFFICIENT, COEFFICIENT, COEFFICIENT, COEFFICIENT, st.integers(0, 5)),
    saturates=st.booleans(),
    wound_up=st.integers(-(2**23), 2**23 - 1),
    errors=st.lists(st.integers(-500, 500) | st.integers(-(2**30), 2**30 - 1), max_size=60),
)
def test_any_errors_give_the_drive_of_the_slow_twin(coefficients, saturates, wound_up, errors):
    ours, theirs = Pid(saturates), NaivePid(saturates)
    ours.load(*coefficients)
    theirs.load(*coefficients)
    ours.error_sum = theirs.sum = wound_up
    for error in errors:
        assert ours.step(error) == theirs.step(error)
        assert (ours.integral, ours.error_sum) == (theirs.integral, theirs.sum)
