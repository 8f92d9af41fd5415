# cython: cdivision=True
# No divisor below is ever zero: masses, inertias and lengths are positive, and so is what `_drag` divides by.
"""The robot where `chassis` is too kind: wheels slip, a ball drags, shafts stick, gears have play, a force pushes.

    motor --> shaft (inertia, Coulomb friction) --c--> contact (grip times load) --> chassis <-- ball, disturbing force

A step adds the impulses of motors and disturbance, and then looks for the friction impulses that leave the least
kinetic energy (maximum dissipation), each within its bound:

    shaft    friction * time, times the stiction ratio if the shaft stood when the step began; to this comes
             `gear_load_friction` times the torque through the gear, its mean over about a PWM period before the step
    contact  grip * load of the wheel * time, along the wheel; nothing while the gear is inside its backlash, and
             nothing that would pull where the teeth touch on one side
    axle     sideways, both wheels together: what the friction circle leaves beside the force along the wheel, which is
             taken from the step before
    ball     friction * load of the ball * time, in any direction; against its way over the ground

First the body rolls, as `chassis.Body` does: two speeds, in closed form. If contacts and axle can give the impulses
that this takes, they are the ones of least energy. While no wheel slips, all bits of the way are those of `Body`.

Else the velocity turns into the new heading, and a few sweeps go over wheel, wheel, ball and axle, until one changes
nothing; each part is solved exactly while the others hold still, so each lowers the energy: friction never drives. What
ends inside its bounds ends at exactly zero. A ball that drags always takes the sweeps. A wheel without `grip` has all
that it needs. Loads are those of the robot at rest: half each of what the ball does not carry.

Backlash: the wheel has no mass, so while the teeth do not touch it goes with the ground and the shaft turns alone.
Teeth that touch again do not bounce. They touch at the end of the step in which the play is used up, at most one
step late.
"""

from __future__ import annotations

import math

from miro_exact import dmath
from miro_exact.rng import Stream
from miro_sim.plant.chassis import Body
from miro_sim.plant.params import GRAVITY_M_S2, Disturbance, DriveParams

TURN = 6.283185307179586
TICKS_PER_S = 24e6
TICK_S = 1.0 / TICKS_PER_S
PWM_TICKS = 2048.0
SWEEPS = 12
_ANGLES = 1.6e6  # `dmath.ANGLE_LIMIT`
NEWTON_STEPS = 8
NEAR = 1.0 - 1e-13
ALL_GRIP_N = 1e30
_SPEED_M_S = ("d", -1e6, 1e6)
_FORCE_N = ("d", -1e30, 1e30)


class DisturbingForce:
    """A disturbance of a body: `at` puts force (N, forward) and torque (Nm, counter-clockwise) of a tick into its
    fields.

    Noise is uniform within +- its bound and holds for a period: draws 2 k (force) and 2 k + 1 (torque) in period k.
    """

    NOT_STATE = ("*",)

    def __init__(self, params: Disturbance, stream: Stream) -> None:
        self.stream = stream
        self.period_ticks = int(params.period_s * TICKS_PER_S + 0.5)
        self.constant_n = params.force_n
        self.constant_nm = params.torque_nm
        self.sine_n = params.sine_force_n
        self.sine_nm = params.sine_torque_nm
        self.noise_n = params.noise_force_n
        self.noise_nm = params.noise_torque_nm
        self.is_on = params.is_on()
        self.varies = self.sine_n != 0.0 or self.sine_nm != 0.0
        self.force_n = 0.0
        self.torque_nm = 0.0

    def at(self, tick: int) -> None:
        """Works out both for this tick."""
        if not self.is_on:
            return
        force = self.constant_n
        torque = self.constant_nm
        if self.varies:
            share = float(tick % self.period_ticks) / float(self.period_ticks)
            sine, _ = dmath.sincos(TURN * share)
            force = force + self.sine_n * sine
            torque = torque + self.sine_nm * sine
        if self.noise_n != 0.0 or self.noise_nm != 0.0:
            period = tick // self.period_ticks
            force = force + self.noise_n * (2.0 * self.stream.uniform(2 * period) - 1.0)
            torque = torque + self.noise_nm * (2.0 * self.stream.uniform(2 * period + 1) - 1.0)
        self.force_n = force
        self.torque_nm = torque

    def __repr__(self) -> str:
        return f"DisturbingForce({self.force_n!r} N, {self.torque_nm!r} Nm)"


