"""The digital filter: vectors calculated by hand (rules F1 to F6), and random errors against the slow twin."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.lm629.pid import Pid
from tests.example_count import examples
from tests.naive.lm629 import NaivePid
from tests.robot.lm629.bench import Bench


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
    bench.filter(kp=10)
    bench.load(0x0200)  # close the loop where it stands
    bench.command("STT")
    bench.sample()
    bench.chip.trajectory.position = error * 65536
    bench.sample()
    assert (bench.chip.sign, bench.chip.pwm_magnitude) == (sign, magnitude)


def test_integral_term_takes_the_top_16_bits_of_the_sum():
    pid = loop(ki=256, il=1000)
    terms = []
    for _ in range(8):
        pid.step(100)
        terms.append(pid.integral)
    assert terms == [0, 0, 256, 256, 256, 512, 512, 768]


def test_integral_of_a_negative_sum_is_rounded_down():
    pid = loop(ki=4, il=0x7FFF)
    assert [pid.step(e) for e in [300] * 4 + [-300] * 6] == [4, 8, 12, 16, 12, 8, 4, 0, -8, -12]


def test_derivative_term_is_taken_every_third_sample_and_held():
    pid = loop(kd=100, ds=2)
    errors = [0, 10, 20, 30, 40, 40, 40, 40, 40, 40]
    assert [pid.step(e) for e in errors] == [0, 0, 0, 3000, 3000, 3000, 1000, 1000, 1000, 0]


def test_all_terms_together():
    pid = loop(kp=20, ki=4, kd=100, il=500, ds=1)
    errors = [5, 12, 20, 25, 25, 20, 10, 0, -5, -5]
    drives = [pid.step(e) for e in errors]
    assert drives == [600, 740, 1900, 2000, 1000, 900, -1300, -1500, -1600, -1600]


def test_a_zero_limit_removes_the_integral_term():
    pid = loop(ki=0x7FFF)
    assert [pid.step(30000) for _ in range(5)] == [0] * 5


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
