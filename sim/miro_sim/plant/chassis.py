# cython: cdivision=True
# No divisor below is ever zero: track and masses are positive.
"""The rigid robot on two wheels: impulses on the motor shafts in, shaft speeds and posture out.

Wheels roll without slipping (keep below 6.28 m/s2: see the README).

With the shaft speeds w = (left, right) and c = wheel radius / gear ratio the robot goes at
v = (cl wl + cr wr) / 2 and turns at (cr wr - cl wl) / b; its energy is w' M w / 2 with

    M = | Jm + cl2 (m/4 + Jz/b2)   cl cr (m/4 - Jz/b2)    |
        | cl cr (m/4 - Jz/b2)      Jm + cr2 (m/4 + Jz/b2) |
"""

from __future__ import annotations

from miro_exact import dmath
from miro_sim.plant.params import DriveParams

TICK_S = 1.0 / 24e6
SWEEPS = 8
_ANGLES = 1.6e6  # `dmath.ANGLE_LIMIT`
_SPEED = ("d", -1e6, 1e6)  # far more than a robot's
_PLACE = ("d", -1e9, 1e9)


BLOCKED_NM = 1e30
"""Friction that nothing overcomes: a shaft with it stands within a step, and stays."""


class Body:
    """Shaft speeds (rad/s) and posture (m, m, rad; the heading is not wrapped) of one robot.

    `left_brake_nm`, `right_brake_nm`: friction of a blocked shaft, a fault; 0 where it turns.
    """

    STATE = {
        "left_rad_s": _SPEED,
        "right_rad_s": _SPEED,
        "x_m": _PLACE,
        "y_m": _PLACE,
        "theta_rad": ("d", -0.5e6, 0.5e6),  # `dmath` takes a million
        "left_brake_nm": ("d", 0.0, BLOCKED_NM),
        "right_brake_nm": ("d", 0.0, BLOCKED_NM),
    }
    NOT_HASHED: tuple[str, ...] = (
        "left_brake_nm",
        "right_brake_nm",
    )  # a fault: what it does to the speed is hashed
    NOT_STATE: tuple[str, ...] = (
        "left_m_rad", "right_m_rad", "track_m", "friction_nm", "mass_ll", "mass_lr", "mass_rr", "inverse_ll",
        "inverse_lr", "inverse_rr", "turned_left_rad", "turned_right_rad",
    )  # fmt: skip

    def __init__(self, params: DriveParams, x_m: float, y_m: float, theta_rad: float) -> None:
        body = params.chassis
        self.left_m_rad = params.radius_m(0) / body.gear_ratio
        self.right_m_rad = params.radius_m(1) / body.gear_ratio
        self.track_m = body.track_m
        self.friction_nm = params.friction_nm()
        straight = 0.25 * body.mass_kg
        yaw = body.yaw_inertia_kg_m2 / (body.track_m * body.track_m)
        rotor = params.motor.rotor_inertia_kg_m2
        self.mass_ll = rotor + self.left_m_rad * self.left_m_rad * (straight + yaw)
        self.mass_lr = self.left_m_rad * self.right_m_rad * (straight - yaw)
        self.mass_rr = rotor + self.right_m_rad * self.right_m_rad * (straight + yaw)
        determinant = self.mass_ll * self.mass_rr - self.mass_lr * self.mass_lr
        self.inverse_ll = self.mass_rr / determinant
        self.inverse_lr = -self.mass_lr / determinant
        self.inverse_rr = self.mass_ll / determinant
        self.left_brake_nm = 0.0
        self.right_brake_nm = 0.0
        self.left_rad_s = 0.0
        self.right_rad_s = 0.0
        self.x_m = x_m
        self.y_m = y_m
        self.theta_rad = theta_rad
        self.turned_left_rad = [0.0] * 16  # by each of the last pushes
        self.turned_right_rad = [0.0] * 16

    def push(self, left_nms: float, right_nms: float, ticks: int) -> None:
        """Applies motor impulses and friction over `ticks`; moves on at the mean of old and new speed."""
        self._push(left_nms, right_nms, ticks, 0)
        self._roll(1)

    def _push(self, left_nms: float, right_nms: float, ticks: int, step: int) -> None:
        """Applies impulses and friction; saves the turn of the shafts as number `step` for `_roll`."""
        old_left = self.left_rad_s
        old_right = self.right_rad_s
        self.turned_left_rad[step] = 0.0
        self.turned_right_rad[step] = 0.0
        if old_left != 0.0 or old_right != 0.0 or left_nms != 0.0 or right_nms != 0.0:
            half_s = 0.5 * TICK_S * ticks
            step_s = 2.0 * half_s
            self._slide(
                old_left + self.inverse_ll * left_nms + self.inverse_lr * right_nms,
                old_right + self.inverse_lr * left_nms + self.inverse_rr * right_nms,
                step_s * (self.friction_nm + self.left_brake_nm),
                step_s * (self.friction_nm + self.right_brake_nm),
            )
            self.turned_left_rad[step] = half_s * (old_left + self.left_rad_s)
            self.turned_right_rad[step] = half_s * (old_right + self.right_rad_s)

    def _slide(self, left: float, right: float, most_left: float, most_right: float) -> None:
        """Shaft speeds after friction impulses of at most these, from what they would be without friction."""
        left_rub = most_left if left < 0.0 else -most_left
        right_rub = most_right if right < 0.0 else -most_right
        new_left = left + self.inverse_ll * left_rub + self.inverse_lr * right_rub
        new_right = right + self.inverse_lr * left_rub + self.inverse_rr * right_rub
        if new_left * left > 0.0 and new_right * right > 0.0:  # both go on sliding as they did
            self.left_rad_s = new_left
            self.right_rad_s = new_right
        else:
            self._rub(left, right, most_left, most_right)

    def _rub(self, left: float, right: float, most_left: float, most_right: float) -> None:
        """Friction impulses of at most `most_left` and `most_right`, opposing the speed that is left after them.

        They minimise the kinetic energy within the box |impulse| <= most (maximum dissipation): a shaft that
        can be held is held at exactly zero. The two easy cases are solved directly (that of two sliding shafts in
        `_slide`), the rest by projected Gauss-Seidel sweeps; each of these lowers the energy: friction never drives,
        however many there are.
        """
        left_rub = -(self.mass_ll * left + self.mass_lr * right)
        right_rub = -(self.mass_lr * left + self.mass_rr * right)
        if -most_left <= left_rub <= most_left and -most_right <= right_rub <= most_right:  # both stick
            self.left_rad_s = 0.0
            self.right_rad_s = 0.0
            return
        left_rub = 0.0
        right_rub = 0.0
        for _ in range(SWEEPS):
            new_left = left + self.inverse_ll * left_rub + self.inverse_lr * right_rub
            left_rub = min(most_left, max(-most_left, left_rub - new_left / self.inverse_ll))
            new_right = right + self.inverse_lr * left_rub + self.inverse_rr * right_rub
            right_rub = min(most_right, max(-most_right, right_rub - new_right / self.inverse_rr))
        new_left = left + self.inverse_ll * left_rub + self.inverse_lr * right_rub
        new_right = right + self.inverse_lr * left_rub + self.inverse_rr * right_rub
        self.left_rad_s = 0.0 if -most_left < left_rub < most_left else new_left
        self.right_rad_s = 0.0 if -most_right < right_rub < most_right else new_right

    def _roll(self, steps: int) -> None:
        """Moves the posture along the arcs that both wheels have rolled (chords, exact to the 4th power).

        A step needs the speeds of the one before, not the posture: apart, the processor does several at a time.
        """
        x_m = self.x_m
        y_m = self.y_m
        theta_rad = self.theta_rad
        for step in range(steps):
            left_rad = self.turned_left_rad[step]
            right_rad = self.turned_right_rad[step]
            if left_rad == 0.0 and right_rad == 0.0:
                continue
            left_m = self.left_m_rad * left_rad
            right_m = self.right_m_rad * right_rad
            half = 0.5 * (right_m - left_m) / self.track_m
            chord_m = 0.5 * (left_m + right_m) * (1.0 - half * half / 6.0)
            angle = theta_rad + half
            if not -_ANGLES < angle < _ANGLES:
                dmath.sincos(angle)  # raises DomainError
            sine, cosine = dmath.sincos_within(angle)
            x_m = x_m + chord_m * cosine
            y_m = y_m + chord_m * sine
            theta_rad = theta_rad + 2.0 * half
        self.x_m = x_m
        self.y_m = y_m
        self.theta_rad = theta_rad

    def pose_after(self, ticks: int) -> tuple[float, float, float]:
        """Posture (m, m, rad) `ticks` after the last push at the speeds of now; changes nothing."""
        v, w = self.velocity()
        time_s = TICK_S * ticks
        half = 0.5 * w * time_s
        chord_m = v * time_s * (1.0 - half * half / 6.0)
        sine, cosine = dmath.sincos(self.theta_rad + half)
        return (self.x_m + chord_m * cosine, self.y_m + chord_m * sine, self.theta_rad + 2.0 * half)

    def velocity(self) -> tuple[float, float]:
        """(m/s forward, rad/s counter-clockwise)."""
        left_m_s = self.left_m_rad * self.left_rad_s
        right_m_s = self.right_m_rad * self.right_rad_s
        return (0.5 * (left_m_s + right_m_s), (right_m_s - left_m_s) / self.track_m)

    def __repr__(self) -> str:
        v, w = self.velocity()
        return f"Body(x={self.x_m!r} y={self.y_m!r} theta={self.theta_rad!r} v={v!r} w={w!r})"