class RoughBody(Body):
    """`v_m_s` forward, `u_m_s` to the left, `w_rad_s` counter-clockwise; forces are those along the two wheels."""

    STATE = {
        "v_m_s": _SPEED_M_S,
        "u_m_s": _SPEED_M_S,
        "w_rad_s": _SPEED_M_S,
        "left_force_n": _FORCE_N,
        "right_force_n": _FORCE_N,
        "left_load_n": _FORCE_N,
        "right_load_n": _FORCE_N,
        "left_play_m": ("d", -1e6, 1e6),
        "right_play_m": ("d", -1e6, 1e6),
    }
    NOT_STATE = (
        *("forces", "half_track_m", "stiction_ratio", "load_friction", "play_m", "rolling_n"),
        *("grip_n", "ball_n", "ball_m"),
        *("mass_kg", "yaw_kg_m2", "rotor_kg_m2", "hub_per_kg", "ball_x_per_kg", "ball_y_per_kg"),
        *("_rub_nms", "_push_ns", "_ball_x_ns", "_ball_y_ns", "_ball_z"),
        *("forward_m", "leftward_m", "turned_rad"),
    )

    def __init__(
        self, params: DriveParams, x_m: float, y_m: float, theta_rad: float, noise: Stream | None = None
    ) -> None:
        super().__init__(params, x_m, y_m, theta_rad)
        body = params.chassis
        weight_n = body.mass_kg * GRAVITY_M_S2
        self.forces = DisturbingForce(
            params.disturbance, Stream(0, "disturbance") if noise is None else noise
        )
        self.half_track_m = 0.5 * body.track_m
        self.stiction_ratio = body.stiction_ratio
        self.load_friction = body.gear_load_friction
        self.play_m = 0.5 * body.gear_backlash_rad * body.wheel_radius_m  # to either side, at the rim
        self.rolling_n = 0.0
        if self.play_m > 0.0:  # the resistance of a wheel that the shaft may leave alone acts on the wheel
            self.rolling_n = 0.5 * body.rolling_resistance * weight_n
            self.friction_nm -= self.rolling_n * body.wheel_radius_m / body.gear_ratio
        on_wheel_n = 0.5 * (1.0 - params.ball.load_share) * weight_n
        self.grip_n = ALL_GRIP_N if params.tyre.grip is None else params.tyre.grip * on_wheel_n
        self.ball_n = params.ball.friction * params.ball.load_share * weight_n
        self.ball_m = -params.ball.behind_m
        self.mass_kg = body.mass_kg
        self.yaw_kg_m2 = body.yaw_inertia_kg_m2
        self.rotor_kg_m2 = params.motor.rotor_inertia_kg_m2
        self.hub_per_kg = 1.0 / self.mass_kg + self.half_track_m * self.half_track_m / self.yaw_kg_m2
        self.ball_x_per_kg = 1.0 / self.mass_kg
        self.ball_y_per_kg = 1.0 / self.mass_kg + self.ball_m * self.ball_m / self.yaw_kg_m2
        self.v_m_s = 0.0
        self.u_m_s = 0.0
        self.w_rad_s = 0.0
        self.left_force_n = 0.0
        self.right_force_n = 0.0
        self.left_load_n = 0.0  # mean of `left_force_n`, for the friction of the gear
        self.right_load_n = 0.0
        self.left_play_m = 0.0  # by how much the shaft is ahead of the middle of its play, at the rim
        self.right_play_m = 0.0
        self._rub_nms = 0.0
        self._push_ns = 0.0
        self._ball_x_ns = 0.0
        self._ball_y_ns = 0.0
        self._ball_z = 0.0
        self.forward_m = [0.0] * 16  # the ways of the last pushes, in the robot's own axes
        self.leftward_m = [0.0] * 16
        self.turned_rad = [0.0] * 16

    def stands(self) -> bool:
        """True if steps change nothing while no motor drives: nothing moves, pushes or is about to relax."""
        still = self.v_m_s == 0.0 and self.u_m_s == 0.0 and self.w_rad_s == 0.0 and not self.forces.is_on
        forceless = self.left_force_n == 0.0 and self.right_force_n == 0.0
        return still and forceless and self.left_load_n == 0.0 and self.right_load_n == 0.0

    def _push(self, left_nms: float, right_nms: float, ticks: int, step: int) -> None:
        """Applies motor impulses, disturbance and friction over `ticks`; the way at the mean of old and new speed."""
        step_s = TICK_S * ticks
        half_s = 0.5 * step_s
        old_left = self.left_rad_s
        old_right = self.right_rad_s
        old_v = self.v_m_s
        old_u = self.u_m_s
        old_w = self.w_rad_s
        left_rim = self.left_m_rad * old_left
        right_rim = self.right_m_rad * old_right
        rolling_v = 0.5 * (left_rim + right_rim)
        rolling_w = (right_rim - left_rim) / self.track_m
        rolls = old_v == rolling_v and old_w == rolling_w and old_u == 0.0
        most_left = step_s * self.friction_nm * (self.stiction_ratio if old_left == 0.0 else 1.0)
        most_right = step_s * self.friction_nm * (self.stiction_ratio if old_right == 0.0 else 1.0)
        most_left += step_s * self.left_brake_nm
        most_right += step_s * self.right_brake_nm
        if self.load_friction > 0.0:
            most_left += step_s * self.load_friction * abs(self.left_m_rad * self.left_load_n)
            most_right += step_s * self.load_friction * abs(self.right_m_rad * self.right_load_n)
        if old_u != 0.0:
            self._turn_frame(half_s * old_w)
            aside = self.u_m_s
        else:  # on its arc a body that does not slide sideways loses no speed
            aside = -step_s * old_w * old_v
        if self.forces.is_on:
            self.v_m_s += step_s * self.forces.force_n / self.mass_kg
            self.w_rad_s += step_s * self.forces.torque_nm / self.yaw_kg_m2
        if self.rolling_n > 0.0:
            self._resist(-self.half_track_m, step_s)
            self._resist(self.half_track_m, step_s)
        more_v = self.v_m_s - rolling_v
        more_w = self.w_rad_s - rolling_w
        if self.ball_n > 0.0 or not self._roll_on(
            left_nms, right_nms, most_left, most_right, more_v, more_w, aside, step_s
        ):
            rolls = False
            if old_u == 0.0:
                self._turn_frame(half_s * old_w)
            self.left_rad_s = old_left + left_nms / self.rotor_kg_m2
            self.right_rad_s = old_right + right_nms / self.rotor_kg_m2
            self._dissipate(most_left, most_right, step_s)
        if self.load_friction > 0.0:
            share = float(ticks) / PWM_TICKS
            self.left_load_n += share * (self.left_force_n - self.left_load_n)
            self.right_load_n += share * (self.right_force_n - self.right_load_n)
        if self.play_m > 0.0:
            left_slip, right_slip = self.slips_m_s()
            if self.left_force_n == 0.0:
                self.left_play_m -= half_s * (old_v - self.half_track_m * old_w - left_rim + left_slip)
            if self.right_force_n == 0.0:
                self.right_play_m -= half_s * (old_v + self.half_track_m * old_w - right_rim + right_slip)
        left_rad = half_s * (old_left + self.left_rad_s)
        right_rad = half_s * (old_right + self.right_rad_s)
        self.turned_left_rad[step] = left_rad
        self.turned_right_rad[step] = right_rad
        if rolls:  # with the bits of `Body._roll`
            left_m = self.left_m_rad * left_rad
            right_m = self.right_m_rad * right_rad
            self.forward_m[step] = 0.5 * (left_m + right_m)
            self.leftward_m[step] = 0.0
            self.turned_rad[step] = (right_m - left_m) / self.track_m
        else:
            self.forward_m[step] = half_s * (old_v + self.v_m_s)
            self.leftward_m[step] = half_s * (old_u + self.u_m_s)
            self.turned_rad[step] = half_s * (old_w + self.w_rad_s)

    def _roll_on(
        self,
        left_nms: float,
        right_nms: float,
        most_left: float,
        most_right: float,
        more_v: float,
        more_w: float,
        aside: float,
        step_s: float,
    ) -> bool:
        """Rolls, if contacts and axle can give the impulses for it; else leaves all but the shafts as it was.

        `more_v` and `more_w` are what the chassis has beyond its wheels, `aside` the speed that the axle has to stop.
        """
        if more_v != 0.0 or more_w != 0.0:
            along = 0.5 * self.mass_kg * more_v
            across = self.yaw_kg_m2 * more_w / self.track_m
            left_nms += self.left_m_rad * (along - across)
            right_nms += self.right_m_rad * (along + across)
        self._slide(
            self.left_rad_s + self.inverse_ll * left_nms + self.inverse_lr * right_nms,
            self.right_rad_s + self.inverse_lr * left_nms + self.inverse_rr * right_nms,
            most_left,
            most_right,
        )
        left_rim = self.left_m_rad * self.left_rad_s
        right_rim = self.right_m_rad * self.right_rad_s
        v = 0.5 * (left_rim + right_rim)
        w = (right_rim - left_rim) / self.track_m
        along = 0.5 * self.mass_kg * (v - self.v_m_s)
        across = self.yaw_kg_m2 * (w - self.w_rad_s) / self.track_m
        left_n = (along - across) / step_s + 0.0  # no -0.0: a step of a robot at rest changes no bit
        right_n = (along + across) / step_s + 0.0
        axle = self._grip_left_n(self.left_force_n) + self._grip_left_n(self.right_force_n)
        if not (
            self._most_back_n(self.left_play_m) <= left_n <= self._most_ahead_n(self.left_play_m)
            and self._most_back_n(self.right_play_m) <= right_n <= self._most_ahead_n(self.right_play_m)
            and self.mass_kg * abs(aside) <= axle * step_s
        ):
            return False
        self.left_force_n = left_n
        self.right_force_n = right_n
        self.v_m_s = v
        self.u_m_s = 0.0
        self.w_rad_s = w
        return True

    def _roll(self, steps: int) -> None:
        """Moves the posture along the arcs of the ways of these pushes; the axes turn on the way."""
        x_m = self.x_m
        y_m = self.y_m
        theta_rad = self.theta_rad
        for step in range(steps):
            turned = self.turned_rad[step]
            half = 0.5 * turned
            shrink = 1.0 - half * half / 6.0
            forward = self.forward_m[step] * shrink
            leftward = self.leftward_m[step] * shrink
            if forward == 0.0 and leftward == 0.0 and turned == 0.0:
                continue
            angle = theta_rad + half
            if not -_ANGLES < angle < _ANGLES:
                dmath.sincos(angle)  # raises DomainError
            sine, cosine = dmath.sincos_within(angle)
            x_m = x_m + (forward * cosine - leftward * sine)
            y_m = y_m + (forward * sine + leftward * cosine)
            theta_rad = theta_rad + turned
        self.x_m = x_m
        self.y_m = y_m
        self.theta_rad = theta_rad

    def _resist(self, lever_m: float, step_s: float) -> None:
        """Rolling resistance of the wheel at `lever_m` to the right of the middle."""
        most = self.rolling_n * step_s
        hub = self.v_m_s + lever_m * self.w_rad_s
        self._move(min(most, max(-most, -hub / self.hub_per_kg)), lever_m)

    def _turn_frame(self, tangent: float) -> None:
        """The velocity over the ground as the axes see it that have turned; a rotation, so energy stays."""
        if tangent == 0.0 or (self.v_m_s == 0.0 and self.u_m_s == 0.0):
            return
        squares = 1.0 + tangent * tangent
        cosine = (1.0 - tangent * tangent) / squares
        sine = 2.0 * tangent / squares
        v = self.v_m_s
        u = self.u_m_s
        self.v_m_s = cosine * v + sine * u
        self.u_m_s = cosine * u - sine * v

    def _dissipate(self, most_left: float, most_right: float, step_s: float) -> None:
        """Friction impulses of one step, by sweeps from one part to the next."""
        axle = step_s * (self._grip_left_n(self.left_force_n) + self._grip_left_n(self.right_force_n))
        left_rub = right_rub = left_push = right_push = sideways = 0.0
        left_back = step_s * self._most_back_n(self.left_play_m)
        left_ahead = step_s * self._most_ahead_n(self.left_play_m)
        right_back = step_s * self._most_back_n(self.right_play_m)
        right_ahead = step_s * self._most_ahead_n(self.right_play_m)
        most_ball = self.ball_n * step_s
        self._ball_x_ns = 0.0
        self._ball_y_ns = 0.0
        self._ball_z = 0.0
        inertia = self.rotor_kg_m2
        for _ in range(SWEEPS):
            hub = self.v_m_s - self.half_track_m * self.w_rad_s
            self._wheel(
                hub, self.left_rad_s, self.left_m_rad, left_rub, left_push, most_left, left_back, left_ahead
            )
            self._move(self._push_ns - left_push, -self.half_track_m)
            self.left_rad_s += (
                self._rub_nms - left_rub - self.left_m_rad * (self._push_ns - left_push)
            ) / inertia
            changed = abs(self._rub_nms - left_rub) + abs(self._push_ns - left_push)
            left_rub = self._rub_nms
            left_push = self._push_ns
            hub = self.v_m_s + self.half_track_m * self.w_rad_s
            self._wheel(
                hub,
                self.right_rad_s,
                self.right_m_rad,
                right_rub,
                right_push,
                most_right,
                right_back,
                right_ahead,
            )
            self._move(self._push_ns - right_push, self.half_track_m)
            self.right_rad_s += (
                self._rub_nms - right_rub - self.right_m_rad * (self._push_ns - right_push)
            ) / inertia
            changed += abs(self._rub_nms - right_rub) + abs(self._push_ns - right_push)
            right_rub = self._rub_nms
            right_push = self._push_ns
            if most_ball > 0.0:
                changed += self._drag(most_ball)
            before = sideways
            sideways = min(axle, max(-axle, before - self.mass_kg * self.u_m_s))
            self.u_m_s = self.u_m_s + (sideways - before) / self.mass_kg
            if changed + abs(sideways - before) == 0.0:
                break
        self.left_force_n = left_push / step_s + 0.0  # no -0.0, as in `_roll_on`
        self.right_force_n = right_push / step_s + 0.0
        if -axle < sideways < axle:
            self.u_m_s = 0.0
        left_stands = -most_left < left_rub < most_left
        right_stands = -most_right < right_rub < most_right
        if left_stands:
            self.left_rad_s = 0.0
        if right_stands:
            self.right_rad_s = 0.0
        left_held = left_stands and left_back < left_push < left_ahead
        if left_held and right_stands and right_back < right_push < right_ahead:
            self.v_m_s = 0.0
            self.w_rad_s = 0.0

    def _most_back_n(self, play_m: float) -> float:
        """The least force along a wheel, by its grip and its teeth."""
        return -self.grip_n if play_m <= -self.play_m else 0.0

    def _most_ahead_n(self, play_m: float) -> float:
        """The largest."""
        return self.grip_n if play_m >= self.play_m else 0.0

    def _grip_left_n(self, along_n: float) -> float:
        """The remaining sideways grip in a wheel's friction circle, in N."""
        rest = (self.grip_n - along_n) * (self.grip_n + along_n)
        return math.sqrt(rest) if rest > 0.0 else 0.0

    def _move(self, push_ns: float, lever_m: float) -> None:
        """A forward impulse on the chassis at `lever_m` to the right of the middle."""
        self.v_m_s = self.v_m_s + push_ns / self.mass_kg
        self.w_rad_s = self.w_rad_s + lever_m * push_ns / self.yaw_kg_m2

    def _wheel(
        self,
        hub: float,
        shaft: float,
        roll: float,
        rub: float,
        push: float,
        most: float,
        back: float,
        ahead: float,
    ) -> None:
        """Friction of a shaft (Nms) and push of its wheel (Ns, on the chassis) that leave the least energy.

        `hub` (m/s) and `shaft` (rad/s) are the speeds with the impulses `rub` and `push` so far. A corner, an edge or
        the inside of the box |rub| <= most, back <= push <= ahead: where the signs of what is left agree, that is it.
        """
        inertia = self.rotor_kg_m2
        free_hub = hub - self.hub_per_kg * push
        free_shaft = shaft - (rub - roll * push) / inertia
        self._push_ns = -free_hub / self.hub_per_kg
        self._rub_nms = roll * self._push_ns - inertia * free_shaft
        if back <= self._push_ns <= ahead and -most <= self._rub_nms <= most:
            return  # both stand
        slip_per_ns = self.hub_per_kg + roll * roll / inertia
        self._rub_nms = -most if free_shaft >= 0.0 else most
        for _ in range(2):
            turning = free_shaft + self._rub_nms / inertia
            self._push_ns = min(ahead, max(back, (roll * turning - free_hub) / slip_per_ns))
            if (turning - roll * self._push_ns / inertia) * self._rub_nms <= 0.0:
                return  # the shaft turns against its friction
            self._rub_nms = -self._rub_nms
        self._push_ns = ahead if free_hub < 0.0 else back
        self._rub_nms = roll * self._push_ns - inertia * free_shaft
        if -most <= self._rub_nms <= most:
            return  # the shaft stands, the wheel slides
        self._rub_nms = rub  # rounding at an edge: as it was
        self._push_ns = push

    def _drag(self, most: float) -> float:
        """Applies the ball's impulse (Ns) that leaves the least energy within the circle of `most`. Returns its change.

        Outside of it the answer is p / (a + z) for the z that puts it on the circle: Newton's method on 1 / length,
        which is nearly straight (More and Sorensen 1983), from the z of the sweep before.
        """
        x_per_kg = self.ball_x_per_kg
        y_per_kg = self.ball_y_per_kg
        free_x = self.v_m_s - x_per_kg * self._ball_x_ns
        free_y = self.u_m_s + self.ball_m * self.w_rad_s - y_per_kg * self._ball_y_ns
        x = -free_x / x_per_kg
        y = -free_y / y_per_kg
        if x * x + y * y > most * most:
            z = self._ball_z
            x = -free_x / (x_per_kg + z)
            y = -free_y / (y_per_kg + z)
            length = math.sqrt(x * x + y * y)
            for _ in range(NEWTON_STEPS):
                if NEAR * most <= length <= most:
                    break
                fall = x * x / (x_per_kg + z) + y * y / (y_per_kg + z)
                z = max(0.0, z + (length / most - 1.0) * length * length / fall)
                x = -free_x / (x_per_kg + z)
                y = -free_y / (y_per_kg + z)
                length = math.sqrt(x * x + y * y)
            if length > most:
                x = x * (most / length)
                y = y * (most / length)
            self._ball_z = z
        more_x = x - self._ball_x_ns
        more_y = y - self._ball_y_ns
        self.v_m_s = self.v_m_s + more_x / self.mass_kg
        self.u_m_s = self.u_m_s + more_y / self.mass_kg
        self.w_rad_s = self.w_rad_s + self.ball_m * more_y / self.yaw_kg_m2
        self._ball_x_ns = x
        self._ball_y_ns = y
        return abs(more_x) + abs(more_y)

    def pose_after(self, ticks: int) -> tuple[float, float, float]:
        """Posture (m, m, rad) `ticks` after the last push at the speeds of now; changes nothing."""
        time_s = TICK_S * ticks
        half = 0.5 * self.w_rad_s * time_s
        way_s = time_s * (1.0 - half * half / 6.0)
        sine, cosine = dmath.sincos(self.theta_rad + half)
        return (
            self.x_m + way_s * (self.v_m_s * cosine - self.u_m_s * sine),
            self.y_m + way_s * (self.v_m_s * sine + self.u_m_s * cosine),
            self.theta_rad + 2.0 * half,
        )

    def velocity(self) -> tuple[float, float]:
        """(m/s forward, rad/s counter-clockwise) of the chassis, whatever the wheels do."""
        return (self.v_m_s, self.w_rad_s)

    def slips_m_s(self) -> tuple[float, float]:
        """By how much the chassis runs ahead of its left and right wheel, along the wheel."""
        left = self.v_m_s - self.half_track_m * self.w_rad_s - self.left_m_rad * self.left_rad_s
        right = self.v_m_s + self.half_track_m * self.w_rad_s - self.right_m_rad * self.right_rad_s
        return (left, right)

    def __repr__(self) -> str:
        left, right = self.slips_m_s()
        return f"Rough{super().__repr__()[:-1]} u={self.u_m_s!r} slips=({left!r}, {right!r}))"
