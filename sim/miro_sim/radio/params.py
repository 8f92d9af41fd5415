"""What a radio band is like, in the units that the models count in: ticks and 2^-32.

What belongs here: the parameters, their ranges and their conversion from the units that people write.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Literal

import msgspec

from miro_sim import clock


def error_threshold(bit_error_rate: float) -> int:
    """A probability as the number of the 2^32 values of a draw that mean "error", rounded half up.

    The float stands for the decimal number that it prints as, as in `clock.ticks`. Raises ValueError
    outside 0 .. 1.
    """
    exact = Fraction(repr(bit_error_rate)) if isinstance(bit_error_rate, float) else Fraction(bit_error_rate)
    if not 0 <= exact <= 1:
        raise ValueError(f"bit_error_rate {bit_error_rate} is outside 0 .. 1")
    return (2 * exact * (1 << 32) + 1) // 2


class RadioParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One band of one network.

    latency_ticks    from the UART pin of the sender to that of the receiver
    error_threshold  a bit is wrong with this probability times 2^32
    carrier          "keyed": on for each transmission; "on": always, idle is mark
    keyup_ticks      a keyed carrier comes up (as mark) so long before the first start bit
    squelch          without a carrier the receiver puts out mark instead of its slicer's noise

    Raises ValueError naming the field.
    """

    latency_ticks: int = 0
    error_threshold: int = 0
    carrier: Literal["keyed", "on"] = "keyed"
    keyup_ticks: int = 24_000
    squelch: bool = False

    def __post_init__(self) -> None:
        for field in ("latency_ticks", "keyup_ticks"):
            if not 0 <= getattr(self, field) < clock.TICKS_PER_SECOND:
                raise ValueError(f"{field} {getattr(self, field)} is outside 0 .. one second")
        if not 0 <= self.error_threshold <= 1 << 32:
            raise ValueError(f"error_threshold {self.error_threshold} is outside 0 .. 2^32")
        if self.carrier not in ("keyed", "on"):
            raise ValueError(f"carrier {self.carrier!r} is neither 'keyed' nor 'on'")

    @classmethod
    def of(
        cls,
        *,
        latency_s: float = 0.0,
        bit_error_rate: float = 0.0,
        carrier: Literal["keyed", "on"] = "keyed",
        keyup_s: float = 0.001,
        squelch: bool = False,
    ) -> RadioParams:
        """The same from seconds and a probability."""
        return cls(
            latency_ticks=clock.ticks(latency_s),
            error_threshold=error_threshold(bit_error_rate),
            carrier=carrier,
            keyup_ticks=clock.ticks(keyup_s),
            squelch=squelch,
        )

    @classmethod
    def ideal(cls) -> RadioParams:
        """A wire: no latency, no errors, mark when nobody sends."""
        return cls(keyup_ticks=0, squelch=True)
