"""Parameters of a band: units in, ticks and thresholds out, errors by name."""

from fractions import Fraction

import pytest

from miro_sim.radio import RadioParams
from miro_sim.radio.probability import error_threshold


def test_units_become_ticks_and_a_threshold():
    params = RadioParams.of(latency_s=0.0005, bit_error_rate=1e-4, keyup_s=0.001, carrier="on")
    assert params == RadioParams(
        latency_ticks=12_000, error_threshold=429_497, keyup_ticks=24_000, carrier="on"
    )


RATES = [(0, 0), (1, 2**32), (0.5, 2**31), (Fraction(1, 2**33), 1), (1e-10, 0)]


@pytest.mark.parametrize(("rate", "threshold"), RATES)
def test_a_rate_becomes_the_nearest_threshold(rate, threshold):
    assert error_threshold(rate) == threshold


@pytest.mark.parametrize("rate", [-1e-9, 1.0001, float("nan")])
def test_a_rate_that_is_no_probability_is_refused(rate):
    with pytest.raises(ValueError, match=r"bit_error_rate|Fraction"):
        error_threshold(rate)


@pytest.mark.parametrize(
    ("field", "value"),
    [("latency_ticks", -1), ("keyup_ticks", 24_000_000), ("error_threshold", 2**32 + 1), ("carrier", "off")],
)
def test_a_parameter_outside_its_range_is_refused_by_name(field, value):
    with pytest.raises(ValueError, match=field):
        RadioParams(**{field: value})


def test_an_ideal_band_is_a_wire():
    ideal = RadioParams.ideal()
    assert (ideal.latency_ticks, ideal.error_threshold, ideal.keyup_ticks, ideal.squelch) == (0, 0, 0, True)
