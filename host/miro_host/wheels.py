"""From (v, w) to what the radio carries: two wheel speeds in 1/256 count per LM629 sample.

Rounding rule: to the nearest integer, halves away from zero. It is odd, so that forward and backward, left
and right are mirror images. The speed limit comes first, so the greatest magnitude is 16633, the robot's
own limit.
"""

import msgspec

from miro_exact.clock import LM629_SAMPLE_TICKS, TICKS_PER_SECOND
from miro_exact.dmath import PI
from miro_exact.domain import DomainError

COUNTS_PER_WHEEL_TURN = 16384  # 512 lines x 4 edges x gear 8:1
UNITS_PER_COUNT = 256
_PER_TURN = UNITS_PER_COUNT * COUNTS_PER_WHEEL_TURN / (TICKS_PER_SECOND / LM629_SAMPLE_TICKS)
MIN_WORD_BITS = 5
MAX_WORD_BITS = 16


def nearest(x: float) -> int:
    """The integer nearest to x, halves away from zero. Exact: x minus its whole part is. DomainError unless finite."""
    if x - x != 0.0:
        raise DomainError(f"no integer is nearest to {x!r}")
    whole = int(x)
    rest = x - whole
    if rest >= 0.5:
        return whole + 1
    if rest <= -0.5:
        return whole - 1
    return whole


class Wheels(msgspec.Struct, frozen=True):
    """The host's parameters of the drive: track, nominal wheel radius, speed limit; and the length of its words.

    Words of fewer than 16 bits have the same full scale and coarser steps: multiples of 2^(16 - word_bits) units.
    """

    track_m: float = 0.068
    radius_m: float = 0.020
    limit_m_s: float = 1.46
    word_bits: int = MAX_WORD_BITS

    def __post_init__(self) -> None:
        for name in ("track_m", "radius_m", "limit_m_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be greater than 0")
        if not MIN_WORD_BITS <= self.word_bits <= MAX_WORD_BITS:
            raise ValueError(f"word_bits = {self.word_bits!r}: must be {MIN_WORD_BITS} to {MAX_WORD_BITS}")
        if self.counts(self.limit_m_s) > 32767:
            raise ValueError(f"limit_m_s = {self.limit_m_s!r}: does not fit int16 at this radius")

    @property
    def units_per_m_s(self) -> float:
        """1/256 count per sample in one m/s: 11392.75 for the default radius."""
        return _units_per_m_s(self.radius_m)

    def split(self, v_m_s: float, w_rad_s: float) -> tuple[float, float]:
        """(left, right) rim speeds in m/s of a body that moves with v and turns with w."""
        half = 0.5 * self.track_m * w_rad_s
        return v_m_s - half, v_m_s + half

    def counts(self, speed_m_s: float) -> int:
        """A rim speed in 1/256 count per sample, rounded half away from zero; in short words, to a multiple of a step.

        Of a short word's steps none beyond the speed limit is taken.
        """
        return _counts(speed_m_s, self.limit_m_s, self.units_per_m_s, self.word_bits)


def _units_per_m_s(radius_m: float) -> float:
    return _PER_TURN / (2.0 * PI * radius_m)


def _counts(speed_m_s: float, limit_m_s: float, units_per_m_s: float, word_bits: int) -> int:
    units = speed_m_s * units_per_m_s
    step = 1 << (MAX_WORD_BITS - word_bits)
    if step == 1:
        return nearest(units)
    most = int(limit_m_s * units_per_m_s / step)
    return step * max(-most, min(most, nearest(units / step)))


def wheel_command(
    wheels: Wheels, v_m_s: float, w_rad_s: float, left_factor: float = 1.0, right_factor: float = 1.0
) -> tuple[int, int]:
    """(left, right) for the team frame: split, corrected, limited, quantised.

    A wheel whose radius is the nominal one times a factor has to turn slower by that factor.
    """
    limit_m_s, half = wheels.limit_m_s, 0.5 * wheels.track_m * w_rad_s
    left, right = (v_m_s - half) / left_factor, (v_m_s + half) / right_factor
    greatest = max(abs(left), abs(right))
    if not greatest <= limit_m_s:  # one factor for both: the path keeps its curvature
        # The quotient first: the greater one becomes +-1 exactly, hence never above the limit.
        left, right = limit_m_s * (left / greatest), limit_m_s * (right / greatest)
    units, bits = _units_per_m_s(wheels.radius_m), wheels.word_bits
    return _counts(left, limit_m_s, units, bits), _counts(right, limit_m_s, units, bits)
