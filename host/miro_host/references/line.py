"""A straight line out of the origin, with a speed ramp.

What belongs here: the trajectory and its keys. What does not: the speed profile (`ramp`).
"""

import msgspec

from miro_exact.dmath import sincos, wrap_pi
from miro_host.posture import Posture
from miro_host.references.interface import DEGREE, Reference, ReferenceParameters, TurnDeg
from miro_host.references.ramp import DriveS, Ramp, Seconds, Speed, ramp_for


class Line(msgspec.Struct, frozen=True):
    """Straight line out of the origin at `heading_rad` against +X: theta_r = phi_r = the angle, rho_r = s."""

    ramp: Ramp = Ramp()
    heading_rad: float = 0.0

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`; standstill at the ends outside the ramp's time."""
        s, v, v_dot = self.ramp.at(t_s)
        angle = wrap_pi(self.heading_rad)
        sin, cos = sincos(angle)
        return Reference(
            posture=Posture(s * cos, s * sin, angle),
            v_m_s=v,
            w_rad_s=0.0,
            v_dot_m_s2=v_dot,
            w_dot_rad_s2=0.0,
            rho_m=s,
            phi_rad=angle,
            rho_rate_m_s=v,
            phi_rate_rad_s=0.0,
            rho_accel_m_s2=v_dot,
        )


class LineRef(ReferenceParameters, frozen=True, kw_only=True, tag="line"):
    """A straight line from the origin, run with a speed ramp: s = v t^2 / (2 t_r), then v (t - t_r / 2).

    With `drive_s` the reference comes to rest by the same ramp, after so many seconds, and stands from then on.
    Without, it moves for the whole duration.
    """

    heading_deg: TurnDeg = 0.0
    speed_m_s: Speed = 0.20
    ramp_s: Seconds = 0.5
    drive_s: DriveS | None = None

    def trajectory(self, duration_s: float) -> Line:
        return Line(
            ramp_for(self.speed_m_s, self.ramp_s, self.drive_s, duration_s), self.heading_deg * DEGREE
        )
