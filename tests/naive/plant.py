"""The drive in tiny fixed Euler steps, straight from the equations: slow, obvious, no case is solved in closed form.

`NaiveDrive` rolls; `NaiveRoughDrive` may slip, drag its ball, stick, have play in its gears and be pushed.
"""

import math

STEP_TICKS = 4
STEP_S = STEP_TICKS / 24e6
CREEP_RAD_S = 0.05  # below this speed friction is a stiff damper instead of a jump


def winding_voltage(params, drive, current, emf):
    """(voltage on the winding, resistance in the loop) for one bridge; (emf, R) where nothing conducts."""
    supply = params.battery.voltage_v
    reverse = supply + 2 * params.bridge.diode_v
    ohm = params.motor.resistance_ohm + params.battery.resistance_ohm
    driven = supply - params.bridge.drop_v
    up = (driven, ohm + params.bridge.drop_ohm) if drive > 0 else (-reverse, ohm)
    down = (-driven, ohm + params.bridge.drop_ohm) if drive < 0 else (reverse, ohm)
    if current > 0 or (current == 0 and emf < up[0]):
        return up
    if current < 0 or emf > down[0]:
        return down
    return (emf, ohm)


def winding_step(params, drive, current, emf, step_s):
    """Current after one tiny step; a change of sign stops at zero for that step."""
    voltage, ohm = winding_voltage(params, drive, current, emf)
    after = current + step_s * (voltage - emf - ohm * current) / params.motor.inductance_h
    return 0.0 if after * current < 0 else after


def winding_run(params, drive, current, emf, ticks, parts):
    """(current, charge in A * ticks) after `ticks` with the back-EMF held, in `parts` Euler steps a tick."""
    charge = 0.0
    for _ in range(ticks * parts):
        after = winding_step(params, drive, current, emf, 1 / 24e6 / parts)
        charge += 0.5 * (current + after) / parts
        current = after
    return current, charge


class NaiveBridge:
    """What the inputs have asked for lately: the bridge does what they have asked for long enough."""

    def __init__(self, params):
        self.delays = {0: round(params.bridge.on_delay_s * 24e6)}
        self.delays |= dict.fromkeys((-1, 1), round(params.bridge.off_delay_s * 24e6))
        self.drive = 0
        self.wanted, self.since = 0, 0

    def ask(self, tick, wanted):
        self.at(tick)
        if wanted != self.wanted:
            self.wanted, self.since = wanted, tick

    def at(self, tick):
        if self.wanted != self.drive and tick - self.since >= self.delays[self.drive]:
            self.drive = self.wanted
        return self.drive


class NaiveDrive:
    """x, y, theta, the two shaft speeds (rad/s), angles (rad) and currents (A), all advanced together."""

    def __init__(self, params, x=0.0, y=0.0, theta=0.0):
        self.params = params
        self.tick = 0
        self.bridge = [NaiveBridge(params), NaiveBridge(params)]
        self.current = [0.0, 0.0]
        self.speed = [0.0, 0.0]
        self.angle = [0.0, 0.0]
        self.x, self.y, self.theta = x, y, theta
        self.roll = [params.radius_m(side) / params.chassis.gear_ratio for side in (0, 1)]

    def set_bridge(self, tick, side, enable, forward):
        self.advance(tick)
        self.bridge[side].ask(tick, (1 if forward else -1) if enable else 0)

    def advance(self, tick):
        while self.tick < tick:
            self._step()

    def _step(self):
        constant = self.params.motor.torque_constant_nm_a
        torque = [0.0, 0.0]
        for side in (0, 1):
            emf = constant * self.speed[side]
            drive = self.bridge[side].at(self.tick)
            self.current[side] = winding_step(self.params, drive, self.current[side], emf, STEP_S)
            rubbing = max(-1.0, min(1.0, self.speed[side] / CREEP_RAD_S)) * self.params.friction_nm()
            torque[side] = constant * self.current[side] - rubbing
        force = [torque[side] / self.roll[side] for side in (0, 1)]
        acceleration = self._accelerations(force)
        for side in (0, 1):
            self.speed[side] += acceleration[side] * STEP_S
            self.angle[side] += self.speed[side] * STEP_S
        v, w = self.velocity()
        self.theta += w * STEP_S
        self.x += v * math.cos(self.theta) * STEP_S
        self.y += v * math.sin(self.theta) * STEP_S
        self.tick += STEP_TICKS

    def _accelerations(self, force):
        """Newton for the body and both rotors, solved for the two shafts by Cramer's rule."""
        body, rotor = self.params.chassis, self.params.motor.rotor_inertia_kg_m2
        straight, yaw = body.mass_kg / 4, body.yaw_inertia_kg_m2 / body.track_m**2
        left, right = self.roll
        a, b = rotor / left + left * (straight + yaw), right * (straight - yaw)
        c, d = left * (straight - yaw), rotor / right + right * (straight + yaw)
        det = a * d - b * c
        return [(force[0] * d - b * force[1]) / det, (a * force[1] - force[0] * c) / det]

    def velocity(self):
        left, right = (self.roll[side] * self.speed[side] for side in (0, 1))
        return (left + right) / 2, (right - left) / self.params.chassis.track_m


