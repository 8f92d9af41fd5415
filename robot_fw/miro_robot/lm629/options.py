"""What the documents leave open and a user may want to turn: one named field per rule.

Rules with a single sensible reading are not here; README.md in this folder lists them all.
"""

from __future__ import annotations

from typing import Literal

import msgspec

TICKS_PER_CLOCK = 4
"""24 MHz ticks in one period of the chip's 6 MHz clock."""


class Lm629Options(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Readings of the undocumented corners. Lengths are in chip clocks.

    Raises ValueError when a length is out of range.
    """

    busy_clocks: int = 160
    """B1: how long the busy bit stays after a command byte or the second byte of a data word."""

    reset_clocks: int = 6144
    """R1, R2: from the end of the reset pulse (or the RESET command) to status 84h."""

    reset_pulse_clocks: int = 8
    """R7: a shorter low on /RST leaves the chip stuck at status 00h."""

    filter_clocks: int = 8
    """X2: equal samples that make a new level of A/B or /IN count; 0 lets every edge through at once."""

    pid_saturates: bool = True
    """F1: products and their sum stop at +-full scale; False keeps their bottom 16 bits, as printed."""

    sum_reading: Literal["term", "sum"] = "term"
    """F2: RDSUM answers the limited product ki * sum, or the limited top 16 bits of the sum itself."""

    relative_base: Literal["target", "desired", "real"] = "target"
    """T6: what a relative position adds to; `target` means the desired position while in velocity mode."""

    def __post_init__(self) -> None:
        for name, least, most in (
            ("busy_clocks", 0, 1 << 20),
            ("reset_clocks", 1, 1 << 20),
            ("reset_pulse_clocks", 0, 1 << 20),
            ("filter_clocks", 0, 1024),
        ):
            value = getattr(self, name)
            if not least <= value <= most:
                raise ValueError(f"{name} must be {least}..{most} clocks, not {value}")
        for name, choices in (
            ("sum_reading", ("term", "sum")),
            ("relative_base", ("target", "desired", "real")),
        ):
            if getattr(self, name) not in choices:
                raise ValueError(f"{name} must be one of {', '.join(choices)}, not {getattr(self, name)!r}")


DEFAULT_OPTIONS = Lm629Options()
