"""The PC's calibration of its camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from miro_host.eye import eye_file
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens


class Residuals(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Distances between control points as measured in the picture and as the calibration draws them, in pixels.

    `px` has one for each of the `points`, in the order of their file.
    """

    rms_px: Annotated[float, Meta(ge=0.0)]
    max_px: Annotated[float, Meta(ge=0.0)]
    points: Annotated[int, Meta(ge=1)]
    px: tuple[float, ...] = ()


class Calibration(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Camera parameters as found; `version` of the file's form. `ignore_height`: everything is evaluated on the floor.

    `free`: the parameters determined from control points; the others were assumed.
    """

    camera: CameraParameters
    version: Literal[1] = 1
    ignore_height: bool = False
    free: tuple[str, ...] = ()
    residuals: Residuals | None = None

    def lens(self) -> Lens:
        """The geometry that follows."""
        return Lens(self.camera)

    def height_m(self, z_m: float) -> float:
        """Height at which the tracker evaluates pixels of an object `z_m` above the floor, in metres."""
        return 0.0 if self.ignore_height else z_m

    def text(self) -> str:
        """The calibration as TOML for `read`."""
        return eye_file.text(self)


def read(path: str | Path) -> Calibration:
    """The calibration in a file. Raises EyeError."""
    return eye_file.read(path, Calibration)
