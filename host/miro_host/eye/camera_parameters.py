"""The parameters of a camera that a calibration finds: position, orientation and projection.

    image, 320 x 240            world: the paper's axes, z up from the floor
    o---> u (right)                  y
    |                                ^     camera at (x_m, y_m, height_m), looks down
    v v (down)                       o--> x

Pixel (i, j) covers i <= u < i + 1 and j <= v < j + 1. Without tilt and turn the image's right is +x and its top +y.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

WIDTH = 320
HEIGHT = 240

Metres = Annotated[float, Meta(ge=-10.0, le=10.0)]
SmallAngle = Annotated[float, Meta(ge=-0.5, le=0.5)]
Turn = Annotated[float, Meta(ge=-3.141592653589793, le=3.141592653589793)]
Pixels = Annotated[float, Meta(ge=-1000.0, le=1000.0)]


class CameraParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A pinhole with radial distortion. Defaults: 2 m above the middle of the pitch, a view of 140 x 105 cm.

    `focal_px`: focal length in widths of a pixel; `pixel_aspect`: width of a pixel by its height. `k1`: a point at the
    tangent r from the optical axis is drawn at r (1 + k1 r^2) (Brown 1966, first radial term). The camera is turned by
    `turn_rad` about its axis, counter-clockwise seen from above, then tilted by `tilt_y_rad` about the world's y axis
    and by `tilt_x_rad` about its x axis (right-handed).
    """

    x_m: Metres = 0.55
    y_m: Metres = 0.35
    height_m: Annotated[float, Meta(ge=0.5, le=10.0)] = 2.0
    focal_px: Annotated[float, Meta(ge=50.0, le=5000.0)] = 457.0
    pixel_aspect: Annotated[float, Meta(ge=0.5, le=2.0)] = 1.0
    centre_u_px: Pixels = 160.0
    centre_v_px: Pixels = 120.0
    tilt_x_rad: SmallAngle = 0.0
    tilt_y_rad: SmallAngle = 0.0
    turn_rad: Turn = 0.0
    k1: Annotated[float, Meta(ge=-0.5, le=0.5)] = -0.2
