"""Reference trajectories q_r(t): where the robot should be, with every derivative that a law needs.

What belongs here: a straight line and a circular arc out of the origin, both with a speed ramp, in
Cartesian and in polar form. What does not: choosing a path (the scenario does) and errors against it
(`yang_kim`).

Both paths start in the origin of the world axes, as assumption 2 (equation 11) of the paper wants. There
the polar form of equation (9) is 0/0; on a line and on an arc it has a closed form without a division by
rho, which is used throughout, so that t = 0 is a time like any other.
"""

from typing import Protocol

import msgspec

from miro_exact.dmath import sincos, wrap_pi
from miro_host.posture import Posture


class Reference(msgspec.Struct, frozen=True):
    """One instant of a reference trajectory.

    `w_*` are turning rates in rad/s and rad/s2. `rho_m`, `phi_rad` are the polar coordinates of the posture;
    their derivatives are those of equation (9), `rho_accel_m_s2` = v_r' cos(phi_r - theta_r) + R(q_r, z_r)
    of equation (18). All angles lie in (-pi, pi].
    """

    posture: Posture
    v_m_s: float
    w_rad_s: float
    v_dot_m_s2: float
    w_dot_rad_s2: float
    rho_m: float
    phi_rad: float
    rho_rate_m_s: float
    phi_rate_rad_s: float
    rho_accel_m_s2: float


class Ramp(msgspec.Struct, frozen=True):
    """Speed profile: from rest to `speed_m_s` in `ramp_s` at constant acceleration, then steady.

    Before 0 s and after `duration_s` the reference stands still. With `ramp_down` it comes to rest as it started: at
    constant deceleration in the last `ramp_s` (in the second half, if `duration_s` is shorter than two ramps).
    Without, there is no ramp at the end. The instants 0 and `duration_s` themselves belong to the drive.
    """

    speed_m_s: float = 0.20
    ramp_s: float = 0.5
    duration_s: float = 6.0
    ramp_down: bool = False

    def __post_init__(self) -> None:
        for name in ("speed_m_s", "ramp_s", "duration_s"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be 0 or greater")

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Path length in m, speed in m/s and acceleration in m/s2 at `t_s`."""
        if t_s < 0.0:
            return 0.0, 0.0, 0.0
        if t_s > self.duration_s:
            return self._whole_length(), 0.0, 0.0
        left_s = self.duration_s - t_s
        if self.ramp_down and left_s < self.ramp_s and left_s < t_s:  # the start, run backwards
            slowing = self.speed_m_s / self.ramp_s
            return self._whole_length() - self._length(left_s), slowing * left_s, -slowing
        if t_s < self.ramp_s:
            return self._length(t_s), self.speed_m_s * t_s / self.ramp_s, self.speed_m_s / self.ramp_s
        return self._length(t_s), self.speed_m_s, 0.0

    def _whole_length(self) -> float:
        if not self.ramp_down:
            return self._length(self.duration_s)
        half_s = 0.5 * self.duration_s
        return 2.0 * self._length(half_s)

    def _length(self, t_s: float) -> float:
        if t_s < self.ramp_s:
            return self.speed_m_s * t_s * t_s / (2.0 * self.ramp_s)
        return self.speed_m_s * (t_s - 0.5 * self.ramp_s)


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


class Trajectory(Protocol):
    """A reference over time."""

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s` seconds after its start, for any time, also before 0 and after its end."""
        ...
