"""The camera's processing of light, apart from its geometry: exposure, brightness, the television signal, noise."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

LEAST_BANDWIDTH_HZ = 250_000.0
"""A narrower filter would need more than 8 pixels on either side."""


class PictureSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One setting for each thing that damages a picture; 0 switches most of them off.

    `exposure_s`: shutter, sampled at `sub_exposures` instants, its middle at the frame's tick. `fields` 2: both fields
    of a television frame, 480 lines averaged in pairs, the second 1/59.94 s after the first, the frame's tick between
    them; 1: one field of 240 lines.
    `light_falloff`: share of the light that is missing at the corners of the pitch. `flicker`: of the lamps, as a share
    of the mean, at twice `mains_hz`. `gain`, `offset`: of the sensor, before `gamma`; the offset as a share of white.
    `chroma_bandwidth_hz`: of composite video (-3 dB, Gaussian); 0: not limited. `luma_noise`, `chroma_noise`: standard
    deviations in levels of 8 bits. `line_jitter_px`: each line is shifted by up to so much either way. `bits`: of the
    grabber.
    """

    exposure_s: Annotated[float, Meta(ge=0.0, le=0.0333)] = 1.0 / 60.0
    sub_exposures: Literal[1, 3] = 3
    fields: Literal[1, 2] = 1
    black_floor: bool = False
    light_falloff: Annotated[float, Meta(ge=0.0, le=0.9)] = 0.25
    flicker: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.3
    mains_hz: Literal[50, 60] = 60
    gain: Annotated[float, Meta(ge=0.05, le=8.0)] = 1.0
    offset: Annotated[float, Meta(ge=0.0, le=0.5)] = 0.0
    gamma: Annotated[float, Meta(ge=0.3, le=1.0)] = 0.45
    chroma_bandwidth_hz: Annotated[float, Meta(ge=0.0, le=3.0e6)] = 0.6e6
    luma_noise: Annotated[float, Meta(ge=0.0, le=64.0)] = 2.0
    chroma_noise: Annotated[float, Meta(ge=0.0, le=64.0)] = 4.0
    line_jitter_px: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    bits: Annotated[int, Meta(ge=3, le=8)] = 8

    def __post_init__(self) -> None:
        if 0.0 < self.chroma_bandwidth_hz < LEAST_BANDWIDTH_HZ:
            raise ValueError(
                f"chroma_bandwidth_hz: {self.chroma_bandwidth_hz} is out of range;"
                f" must be 0 (not limited) or >= {LEAST_BANDWIDTH_HZ:.0f} in hertz"
            )


def checked(settings: PictureSettings) -> PictureSettings:
    """Returns an equal copy. Raises ValueError for a value out of range, which a program can give."""
    return msgspec.convert(msgspec.to_builtins(settings), PictureSettings)
