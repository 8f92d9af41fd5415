"""A circular arc or a straight line, with a speed ramp.

Assumption 2 (equation 11) of the paper wants a path out of the origin of the world axes. There the polar form of
equation (9) is 0/0; on such an arc it has a closed form without a division by rho, so that t = 0 is a time like any
other.
"""

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from miro_exact.dmath import PI, sincos, wrap_pi
from miro_host.posture import Posture
from miro_host.references.interface import DEGREE, Reference, SamplingPace, TurnDeg, with_polar_form
from miro_host.references.ramp import Ramp, RampedReference


class Arc(msgspec.Struct, frozen=True):
    """Circular arc: theta_r = `heading_rad` + `curvature_per_m` * s.

    The chord from its start bisects the tangents. Hence out of the origin, until the arc comes back to it, with
    h = curvature * s / 2: phi_r = heading + h, rho_r = 2 sin(h) / curvature, phi_r - theta_r = -h, and from
    equations (9) and (18) rho_r' = v cos h, phi_r' = w / 2, rho_r'' = v' cos h - v^2 (curvature / 2) sin h.
    """

    ramp: Ramp = Ramp()
    heading_rad: float = 1.0471975511965976  # 60 degrees
    curvature_per_m: float = -1.0
    start_x_m: float = 0.0
    start_y_m: float = 0.0

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`; standstill at the ends outside the ramp's time."""
        s, v, v_dot = self.ramp.at(t_s)
        kappa = self.curvature_per_m
        w_dot = kappa * v_dot if kappa != 0.0 else 0.0  # never -0.0 on a line
        half_turn = 0.5 * kappa * s
        sin_h, cos_h = sincos(half_turn)
        rho = s if kappa == 0.0 else 2.0 * sin_h / kappa
        phi = wrap_pi(self.heading_rad + half_turn)
        sin_phi, cos_phi = sincos(phi)
        theta = wrap_pi(self.heading_rad + kappa * s)
        if self.start_x_m != 0.0 or self.start_y_m != 0.0 or abs(half_turn) >= PI:
            at = Posture(self.start_x_m + rho * cos_phi, self.start_y_m + rho * sin_phi, theta)
            return with_polar_form(at, v, kappa * v, v_dot, w_dot)
        at = Posture(rho * cos_phi, rho * sin_phi, theta)
        rho_accel = v_dot * cos_h - v * v * (0.5 * kappa) * sin_h
        polar = rho, phi, v * cos_h, 0.5 * kappa * v, rho_accel
        return Reference(at, v, kappa * v, v_dot, w_dot, *polar)

    def pace(self, step_m: float, step_rad: float) -> SamplingPace:
        """After one whole turn the circle is closed."""
        kappa = abs(self.curvature_per_m)
        if kappa == 0.0:
            return self.ramp.pace(step_m, math.inf)
        return self.ramp.pace(min(step_m, step_rad / kappa), 2.0 * PI / kappa)


class StraightLine(Arc, frozen=True):
    """An arc without curvature. Out of the origin theta_r = phi_r = the angle and rho_r = s."""

    heading_rad: float = 0.0
    curvature_per_m: float = 0.0


class LineRef(RampedReference, frozen=True, kw_only=True, tag="line"):
    """A straight line, run with a speed ramp: s = v t^2 / (2 t_r), then v (t - t_r / 2).

    With `drive_s` the reference comes to rest by the same ramp, after so many seconds, and stands from then on.
    Without, it moves for the whole duration.
    """

    def trajectory(self, duration_s: float) -> StraightLine:
        return StraightLine(
            self.ramp(duration_s),
            heading_rad=self.heading_deg * DEGREE,
            start_x_m=self.start_x_cm / 100.0,
            start_y_m=self.start_y_cm / 100.0,
        )


class ArcRef(RampedReference, frozen=True, kw_only=True, tag="arc"):
    """A circular arc: heading theta_0 + kappa s, the same speed ramp and `drive_s` as the line."""

    heading_deg: TurnDeg = 60.0
    curvature_per_m: Annotated[float, Meta(ge=-100.0, le=100.0)] = -1.0

    def trajectory(self, duration_s: float) -> Arc:
        return Arc(
            self.ramp(duration_s),
            self.heading_deg * DEGREE,
            self.curvature_per_m,
            self.start_x_cm / 100.0,
            self.start_y_cm / 100.0,
        )
