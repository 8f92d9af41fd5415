"""Where a servo stands, and how it gets there."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.servo import Servo
from tests.naive.parts import servo_angles
from tests.robot.parts.bench import Bench

MS = 12_000


def bench(crystal_hz=12_000_000, **keys):
    board = Bench({"neck": (Servo(**keys), {"pwm": "net"})}, ["net"], crystal_hz)
    board.drive("net", 0)
    board.run(1)
    return board


def pulses(board, us, count, frame_ms=20.0):
    """Frames with a pulse each; ends with the last frame."""
    for _ in range(count):
        begin = board.tick
        board.drive("net", 1)
        board.drive("net", 0, begin + int(us * 12))
        board.run(begin + int(frame_ms * MS))


@pytest.mark.parametrize(
    ("us", "degrees"),
    [
        (500, 0),
        (1000, 45),
        (1500, 90),
        (2000, 135),
        (2500, 180),
        (400, 0),
        (2900, 180),
        (299, 90),
        (3001, 90),
    ],
)
def test_the_pulse_says_the_angle(us, degrees):
    board = bench()
    pulses(board, us, 25)
    assert board.read("neck.angle_deg") == pytest.approx(degrees)
    assert board.read("neck.pulse_us") == us
    assert board.read("neck.frame_hz") == 50


def test_it_turns_as_fast_as_it_can_and_no_faster():
    board = bench(deg_per_s=500.0)
    pulses(board, 2500, 1)
    end_of_pulse = board.tick - 20 * MS + 2500 * 12
    assert board.read("neck.angle_deg") == pytest.approx(90 + 500 * (board.tick - end_of_pulse) / 12e6)
    assert board.read("neck.target_deg") == 180


def test_without_pulses_it_stops_after_50_ms():
    board = bench(deg_per_s=500.0)
    pulses(board, 2500, 1)
    board.run(500 * MS)
    assert board.read("neck.angle_deg") == pytest.approx(90 + 500 * 0.05)
    assert board.read("neck.frame_hz") == 0


def test_its_range_and_pulses_are_keys():
    board = bench(min_us=1000.0, max_us=2000.0, range_deg=90.0)
    pulses(board, 1250, 25)
    assert board.read("neck.angle_deg") == pytest.approx(22.5)
    with pytest.raises(ValueError, match="min_us 2000 is not below max_us 2000"):
        Servo(min_us=2000.0, max_us=2000.0)


def test_without_supply_it_stands_where_it_is():
    board = bench()
    pulses(board, 2500, 2)
    board.power(0)
    angle = board.read("neck.angle_deg")
    board.run(board.tick + 1000 * MS)
    board.power(1)
    assert board.read("neck.angle_deg") == angle


LEVELS = st.lists(
    st.tuples(
        st.integers(0, 1), st.sampled_from([1, 29, 30, 31, 50, 99, 151, 250, 300, 301, 2000, 5001, 9000])
    ),
    min_size=1,
    max_size=14,
)


@given(LEVELS, st.lists(st.integers(1, 9000), max_size=4), st.floats(1.0, 3000.0))
def test_it_is_its_slow_twin_however_often_somebody_looks(stretches, looks, deg_per_s):
    """At 100 kHz: 0.1 ticks a microsecond."""
    board = bench(100_000, deg_per_s=deg_per_s)
    quiet = bench(100_000, deg_per_s=deg_per_s)
    pin = [0]
    for level, ticks in stretches:
        board.drive("net", level, len(pin))
        quiet.drive("net", level, len(pin))
        for look in looks:
            board.run(min(len(pin) + ticks, max(board.tick, len(pin) + look)))
            board.read("neck.angle_deg")
            board.read("neck.frame_hz")
        pin += [level] * ticks
    board.run(len(pin) - 1)
    quiet.run(len(pin) - 1)
    assert board.save() == quiet.save()
    angle = servo_angles(pin, 0.1, deg_per_s / 100_000)[-1]
    assert board.read("neck.angle_deg") == pytest.approx(angle, abs=1e-6)