SLIP_M_S = 2e-4  # below this slip a contact is a stiff damper instead of a jump


def smooth_sign(x, width):
    """The sign of x, with a ramp of +-width in the middle."""
    return max(-1.0, min(1.0, x / width))


class NaiveRoughDrive(NaiveDrive):
    """The same with a chassis of its own: tyres that slip, a ball that drags, shafts that stick, a force that pushes.

    `force(tick)` gives (N, Nm). `velocity_m_s` is over the ground, in the axes of the pitch.
    """

    def __init__(self, params, x=0.0, y=0.0, theta=0.0, force=lambda tick: (0.0, 0.0)):
        super().__init__(params, x, y, theta)
        self.force = force
        self.velocity_m_s = [0.0, 0.0]
        self.w = 0.0
        body = params.chassis
        self.play = [0.0, 0.0]
        self.most_play = 0.5 * body.gear_backlash_rad * body.wheel_radius_m
        self.along = [0.0, 0.0]
        self.rolling = 0.5 * body.rolling_resistance * body.mass_kg * 9.81 if self.most_play else 0.0

    def _forward(self):
        vx, vy = self.velocity_m_s
        return vx * math.cos(self.theta) + vy * math.sin(self.theta)

    def _leftward(self):
        vx, vy = self.velocity_m_s
        return vy * math.cos(self.theta) - vx * math.sin(self.theta)

    def velocity(self):
        return self._forward(), self.w

    def _step(self):
        params, body = self.params, self.params.chassis
        weight = body.mass_kg * 9.81
        grip = params.tyre.grip * 0.5 * (1 - params.ball.load_share) * weight
        along, rest, rolling = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        for side in (0, 1):
            hub = self._forward() + (side - 0.5) * body.track_m * self.w
            slip = hub - self.roll[side] * self.speed[side]
            along[side] = self._through_the_teeth(side, slip, -grip * smooth_sign(slip, SLIP_M_S))
            rest[side] = math.sqrt(grip**2 - along[side] ** 2)
            rolling[side] = -self.rolling * smooth_sign(hub, SLIP_M_S)
        sideways = -(rest[0] + rest[1]) * smooth_sign(self._leftward(), SLIP_M_S)
        ball_x, ball_y = self._forward(), self._leftward() - params.ball.behind_m * self.w
        fast = math.hypot(ball_x, ball_y)
        drag = params.ball.friction * params.ball.load_share * weight / max(fast, SLIP_M_S)
        push_n, push_nm = self.force(self.tick)
        self._turn_shafts(along)
        self.along = along
        along = [along[0] + rolling[0], along[1] + rolling[1]]
        forward = along[0] + along[1] - drag * ball_x + push_n
        left = sideways - drag * ball_y
        torque = 0.5 * body.track_m * (along[1] - along[0]) + params.ball.behind_m * drag * ball_y + push_nm
        cosine, sine = math.cos(self.theta), math.sin(self.theta)
        self.velocity_m_s[0] += (forward * cosine - left * sine) / body.mass_kg * STEP_S
        self.velocity_m_s[1] += (forward * sine + left * cosine) / body.mass_kg * STEP_S
        self.w += torque / body.yaw_inertia_kg_m2 * STEP_S
        self.theta += self.w * STEP_S
        self.x += self.velocity_m_s[0] * STEP_S
        self.y += self.velocity_m_s[1] * STEP_S
        self.tick += STEP_TICKS

    def _through_the_teeth(self, side, slip, force):
        """What of a force at the rim goes through the gear: teeth that touch on one side only push."""
        if self.most_play == 0.0:
            return force
        ahead, behind = self.play[side] >= self.most_play, self.play[side] <= -self.most_play
        if (ahead and force > 0) or (behind and force < 0):
            return force
        self.play[side] -= slip * STEP_S
        return 0.0

    def _turn_shafts(self, along):
        constant, ratio = self.params.motor.torque_constant_nm_a, self.params.chassis.stiction_ratio
        for side in (0, 1):
            emf = constant * self.speed[side]
            drive = self.bridge[side].at(self.tick)
            self.current[side] = winding_step(self.params, drive, self.current[side], emf, STEP_S)
            standing = abs(self.speed[side]) < CREEP_RAD_S
            friction = self.params.friction_nm() - self.rolling * self.roll[side]
            most = friction * (ratio if standing else 1.0)
            most += self.params.chassis.gear_load_friction * abs(self.roll[side] * along[side])
            rubbing = most * smooth_sign(self.speed[side], CREEP_RAD_S)
            torque = constant * self.current[side] - rubbing - self.roll[side] * along[side]
            self.speed[side] += torque / self.params.motor.rotor_inertia_kg_m2 * STEP_S
            self.angle[side] += self.speed[side] * STEP_S


def quadrature_edges(start, moved, start_tick, ticks):
    """[(tick, count)] of a shaft that goes evenly from `start` by `moved` counts, by looking at every tick."""
    edges = []
    count = math.floor(start)
    for tick in range(1, ticks + 1):
        now = math.floor(start + moved * tick / ticks)
        while count != now:
            count += 1 if now > count else -1
            edges.append((start_tick + tick, count))
    return edges
