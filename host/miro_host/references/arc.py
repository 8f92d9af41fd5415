"""A circular arc out of the origin, with a speed ramp.

What belongs here: the trajectory and its keys. What does not: the speed profile (`ramp`).

It starts in the origin of the world axes, as assumption 2 (equation 11) of the paper wants. There the polar form of
equation (9) is 0/0; on an arc it has a closed form without a division by rho, which is used throughout, so that t = 0
is a time like any other.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

from miro_exact.dmath import sincos, wrap_pi
from miro_host.posture import Posture
from miro_host.references.interface import DEGREE, Reference, ReferenceParameters, TurnDeg
from miro_host.references.ramp import DriveS, Ramp, Seconds, Speed, ramp_for


class Arc(msgspec.Struct, frozen=True):
    """Circular arc out of the origin: theta_r = `heading_rad` + `curvature_per_m` * s.

    The chord from the origin bisects the tangents, hence with h = curvature * s / 2: phi_r = heading + h,
    rho_r = 2 sin(h) / curvature, phi_r - theta_r = -h, and from equations (9) and (18)
    rho_r' = v cos h, phi_r' = w / 2, rho_r'' = v' cos h - v^2 (curvature / 2) sin h.
    ValueError for an arc that would come back to the origin, against assumption 2 (equation 11).
    """

    ramp: Ramp = Ramp()
    heading_rad: float = 1.0471975511965976  # 60 degrees
    curvature_per_m: float = -1.0

    def __post_init__(self) -> None:
        turn = abs(self.curvature_per_m) * self.ramp.at(self.ramp.duration_s)[0]
        if turn >= 6.283185307179586:
            raise ValueError(
                f"curvature_per_m = {self.curvature_per_m!r}: the path turns by {turn:.3f} rad, back to the"
                " origin; shorten the drive or make the arc flatter"
            )

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`; standstill at the ends outside the ramp's time."""
        s, v, v_dot = self.ramp.at(t_s)
        kappa = self.curvature_per_m
        half_turn = 0.5 * kappa * s
        sin_h, cos_h = sincos(half_turn)
        rho = s if kappa == 0.0 else 2.0 * sin_h / kappa
        phi = wrap_pi(self.heading_rad + half_turn)
        sin_phi, cos_phi = sincos(phi)
        return Reference(
            posture=Posture(rho * cos_phi, rho * sin_phi, wrap_pi(self.heading_rad + kappa * s)),
            v_m_s=v,
            w_rad_s=kappa * v,
            v_dot_m_s2=v_dot,
            w_dot_rad_s2=kappa * v_dot,
            rho_m=rho,
            phi_rad=phi,
            rho_rate_m_s=v * cos_h,
            phi_rate_rad_s=0.5 * kappa * v,
            rho_accel_m_s2=v_dot * cos_h - v * v * (0.5 * kappa) * sin_h,
        )


class ArcRef(ReferenceParameters, frozen=True, kw_only=True, tag="arc"):
    """A circular arc from the origin: heading theta_0 + kappa s, the same speed ramp and `drive_s` as the line."""

    heading_deg: TurnDeg = 60.0
    curvature_per_m: Annotated[float, Meta(ge=-100.0, le=100.0)] = -1.0
    speed_m_s: Speed = 0.20
    ramp_s: Seconds = 0.5
    drive_s: DriveS | None = None

    def trajectory(self, duration_s: float) -> Arc:
        return Arc(
            ramp_for(self.speed_m_s, self.ramp_s, self.drive_s, duration_s),
            self.heading_deg * DEGREE,
            self.curvature_per_m,
        )
