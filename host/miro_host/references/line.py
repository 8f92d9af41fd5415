"""A straight line with a speed ramp."""

import math

import msgspec

from miro_exact.dmath import sincos, wrap_pi
from miro_host.posture import Posture
from miro_host.references.interface import DEGREE, Reference, SamplingPace, with_polar_form
from miro_host.references.ramp import Ramp, RampedReference


class StraightLine(msgspec.Struct, frozen=True):
    """Straight line at `heading_rad` against +X. Out of the origin theta_r = phi_r = the angle and rho_r = s."""

    ramp: Ramp = Ramp()
    heading_rad: float = 0.0
    start_x_m: float = 0.0
    start_y_m: float = 0.0

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`; standstill at the ends outside the ramp's time."""
        s, v, v_dot = self.ramp.at(t_s)
        angle = wrap_pi(self.heading_rad)
        sin, cos = sincos(angle)
        if self.start_x_m != 0.0 or self.start_y_m != 0.0:
            at = Posture(self.start_x_m + s * cos, self.start_y_m + s * sin, angle)
            return with_polar_form(at, v, 0.0, v_dot, 0.0)
        return Reference(Posture(s * cos, s * sin, angle), v, 0.0, v_dot, 0.0, s, angle, v, 0.0, v_dot)

    def pace(self, step_m: float, step_rad: float) -> SamplingPace:
        """A line that does not end in time leads on for ever."""
        return self.ramp.pace(step_m, math.inf)


class LineRef(RampedReference, frozen=True, kw_only=True, tag="line"):
    """A straight line, run with a speed ramp: s = v t^2 / (2 t_r), then v (t - t_r / 2).

    With `drive_s` the reference comes to rest by the same ramp, after so many seconds, and stands from then on.
    Without, it moves for the whole duration.
    """

    def trajectory(self, duration_s: float) -> StraightLine:
        return StraightLine(
            self.ramp(duration_s),
            self.heading_deg * DEGREE,
            self.start_x_cm / 100.0,
            self.start_y_cm / 100.0,
        )
