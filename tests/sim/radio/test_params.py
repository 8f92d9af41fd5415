"""Parameters of a band: units in, ticks and thresholds out; the formula of non-coherent FSK beside mpmath."""

from fractions import Fraction

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_sim.radio.params import ONE, Dropouts, Radio, fsk_threshold, margin_table, threshold


def test_units_become_ticks_and_a_threshold():
    radio = Radio(latency_s=0.0005, bit_error_rate=1e-4, keyup_s=0.001)
    assert (radio.latency_ticks, radio.error_threshold, radio.keyup_ticks) == (12_000, 429_497, 24_000)


RATES = [(0, 0), (1, 2**32), (0.5, 2**31), (Fraction(1, 2**33), 1), (1e-10, 0)]


@pytest.mark.parametrize(("rate", "nearest"), RATES)
def test_a_rate_becomes_the_nearest_threshold(rate, nearest):
    assert threshold(rate) == nearest


@pytest.mark.parametrize("rate", [-1e-9, 1.0001, float("nan")])
def test_a_rate_that_is_no_probability_is_refused(rate):
    with pytest.raises(ValueError, match=r"outside 0 .. 1|Fraction"):
        threshold(rate)


def ber(eb_n0_db, margin=1):
    with mpmath.workprec(120):
        return mpmath.exp(-(mpmath.mpf(10) ** (mpmath.mpf(eb_n0_db) / 10)) * mpmath.mpf(margin) ** 2 / 2) / 2


@given(st.floats(-20, 60))
def test_a_signal_to_noise_ratio_becomes_the_nearest_threshold(eb_n0_db):
    assert abs(fsk_threshold(eb_n0_db) - ber(eb_n0_db) * ONE) <= mpmath.mpf("0.50001")


@pytest.mark.parametrize(("eb_n0_db", "rate"), [(8.93, 1e-2), (10.94, 1e-3), (12.31, 1e-4), (13.35, 1e-5)])
def test_the_figures_of_the_radio_literature_come_out(eb_n0_db, rate):
    assert fsk_threshold(eb_n0_db) / ONE == pytest.approx(rate, rel=0.02)


def test_without_a_signal_half_of_the_bits_are_wrong():
    assert fsk_threshold(-300.0) == ONE // 2


@given(st.floats(-20, 60), st.integers(0, 512))
def test_a_margin_has_the_errors_of_a_signal_of_that_amplitude(eb_n0_db, index):
    margin = (index - 128) / 128
    wrong = ber(eb_n0_db, margin)
    expected = wrong if margin >= 0 else 1 - wrong
    assert abs(margin_table(eb_n0_db)[index] - expected * ONE) <= mpmath.mpf("0.50001")


def test_a_margin_of_one_is_no_penalty():
    assert margin_table(11.0)[256] == fsk_threshold(11.0)


def test_times_become_chances_a_bit():
    assert [Radio(false_starts_hz=hz).false_start_threshold for hz in (0.0, 9600.0)] == [0, ONE]
    assert Dropouts(every_s=2.0, length_s=0.02).chances() == (round(ONE / 19_200), round(ONE / 192))
