"""The scenario's `[camera]`: which kinds there are and their keys, with unit, default and range.

A kind is chosen by `kind`:

    pixels     a picture is rendered, and a tracker finds the robots in it
    geometric  no picture: the true place of the patches, read through the calibration; so its static field alone
    gaussian   neither: white noise on the posture, which averages out and is therefore optimistic
"""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.patterns import PatternName
from miro_sim.pitch.picture_settings import PictureSettings

PitchCm = Annotated[float, Meta(ge=-1_000.0, le=1_000.0)]
Frames = Annotated[int, Meta(ge=0, le=30)]
Chance = Annotated[float, Meta(ge=0.0, le=1.0)]
CalibrationKind = Literal["exact", "1997", "none"] | Annotated[int, Meta(ge=1997, le=1997)]
"""1997 may be written as a number: `--set camera.calibration=1997` is one."""


class GaussianCamera(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="gaussian"
):
    """White noise per axis, pixels, whole frames of delay.

    `position_error_cm` and `heading_error_deg` are three standard deviations (paper section V-A: 2.40 cm,
    4.83 degrees); 0 measures without error. `pixel_cm` 0 measures without quantisation; 0.4375 is a pitch of
    140 x 105 cm on 320 x 240 pixels.
    """

    position_error_cm: Annotated[float, Meta(ge=0.0, le=100.0)] = 2.40
    heading_error_deg: Annotated[float, Meta(ge=0.0, le=180.0)] = 4.83
    pixel_cm: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.4375
    delay_frames: Frames = 1


class CalibrationErrorSizes(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sizes of the independent errors of a calibration; `calibration = "1997"` draws signs and directions.

    `worst_cm`: the drawn errors are scaled together to this worst case over the pitch; 0: not scaled. `ignore_height`:
    the patches are evaluated on the floor; `ignore_distortion`: the lens is assumed to have none.
    """

    centre_px: Annotated[float, Meta(ge=0.0, le=20.0)] = 1.0
    focal_share: Annotated[float, Meta(ge=0.0, le=0.2)] = 0.01
    tilt_deg: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.57
    worst_cm: Annotated[float, Meta(ge=0.0, le=20.0)] = 2.40
    ignore_height: bool = False
    ignore_distortion: bool = False


class SeeingCamera(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The common part of `pixels` and `geometric`: lens, pattern of the patches, calibration, whole frames.

    `dropped_frames`, `repeated_frames`: chance for each frame that it never comes, or that the one before comes again.
    `lost_robots`: chance for each robot and frame that it is not found.
    """

    lens: CameraParameters = CameraParameters()
    pattern: PatternName = "diagonal"
    calibration: CalibrationKind = "1997"
    calibration_errors: CalibrationErrorSizes = CalibrationErrorSizes()
    delay_frames: Frames = 1
    dropped_frames: Chance = 0.0
    repeated_frames: Chance = 0.0
    lost_robots: Chance = 0.0


class GeometricCamera(SeeingCamera, frozen=True, tag_field="kind", tag="geometric"):
    """The static field of a calibration, without noise."""


class Ball(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A golf ball that lies still."""

    x_cm: PitchCm
    y_cm: PitchCm


class PixelCamera(SeeingCamera, frozen=True, tag_field="kind", tag="pixels"):
    """A rendered picture and the tracker that reads it. `centroid`: of a patch, see `miro_host.eye`.

    `window_px`: side of the window in which a robot is looked for. `self_calibration` "lines": the calibration is
    improved during the run, from lines and walls of the pitch.
    """

    centroid: Literal["binary", "weighted"] = "binary"
    window_px: Annotated[int, Meta(ge=16, le=64)] = 32
    self_calibration: Literal["none", "lines"] = "none"
    picture: PictureSettings = PictureSettings()
    ball: Ball | None = None


Camera = PixelCamera | GeometricCamera | GaussianCamera
"""Every kind of camera there is; another kind is another struct with a tag."""
