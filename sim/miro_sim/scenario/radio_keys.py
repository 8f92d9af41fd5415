"""The scenario's `[network.radio]`: which keys there are, with unit, default and range."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

BIT_S = 1 / 9600
BIT_ERROR_RATE = 1e-4
"""What holds when a scenario names neither a bit-error rate nor Eb/N0."""

Latency = Annotated[float, Meta(ge=0.0, le=0.030)]
Chance = Annotated[float, Meta(ge=0.0, le=1.0)]
Mean = Annotated[float, Meta(ge=0.000105, le=1e6)]
OffsetPpm = Annotated[int, Meta(ge=-50_000, le=50_000)]
ProfileName = Annotated[str, Meta(max_length=40)]


class Bursts(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Gilbert-Elliott: chances a bit time of going bad and good again, and the error rate while it is bad."""

    good_to_bad: Chance
    bad_to_good: Chance
    bit_error_rate: Annotated[float, Meta(ge=0.0, le=0.5)] = 0.5

    def __post_init__(self) -> None:
        if self.good_to_bad + self.bad_to_good > 1.0:
            raise ValueError(
                f"bad_to_good: {self.bad_to_good} and good_to_bad {self.good_to_bad} make more than 1;"
                " a state must last a bit on average"
            )


class Dropouts(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Times without a carrier: mean time from the end of one to the next, and mean length."""

    every_s: Mean
    length_s: Mean

    def __post_init__(self) -> None:
        if BIT_S / self.every_s + BIT_S / self.length_s >= 1.0:
            raise ValueError(
                f"every_s: {self.every_s} and length_s {self.length_s} are too short together;"
                f" one of them must last more than a bit ({BIT_S:.6f} s)"
            )


class Slicer(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An AC-coupled slicer: its time constant, and the offset of the carriers in units of the deviation."""

    settle_s: Annotated[float, Meta(ge=0.000105, le=1.0)] = 0.004
    offset: Annotated[float, Meta(ge=-1.0, le=1.0)] = 0.0


class Radio(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One radio network: 9600 baud down to the robots and, with `telemetry`, a second band up.

    `carrier` keyed is a transmitter that is on per frame only, `keyup_s` before its first start bit;
    between frames the receiver's slicer makes noise, unless `squelch` holds it at mark. Errors come from
    `bit_error_rate` or from `eb_n0_db`, not both. Networks with the same `channel` hear each other; without
    one a network is alone. `lost_frames`: chance for each transmission down that it never goes on the air.
    `profile` names sets of these keys, see `profiles`; keys that are given win.
    """

    profile: ProfileName | tuple[ProfileName, ...] = ()
    latency_s: Latency = 0.0
    jitter_s: Latency = 0.0
    bit_error_rate: Annotated[float, Meta(ge=0.0, le=0.5)] | None = None
    eb_n0_db: Annotated[float, Meta(ge=-20.0, le=60.0)] | None = None
    carrier: Literal["keyed", "on"] = "keyed"
    keyup_s: Latency = 0.001
    squelch: bool = False
    telemetry: bool = True
    channel: Annotated[int, Meta(ge=0, le=999)] | None = None
    baud_offset_ppm: OffsetPpm = 0
    crystal_offset_ppm: OffsetPpm = 0
    false_starts_hz: Annotated[float, Meta(ge=0.0, le=9600.0)] = 0.0
    lost_character_rate: Chance = 0.0
    lost_frames: Chance = 0.0
    bursts: Bursts | None = None
    dropouts: Dropouts | None = None
    slicer: Slicer | None = None

    def __post_init__(self) -> None:
        if self.eb_n0_db is None:
            if self.slicer is not None:
                raise ValueError(
                    "slicer: its bit errors follow from Eb/N0; give eb_n0_db, not bit_error_rate"
                )
            if self.bit_error_rate is None:
                msgspec.structs.force_setattr(self, "bit_error_rate", BIT_ERROR_RATE)
        elif self.bit_error_rate is not None:
            raise ValueError("eb_n0_db: sets the same as bit_error_rate; give one of the two")


class ControlNoise(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The paper's "noise in control signal" (section V-A): bounds of what is added to the commands sent.

    0 and 0 is none. Every control period each robot's v and w get a draw of their own, uniform within the
    bound: the paper gives neither bounds nor distribution.
    """

    v_m_s: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    w_rad_s: Annotated[float, Meta(ge=0.0, le=40.0)] = 0.0
