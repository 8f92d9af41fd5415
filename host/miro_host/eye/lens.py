"""The geometry of a camera: from a pixel to the ground at a height, and from a point to its pixel.

    pixel (u, v) -> tangents as drawn -> without distortion -> turned into world axes: slopes -> ground at a height

A slope is how far a ray goes along x (or y) for each metre that it falls.
"""

from __future__ import annotations

import math

from miro_exact.dmath import sincos
from miro_host.eye.camera_parameters import CameraParameters

_STEPS = 6
"""Of Newton's method, from the drawn radius: exact to 1e-9 px for a camera that sees the whole pitch."""


class Lens:
    """The geometry of a camera. It is constant and no part of the state."""

    NOT_STATE = ("*",)

    def __init__(self, parameters: CameraParameters) -> None:
        self.parameters = parameters
        self.x_m, self.y_m, self.height_m = parameters.x_m, parameters.y_m, parameters.height_m
        self.focal_u = parameters.focal_px
        self.focal_v = parameters.focal_px * parameters.pixel_aspect
        self.centre_u, self.centre_v = parameters.centre_u_px, parameters.centre_v_px
        self.k1 = parameters.k1
        sx, cx = sincos(parameters.tilt_x_rad)
        sy, cy = sincos(parameters.tilt_y_rad)
        sz, cz = sincos(parameters.turn_rad)
        # Columns a, b, c: where the camera's own axes (right, up, backwards) point in the world: Rx Ry Rz.
        self.xa, self.xb, self.xc = cy * cz, 0.0 - cy * sz, sy
        self.ya, self.yb, self.yc = cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, 0.0 - sx * cy
        self.za, self.zb, self.zc = sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy
        self.out_x = self.out_y = 0.0

    def __repr__(self) -> str:
        return f"Lens({self.parameters!r})"

    def slopes(self, u: float, v: float) -> None:
        """Leaves the slopes of the ray through (u, v) in `out_x`, `out_y`.

        Raises ValueError for a ray that does not go down, and for a pixel outside of the lens's range.
        """
        right = (u - self.centre_u) / self.focal_u
        up = (self.centre_v - v) / self.focal_v
        drawn = math.sqrt(right * right + up * up)
        if drawn > 0.0:
            radius = drawn
            for _ in range(_STEPS):
                square = self.k1 * radius * radius
                growth = 1.0 + 3.0 * square
                if growth < 0.1:
                    raise ValueError(f"pixel ({u:.1f}, {v:.1f}) lies beyond what the lens draws")
                nearer = radius - (radius * (1.0 + square) - drawn) / growth
                if nearer == radius:
                    break  # and so would all steps that are left
                radius = nearer
            right *= radius / drawn
            up *= radius / drawn
        fall = self.zc - self.za * right - self.zb * up
        if fall < 0.1:
            raise ValueError(f"pixel ({u:.1f}, {v:.1f}) does not look at the ground")
        self.out_x = (self.xa * right + self.xb * up - self.xc) / fall
        self.out_y = (self.ya * right + self.yb * up - self.yc) / fall

    def ground(self, u: float, v: float, z_m: float) -> tuple[float, float]:
        """(x_m, y_m) of a point that is drawn at (u, v) and is `z_m` above the floor.

        Raises ValueError as `slopes` does.
        """
        self.slopes(u, v)
        fall_m = self.height_m - z_m
        return self.x_m + fall_m * self.out_x, self.y_m + fall_m * self.out_y

    def pixel(self, x_m: float, y_m: float, z_m: float) -> tuple[float, float]:
        """(u, v) at which a point is drawn. Raises ValueError for one that the camera cannot draw."""
        dx, dy, dz = x_m - self.x_m, y_m - self.y_m, z_m - self.height_m
        depth = 0.0 - (self.xc * dx + self.yc * dy + self.zc * dz)
        if depth < 0.01:
            raise ValueError(f"the point ({x_m:.3f}, {y_m:.3f}, {z_m:.3f}) m is not in front of the camera")
        right = (self.xa * dx + self.ya * dy + self.za * dz) / depth
        up = (self.xb * dx + self.yb * dy + self.zb * dz) / depth
        square = self.k1 * (right * right + up * up)
        if 1.0 + 3.0 * square < 0.1:  # further out it would be drawn further in
            raise ValueError(f"the point ({x_m:.3f}, {y_m:.3f}, {z_m:.3f}) m lies beyond what the lens draws")
        scale = 1.0 + square
        return self.centre_u + self.focal_u * right * scale, self.centre_v - self.focal_v * up * scale
