"""Parameters of a band: units in, ticks and thresholds out, errors by name."""

from fractions import Fraction

import pytest

from miro_sim.radio.params import Bursts, Dropouts, Radio, SlicerParams
from miro_sim.radio.probability import error_threshold


def test_units_become_ticks_and_a_threshold():
    radio = Radio(latency_s=0.0005, bit_error_rate=1e-4, keyup_s=0.001)
    assert (radio.latency_ticks, radio.error_threshold, radio.keyup_ticks) == (12_000, 429_497, 24_000)


RATES = [(0, 0), (1, 2**32), (0.5, 2**31), (Fraction(1, 2**33), 1), (1e-10, 0)]


@pytest.mark.parametrize(("rate", "threshold"), RATES)
def test_a_rate_becomes_the_nearest_threshold(rate, threshold):
    assert error_threshold(rate) == threshold


@pytest.mark.parametrize("rate", [-1e-9, 1.0001, float("nan")])
def test_a_rate_that_is_no_probability_is_refused(rate):
    with pytest.raises(ValueError, match=r"bit_error_rate|Fraction"):
        error_threshold(rate)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Radio(latency_s=-1e-9), "latency_s must be 0 to 0.03, got -1e-09"),
        (lambda: Radio(keyup_s=1.0), "keyup_s must be 0 to 0.03"),
        (lambda: Radio(bit_error_rate=float("nan")), "bit_error_rate must be 0 to 0.5, got nan"),
        (lambda: Radio(bit_error_rate=0.0, eb_n0_db=10.0), "eb_n0_db: sets the same as bit_error_rate"),
        (lambda: Radio(slicer=SlicerParams()), "slicer: its bit errors follow from Eb/N0"),
        (lambda: Radio(lost_character_rate=1.5), "lost_character_rate must be 0 to 1"),
        (
            lambda: Bursts(good_to_bad=1.0, bad_to_good=1e-9),
            "bad_to_good: 1e-09 and good_to_bad 1.0 make more",
        ),
        (lambda: Bursts(good_to_bad=-1e-9, bad_to_good=0.5), "good_to_bad must be 0 to 1"),
        (lambda: Dropouts(every_s=0.00012, length_s=0.00012), "too short together"),
        (lambda: SlicerParams(settle_s=0.0001), "settle_s must be 0.000105 to 1"),
        (lambda: SlicerParams(offset=1.1), "offset must be -1 to 1"),
    ],
)
def test_a_parameter_outside_its_range_is_refused_by_name(make, text):
    with pytest.raises(ValueError, match=text):
        make()


def test_an_ideal_band_is_a_wire():
    ideal = Radio.ideal()
    assert (ideal.latency_ticks, ideal.error_threshold, ideal.keyup_ticks, ideal.squelch) == (0, 0, 0, True)
