"""The tables of the sensor against what they stand for: the normal distribution, the low-pass, the gamma curve."""

import cmath
import math
from statistics import NormalDist

import pytest

from miro_sim.pitch import sensor


def test_the_draws_of_noise_are_quantiles_of_a_standard_normal():
    normals = sensor._normals()
    expected = [NormalDist().inv_cdf((step + 0.5) / 4096) for step in range(4096)]
    assert [value / 65536 for value in sorted(normals)] == pytest.approx(expected, abs=1e-3)
    assert sum(normals) == 0


@pytest.mark.parametrize("bandwidth_hz", [0.25e6, 0.4e6, 0.6e6, 1.3e6])
def test_the_low_pass_lets_all_of_a_flat_colour_through_and_is_3_db_down_at_its_bandwidth(bandwidth_hz):
    taps = sensor._taps(bandwidth_hz)
    sides = [*reversed(taps[1:]), *taps]
    assert sum(sides) == 65536
    turn = 2 * math.pi * bandwidth_hz / sensor.PIXELS_PER_SECOND
    gain = abs(sum(tap * cmath.exp(1j * turn * place) for place, tap in enumerate(sides))) / 65536
    assert 20 * math.log10(gain) == pytest.approx(-3.01, abs=0.15)


def test_without_a_bandwidth_nothing_is_filtered():
    assert sensor._taps(0.0) == [65536]


def test_the_gamma_curve_goes_from_black_to_white():
    shown, _, _ = sensor._tables(0.45, 0.0, 0.0)
    assert (shown[0], shown[4095]) == (0, 4080)
    assert shown == sorted(shown)
    assert shown[2048] == math.floor(4080 * (2048 / 4095) ** 0.45 + 0.5)
