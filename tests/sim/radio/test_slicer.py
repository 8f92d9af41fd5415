"""The slicer: its threshold follows the mean, and what that costs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.mcs51.line import Line
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import SlicerParams, fsk_threshold, margin_table
from miro_sim.radio.slicer import Slicer
from tests.naive import radio as naive
from tests.sim.radio.noise import listen
from tests.sim.radio.radios import clean, signals_db, slicers
from tests.states import values

BIT = 2500
EB_N0_DB = 11.0
TYPICAL = SlicerParams(settle_s=0.004, offset=0.0)


@given(
    slicers, signals_db, st.lists(st.tuples(st.integers(0, 9000), st.sampled_from([-1, 0, 1])), max_size=40)
)
def test_threshold_and_chances_are_those_of_the_naive_twin(params, eb_n0_db, steps):
    slicer, twin = Slicer(params, eb_n0_db), naive.Slicer(params, eb_n0_db)
    tick = 0
    for step, signal in steps:
        tick += step
        slicer.hear(tick, signal)
        twin.hear(tick, signal)
        assert values(slicer) == {"tick": twin.tick, "signal": twin.signal, "mean": twin.mean}
        assert [slicer.threshold(level) for level in (0, 1)] == [twin.chance(level) for level in (0, 1)]


def fed(params, *signals):
    slicer = Slicer(params, EB_N0_DB)
    for number, signal in enumerate(signals):
        slicer.hear(number * BIT, signal)
    return slicer


def test_a_run_of_marks_makes_marks_dear_and_spaces_cheap():
    """38.4 bits are one time constant: 1 - 1/e of the way, in steps of a bit a little more."""
    slicer = fed(TYPICAL, *[1] * 39)
    assert slicer.mean / 65536 == pytest.approx(0.632, abs=0.01)
    assert slicer.threshold(0) < margin_table(EB_N0_DB)[256] < slicer.threshold(1)


def wrong_bits(preamble_characters, keyup_ticks=24_000, frames=200):
    """Wrong bits of 17 balanced characters after so many 55h, in frames on a carrier that is half a deviation off."""
    slicer = SlicerParams(settle_s=0.004, offset=-0.5)
    radio = clean(eb_n0_db=11.0, slicer=slicer)
    downlink, line = Downlink(radio, 5, "net"), Line()
    listener = downlink.listen(0, line)
    wrong = 0
    for number in range(frames):
        start = number * 2_000_000 + 100_000
        downlink.send(start, bytes([0x55]) * preamble_characters + bytes([0x99, 0x66] * 9)[:17])
        downlink.settle(start + 25_000 * preamble_characters)
        before = listener.bit_errors
        downlink.settle(start + 1_500_000)
        wrong += listener.bit_errors - before
        line.forget(start + 1_500_000)
    return wrong / (frames * 170)


def test_key_up_without_enough_preamble_costs_bits():
    """Radiometrix application note 3: 3 ms of 55h at least, 5 ms advised."""
    nominal = fsk_threshold(11.0) / 2**32
    none, three_ms, five_ms = (wrong_bits(count) for count in (0, 3, 5))
    assert none > 5 * nominal
    assert none > 3 * three_ms
    assert five_ms < three_ms < 2 * nominal


@pytest.mark.parametrize("robots", [3, 5])
def test_noise_alone_is_never_taken_for_a_frame_by_the_firmware(robots):
    """`python -m tests.sim.radio.noise` listens for minutes."""
    heard, counted = listen(10, robots)
    assert heard > 7000
    assert counted == (0, 0, 0)
