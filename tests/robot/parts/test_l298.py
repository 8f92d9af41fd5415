"""What an L298 does with its outputs, and what it says of its PWM."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.l298 import L298, Forward, L293d
from tests.naive.parts import pwm
from tests.robot.parts.bench import Bench

PINS = ("ena", "in1", "in2", "enb", "in3", "in4", "out1", "out2", "out3", "out4")
MS = 12_000


def bench(keys=None, pins=PINS, crystal_hz=12_000_000):
    inputs = [pin for pin in pins if not pin.startswith("out")]
    board = Bench({"bridge": (keys or L298(), {pin: pin for pin in pins})}, inputs, crystal_hz)
    for pin in inputs:
        board.drive(pin, 0)
    board.run(1)
    return board


@pytest.mark.parametrize("keys", [L298(), L293d()])
@pytest.mark.parametrize(
    ("inputs", "outputs", "mode"),
    [
        ((0, 0, 0), (None, None), "coast"),
        ((0, 1, 0), (None, None), "coast"),
        ((1, 0, 0), (0, 0), "brake"),
        ((1, 1, 1), (1, 1), "brake"),
        ((1, 1, 0), (1, 0), "forward"),
        ((1, 0, 1), (0, 1), "backward"),
    ],
)
def test_each_channel_follows_the_table(keys, inputs, outputs, mode):
    board = bench(keys)
    for pins, outs, channel in ((PINS[:3], PINS[6:8], "a"), (PINS[3:6], PINS[8:], "b")):
        for pin, level in zip(pins, inputs, strict=True):
            board.drive(pin, level)
        assert tuple(map(board.driven, outs)) == outputs
        assert board.read(f"bridge.{channel}.mode") == mode


def test_the_board_says_which_input_drives_forward():
    board = bench(L298(forward=Forward(a="in2", b="in4")))
    for pin in ("ena", "in2", "enb", "in3"):
        board.drive(pin, 1)
    assert (board.read("bridge.a.mode"), board.read("bridge.b.mode")) == ("forward", "backward")


def test_enables_that_are_not_connected_are_on_as_with_their_jumpers():
    board = bench(pins=("in1", "in2", "out1", "out2"))
    assert board.read("bridge.a.mode") == "brake"


def test_without_supply_it_lets_go():
    board = bench()
    board.drive("ena", 1)
    board.drive("in1", 1)
    board.power(0)
    assert (board.read("bridge.a.mode"), board.read("bridge.a.duty")) == ("coast", 0)
    board.drive("in2", 1)
    assert board.driven("out1") is board.driven("out2") is None
    board.power(1)
    assert board.read("bridge.a.mode") == "brake"


def run_pwm(board, pin, period, high, count):
    for _ in range(count):
        begin = board.tick
        board.drive(pin, 1)
        board.drive(pin, 0, begin + high)
        board.run(begin + period)


@pytest.mark.parametrize("hz", [92, 1000, 20_000])
def test_its_duty_is_that_of_the_last_period_on_the_enable_or_on_an_input(hz):
    period = 12_000_000 // hz
    board = bench()
    board.drive("in2", 1)
    run_pwm(board, "ena", period, period // 4, 4)
    board.run(board.tick + 1)
    assert board.read("bridge.a.duty") == pytest.approx(-0.25, abs=1e-4)
    assert board.read("bridge.a.frequency_hz") == pytest.approx(hz, rel=1e-3)
    board.drive("enb", 1)
    run_pwm(board, "in3", period, period // 2, 4)
    assert board.read("bridge.b.duty") == pytest.approx(0.5, abs=1e-4)


def test_driving_both_ways_in_turn_has_the_duty_of_the_difference():
    board = bench()
    board.drive("ena", 1)
    for _ in range(4):
        board.drive("in2", 0)
        board.drive("in1", 1)
        board.run(board.tick + 7000)
        board.drive("in1", 0)
        board.drive("in2", 1)
        board.run(board.tick + 3000)
    assert board.read("bridge.a.duty") == pytest.approx(0.4)
    assert board.read("bridge.a.frequency_hz") == 1200


def test_a_level_is_constant_two_periods_after_the_last_edge():
    board = bench()
    board.drive("in1", 1)
    run_pwm(board, "ena", 10 * MS, 5 * MS, 4)
    last = board.tick - 5 * MS
    board.run(last + 20 * MS)
    assert board.read("bridge.a.duty") == 0.5
    board.run(last + 20 * MS + 1)
    assert (board.read("bridge.a.duty"), board.read("bridge.a.frequency_hz")) == (0.0, 0.0)


def test_a_level_without_pwm_before_is_constant_after_still_ms():
    board = bench(L298(still_ms=30.0))
    board.drive("in1", 1)
    board.drive("ena", 1, 100)
    board.run(100 + 30 * MS)
    assert (board.read("bridge.a.duty"), board.read("bridge.a.mode")) == (0.0, "forward")
    board.run(101 + 30 * MS)
    assert board.read("bridge.a.duty") == 1.0


STRETCHES = st.lists(
    st.tuples(st.sampled_from([(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 0, 1), (1, 1, 1)]), st.integers(1, 30)),
    min_size=1,
    max_size=12,
)


@given(STRETCHES, st.lists(st.integers(1, 30), max_size=3))
def test_it_is_its_slow_twin_however_often_somebody_looks(stretches, looks):
    """At 100 kHz a level is constant after 40 ticks."""
    board = bench(L298(still_ms=0.4), crystal_hz=100_000)
    quiet = bench(L298(still_ms=0.4), crystal_hz=100_000)
    directions = [0]
    for (enable, one, two), ticks in stretches:
        begin = len(directions)
        levels = {"in1": one, "in2": two, "ena": enable}
        board.drive_all(levels, begin)
        quiet.drive_all(levels, begin)
        for look in looks:
            board.run(max(board.tick, min(begin + ticks, begin + look)))
            board.read("bridge.a.duty")
        directions += [enable * (one - two)] * ticks
    board.run(len(directions))
    quiet.run(len(directions))
    assert board.save() == quiet.save()
    duty, period = pwm(directions, 40)
    assert board.read("bridge.a.duty") == pytest.approx(duty)
    assert board.read("bridge.a.frequency_hz") == pytest.approx(100_000 / period if period else 0.0)
