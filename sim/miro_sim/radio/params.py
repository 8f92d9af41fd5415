"""The parameters of a radio band, in the units of the models: ticks and 2^-32."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal

import msgspec

from miro_exact import clock
from miro_sim.radio.probability import (
    ONE,
    error_threshold,
    fsk_threshold,
    margin_table,
    mean_threshold,
    rate_threshold,
    threshold,
)

MAX_OFFSET_PPM = 50_000
SLICER_ONE = 65_536
"""Half the distance of mark and space at the discriminator, in the units of the slicer's threshold."""


class ChainParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A two-state chain over bit times: `enter`, `leave` are the probabilities of a change, times 2^32.

    Raises ValueError unless each is in 0 .. 2^32 and both together are, which is what lets `chain` look
    any place up by itself.
    """

    enter: int
    leave: int

    def __post_init__(self) -> None:
        if self.enter < 0 or self.leave < 0 or self.enter + self.leave > ONE:
            raise ValueError(f"chances {self.enter} and {self.leave} of a change are not within 0 .. 2^32")

    @classmethod
    def of(cls, enter: float, leave: float) -> ChainParams:
        """From two probabilities a bit."""
        return cls(enter=threshold(enter), leave=threshold(leave))

    @classmethod
    def lasting(cls, every_s: float, length_s: float) -> ChainParams:
        """From the mean time between two events (end to start) and the mean length of one."""
        return cls(enter=mean_threshold(every_s), leave=mean_threshold(length_s))


class SlicerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An AC-coupled slicer.

    gain        part of the way to the input that the threshold goes in a bit time, times 2^16
    offset      input that stands for "no deviation" while there is a carrier, in 1/65536 of the deviation
    thresholds  chance of a wrong bit by margin, see `probability.margin_table`
    """

    gain: int
    offset: int
    thresholds: tuple[int, ...]

    def __post_init__(self) -> None:
        if not 0 < self.gain <= 1 << 16:
            raise ValueError(f"slicer gain {self.gain} is outside 1 .. 2^16")
        if abs(self.offset) > SLICER_ONE:
            raise ValueError(f"slicer offset {self.offset} is outside +-2^16")

    @classmethod
    def of(cls, *, settle_s: float, offset: float, eb_n0_db: float) -> SlicerParams:
        """From the time constant, the offset in units of the deviation, and the signal-to-noise ratio."""
        settle_ticks = clock.ticks(settle_s)
        if settle_ticks < clock.HOST_BIT_TICKS:
            raise ValueError(f"settle_s {settle_s} is shorter than a bit (1/9600 s)")
        exact = Fraction(repr(float(offset)))
        return cls(
            gain=((clock.HOST_BIT_TICKS << 17) // settle_ticks + 1) // 2,
            offset=(2 * exact * SLICER_ONE + 1) // 2,
            thresholds=margin_table(eb_n0_db),
        )


class RadioParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One band of one network. What is 0 or None is off.

    latency_ticks          from the UART pin of the sender to that of the receiver
    jitter_ticks           a transmission is late by 0 to so much on top
    error_threshold        a bit is wrong with this probability times 2^32
    carrier                "keyed": on for each transmission; "on": always, idle is mark
    keyup_ticks            a keyed carrier comes up (as mark) so long before the first start bit
    squelch                without a carrier the receiver puts out mark instead of its slicer's noise
    baud_offset_ppm        the PC's UART is so much faster than 9600 baud
    crystal_offset_ppm     the robots' crystals are so much faster than 24 MHz
    bursts                 Gilbert-Elliott: times of many errors, `burst_threshold`
    dropouts               times without a carrier
    slicer                 a slicer whose threshold follows the signal
    false_start_threshold  a bit time of idle carrier is a space
    lost_threshold         a character never gets to the robot's UART
    lost_frame_threshold   a transmission never goes on the air

    Raises ValueError naming the field.
    """

    latency_ticks: int = 0
    jitter_ticks: int = 0
    error_threshold: int = 0
    carrier: Literal["keyed", "on"] = "keyed"
    keyup_ticks: int = 24_000
    squelch: bool = False
    baud_offset_ppm: int = 0
    crystal_offset_ppm: int = 0
    bursts: ChainParams | None = None
    burst_threshold: int = ONE // 2
    dropouts: ChainParams | None = None
    slicer: SlicerParams | None = None
    false_start_threshold: int = 0
    lost_threshold: int = 0
    lost_frame_threshold: int = 0

    def __post_init__(self) -> None:
        for field in ("latency_ticks", "jitter_ticks", "keyup_ticks"):
            if not 0 <= getattr(self, field) < clock.TICKS_PER_SECOND:
                raise ValueError(f"{field} {getattr(self, field)} is outside 0 .. one second")
        for field in (
            *("error_threshold", "burst_threshold", "false_start_threshold"),
            *("lost_threshold", "lost_frame_threshold"),
        ):
            if not 0 <= getattr(self, field) <= ONE:
                raise ValueError(f"{field} {getattr(self, field)} is outside 0 .. 2^32")
        for field in ("baud_offset_ppm", "crystal_offset_ppm"):
            if abs(getattr(self, field)) > MAX_OFFSET_PPM:
                raise ValueError(f"{field} {getattr(self, field)} is outside +-{MAX_OFFSET_PPM}")
        if self.carrier not in ("keyed", "on"):
            raise ValueError(f"carrier {self.carrier!r} is neither 'keyed' nor 'on'")

    @property
    def bit_ticks(self) -> Fraction:
        """One bit of the PC on a robot's clock: both offsets are one ratio, since that clock is the tick."""
        return bit_ticks(self.baud_offset_ppm, self.crystal_offset_ppm)

    @classmethod
    def of(
        cls,
        *,
        latency_s: float = 0.0,
        jitter_s: float = 0.0,
        bit_error_rate: float | None = None,
        eb_n0_db: float | None = None,
        carrier: Literal["keyed", "on"] = "keyed",
        keyup_s: float = 0.001,
        squelch: bool = False,
        baud_offset_ppm: int = 0,
        crystal_offset_ppm: int = 0,
        bursts: ChainParams | None = None,
        burst_error_rate: float = 0.5,
        dropouts: ChainParams | None = None,
        slicer: SlicerParams | None = None,
        false_starts_hz: float = 0.0,
        lost_character_rate: float = 0.0,
        lost_frames: float = 0.0,
    ) -> RadioParams:
        """The same from seconds and probabilities; the errors from a rate (default 0) or from Eb/N0.

        Raises ValueError for both at once.
        """
        if bit_error_rate is not None and eb_n0_db is not None:
            raise ValueError("bit_error_rate and eb_n0_db set the same; give one of the two")
        errors = error_threshold(bit_error_rate or 0.0) if eb_n0_db is None else fsk_threshold(eb_n0_db)
        return cls(
            latency_ticks=clock.ticks(latency_s),
            jitter_ticks=clock.ticks(jitter_s),
            error_threshold=errors,
            carrier=carrier,
            keyup_ticks=clock.ticks(keyup_s),
            squelch=squelch,
            baud_offset_ppm=baud_offset_ppm,
            crystal_offset_ppm=crystal_offset_ppm,
            bursts=bursts,
            burst_threshold=error_threshold(burst_error_rate),
            dropouts=dropouts,
            slicer=slicer,
            false_start_threshold=rate_threshold(false_starts_hz),
            lost_threshold=threshold(lost_character_rate, "lost_character_rate"),
            lost_frame_threshold=threshold(lost_frames, "lost_frames"),
        )

    @classmethod
    def ideal(cls) -> RadioParams:
        """An ideal link: no latency, no errors, mark level while idle."""
        return cls(keyup_ticks=0, squelch=True)


def bit_ticks(baud_offset_ppm: int, crystal_offset_ppm: int) -> Fraction:
    """The time of a bit sent at 9600 (1 + baud offset) baud on a clock of 24 MHz (1 + crystal offset)."""
    return Fraction(clock.HOST_BIT_TICKS * (1_000_000 + crystal_offset_ppm), 1_000_000 + baud_offset_ppm)
