"""The time base: ticks of the robot's 24 MHz crystal, periods that are whole numbers of them, conversions.

Every other module counts in ticks (`int`) and takes its periods from here or from its own data sheet; seconds
and nanoseconds appear only where people read or write them (scenario files, recordings, figures).
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

TICKS_PER_SECOND = 24_000_000
NS_PER_SECOND = 1_000_000_000

CYCLE_TICKS = 12
"""8051 machine cycle: 12 oscillator periods."""

LM629_CLOCK_TICKS = 4
"""LM629 at 6 MHz."""

LM629_SAMPLE_TICKS = 8192
"""LM629 sample interval: 2048 of its clocks (341.33 us)."""

PWM_PERIOD_TICKS = 2048
"""LM629 PWM period: 512 of its clocks (11.72 kHz)."""

HOST_BIT_TICKS = 2500
"""One UART bit of the PC at 9600 baud, in ticks."""

ROBOT_BIT_TICKS = 2496
"""One UART bit of the robot in ticks: Timer 2 reload 65536 - 78 (9615.38 baud, +0.16 %)."""

CHARACTER_BITS = 10
"""8N1: start bit, eight data bits, stop bit."""

HOST_CHARACTER_TICKS = CHARACTER_BITS * HOST_BIT_TICKS
"""One character of the PC: 1.0417 ms, in ticks."""

CAMERA_FRAME_TICKS = 800_800
"""NTSC frame, 30000/1001 Hz (33.37 ms)."""

CONTROL_PERIOD_TICKS = CAMERA_FRAME_TICKS
"""The host controls once per camera frame."""

NEVER_TICK = 1 << 62
"""Tick, or cycle, of an event that will not happen; no tick lies beyond it."""


def ticks(seconds: float | Fraction, crystal_hz: int = TICKS_PER_SECOND) -> int:
    """Seconds to ticks, rounded half up.

    A float means its printed decimal number (`repr`, the shortest one that reads back as the same float), so `0.001` is
    one millisecond exactly and not the binary fraction beside it; the product and the rounding are exact. Raises
    ValueError for NaN and infinities.
    """
    return (2 * exact(seconds) * crystal_hz + 1) // 2


def ms(time: float | Fraction, crystal_hz: int = TICKS_PER_SECOND) -> int:
    """Milliseconds to ticks, by the rule of `ticks`; a whole number of them is exact at 24 MHz (24 000 ticks)."""
    return ticks(exact(time) / 1000, crystal_hz)


def us(time: float | Fraction) -> int:
    """Microseconds to ticks, by the rule of `ticks`; a whole number of them is exact (24 ticks)."""
    return ticks(exact(time) / 1_000_000)


@lru_cache(typed=True)  # a float and a fraction of equal value are two numbers here
def exact(time: float | Fraction) -> Fraction:
    """A float as the decimal number that it prints as; any other number unchanged."""
    return Fraction(repr(time)) if isinstance(time, float) else Fraction(time)


def seconds(tick: int) -> float:
    """Ticks to seconds, the float nearest to the exact quotient."""
    return tick / TICKS_PER_SECOND


def nanoseconds(tick: int, crystal_hz: int = TICKS_PER_SECOND) -> int:
    """Ticks to whole nanoseconds, rounded down (one tick is 125/3 ns); the time stamp of recordings."""
    return tick * NS_PER_SECOND // crystal_hz
