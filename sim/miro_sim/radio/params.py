"""The parameters of a radio network: the keys of a scenario's `[network.radio]`, and the ticks and chances computed
from them.

Chances are thresholds of a 32-bit draw: a probability times 2^32. Bit errors are those of non-coherent FSK.
"""

from fractions import Fraction
from typing import Annotated, Literal

import msgspec

from miro_exact import clock
from miro_sim.ranges import Ranged, Within

LinkState = Literal["up", "down", "noise"]
UP, DOWN, NOISE = 0, 1, 2
RXD_STATES = ("ok", "inverted", "0", "1")
"""The wire from a robot's radio to its RXD, a fault: whole, inverted, at one level."""
LINK_STATES: tuple[LinkState, ...] = ("up", "down", "noise")
"""Names, in the order of the numbers: whether the radio of a network works.

up      as the parameters say
down    the transmitters are off: receivers hear no carrier, which is mark if squelched, else noise
noise   a stronger transmitter sends noise: receivers hear a fair random bit in each bit time, squelched or not
"""

ONE = 1 << 32
"""The threshold that every draw is below."""
LN10_TENTH = 0.23025850929940458
MARGIN_STEPS = 128
"""Entries of `margin_table` in a margin of 1."""
BIT_S = Fraction(clock.HOST_BIT_TICKS, clock.TICKS_PER_SECOND)
BIT_ERROR_RATE = 1e-4
"""Bit-error rate if a scenario gives neither that nor Eb/N0."""
SLICER_ONE = 65_536
"""Half the distance of mark and space at the discriminator, in the units of the slicer's threshold."""

ProfileName = Annotated[str, msgspec.Meta(max_length=40)]
Delay = Annotated[float, Within(0.0, 0.030)]
Chance = Annotated[float, Within(0.0, 1.0)]
ErrorRate = Annotated[float, Within(0.0, 0.5)]
Mean = Annotated[float, Within(0.000105, 1e6)]
Offset = Annotated[int, Within(-50_000, 50_000)]


class Bursts(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Gilbert-Elliott: chances a bit time of going bad and good again, and the error rate while it is bad."""

    good_to_bad: Chance
    bad_to_good: Chance
    bit_error_rate: ErrorRate = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.good_to_bad + self.bad_to_good > 1.0:
            raise ValueError(
                f"bad_to_good: {self.bad_to_good} and good_to_bad {self.good_to_bad} make more than 1;"
                " a state must last a bit on average"
            )

    def chances(self) -> tuple[int, int]:
        """Chances of going bad and of going good in a bit time."""
        return threshold(self.good_to_bad), threshold(self.bad_to_good)


class Dropouts(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Times without a carrier: mean time from the end of one to the next, and mean length."""

    every_s: Mean
    length_s: Mean

    def __post_init__(self) -> None:
        super().__post_init__()
        if BIT_S / self.every_s + BIT_S / self.length_s >= 1.0:
            raise ValueError(
                f"every_s: {self.every_s} and length_s {self.length_s} are too short together;"
                f" one of them must last more than a bit ({float(BIT_S):.6f} s)"
            )

    def chances(self) -> tuple[int, int]:
        """Chances of losing the carrier and of its return in a bit time."""
        return threshold(BIT_S / clock.exact(self.every_s)), threshold(BIT_S / clock.exact(self.length_s))


class SlicerParams(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An AC-coupled slicer: its time constant, and the offset of the carriers in units of the deviation."""

    settle_s: Annotated[float, Within(0.000105, 1.0)] = 0.004
    offset: Annotated[float, Within(-1.0, 1.0)] = 0.0

    @property
    def gain(self) -> int:
        """Part of the way to the input that the threshold goes in a bit time, times 2^16."""
        return ((clock.HOST_BIT_TICKS << 17) // clock.ticks(self.settle_s) + 1) // 2

    @property
    def offset_units(self) -> int:
        """Input that stands for "no deviation" while there is a carrier, in 1/65536 of the deviation."""
        return (2 * Fraction(repr(float(self.offset))) * SLICER_ONE + 1) // 2


class Radio(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One radio network: 9600 baud down to the robots and, with `telemetry`, a second band up.

    `carrier` keyed is a transmitter that is on per frame only, `keyup_s` before its first start bit; between frames the
    receiver's slicer makes noise, unless `squelch` holds it at mark. Errors come from `bit_error_rate` or from
    `eb_n0_db`, not both. Networks with the same `channel` receive each other; a network without a channel is isolated.
    A transmission down is late by up to `jitter_s`. `lost_frames`: chance that it never goes on the air;
    `lost_character_rate`: that a character never gets to the robot's UART. `profile` names sets of these keys, see
    `profiles`; keys that are given win.
    """

    profile: ProfileName | tuple[ProfileName, ...] = ()
    latency_s: Delay = 0.0
    jitter_s: Delay = 0.0
    bit_error_rate: Annotated[float | None, Within(0.0, 0.5)] = None
    eb_n0_db: Annotated[float | None, Within(-20.0, 60.0)] = None
    carrier: Literal["keyed", "on"] = "keyed"
    keyup_s: Delay = 0.001
    squelch: bool = False
    telemetry: bool = True
    channel: Annotated[int | None, Within(0, 999)] = None
    baud_offset_ppm: Offset = 0
    crystal_offset_ppm: Offset = 0
    false_starts_hz: Annotated[float, Within(0.0, 9600.0)] = 0.0
    lost_character_rate: Chance = 0.0
    lost_frames: Chance = 0.0
    bursts: Bursts | None = None
    dropouts: Dropouts | None = None
    slicer: SlicerParams | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.eb_n0_db is None:
            if self.slicer is not None:
                raise ValueError(
                    "slicer: its bit errors follow from Eb/N0; give eb_n0_db, not bit_error_rate"
                )
            if self.bit_error_rate is None:
                msgspec.structs.force_setattr(self, "bit_error_rate", BIT_ERROR_RATE)
        elif self.bit_error_rate is not None:
            raise ValueError("eb_n0_db: sets the same as bit_error_rate; give one of the two")

    @property
    def latency_ticks(self) -> int:
        """From the UART pin of the sender to that of the receiver."""
        return clock.ticks(self.latency_s)

    @property
    def keyup_ticks(self) -> int:
        """A keyed carrier comes up (as mark) so long before the first start bit."""
        return clock.ticks(self.keyup_s)

    @property
    def bit_ticks(self) -> Fraction:
        """Ticks of one bit of the PC on a robot's clock: both offsets are one ratio, since that clock is the tick."""
        return bit_ticks(self.baud_offset_ppm, self.crystal_offset_ppm)

    @property
    def error_threshold(self) -> int:
        """Chance of a wrong bit."""
        if self.eb_n0_db is not None:
            return fsk_threshold(self.eb_n0_db)
        return threshold(self.bit_error_rate or 0.0)

    @property
    def burst_threshold(self) -> int:
        """Chance of a wrong bit in a burst."""
        return threshold(self.bursts.bit_error_rate) if self.bursts else 0

    @property
    def false_start_threshold(self) -> int:
        """Chance that a bit time of idle carrier is a space."""
        return threshold(clock.exact(self.false_starts_hz) * BIT_S)


def bit_ticks(baud_offset_ppm: int, crystal_offset_ppm: int) -> Fraction:
    """The time of a bit sent at 9600 (1 + baud offset) baud on a clock of 24 MHz (1 + crystal offset)."""
    return Fraction(clock.HOST_BIT_TICKS * (1_000_000 + crystal_offset_ppm), 1_000_000 + baud_offset_ppm)


def threshold(probability: float | Fraction) -> int:
    """A probability as the number of the 2^32 values of a draw that mean "yes", rounded half up.

    The float stands for the decimal number that it prints as, as in `clock.ticks`. Raises ValueError outside 0 .. 1.
    """
    exact = clock.exact(probability)
    if not 0 <= exact <= 1:
        raise ValueError(f"the probability {probability} is outside 0 .. 1")
    return (2 * exact * ONE + 1) // 2


def fsk_threshold(eb_n0_db: float, margin: float = 1.0) -> int:
    """Bit errors of non-coherent FSK in white Gaussian noise, 0.5 exp(-Eb/2N0), of a signal of `margin` the amplitude.

    Source: J. G. Proakis, Digital Communications, non-coherent detection of binary orthogonal FSK.
    """
    from miro_exact.dmath import exp  # a hot module: not before the engine was chosen

    exponent = 0.5 * exp(eb_n0_db * LN10_TENTH)
    return int(2147483648.0 * exp(-(exponent * (margin * margin))) + 0.5)


def margin_table(eb_n0_db: float) -> tuple[int, ...]:
    """Thresholds of a wrong decision at margins -1, -1 + 1/128, .. 3.

    The margin is the distance of the signal from the slicer's threshold, 1 when that is in the middle. A
    margin m has the errors of a signal of m times the amplitude, 0.5 exp(-m^2 Eb/2N0). A negative one means
    that the decision is wrong unless noise turns it over: 1 - that.
    """
    table = []
    for step in range(-MARGIN_STEPS, 3 * MARGIN_STEPS + 1):
        wrong = fsk_threshold(eb_n0_db, float(step) / float(MARGIN_STEPS))
        table.append(ONE - wrong if step < 0 else wrong)
    return tuple(table)
