"""The drive in tiny fixed Euler steps, straight from the equations: slow, obvious, no case is solved in closed form."""

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


class NaiveDrive:
    """x, y, theta, the two shaft speeds (rad/s), angles (rad) and currents (A), all advanced together."""

    def __init__(self, params, x=0.0, y=0.0, theta=0.0):
        self.params = params
        self.tick = 0
        self.drive = [0, 0]
        self.current = [0.0, 0.0]
        self.speed = [0.0, 0.0]
        self.angle = [0.0, 0.0]
        self.x, self.y, self.theta = x, y, theta
        self.roll = [params.radius_m(side) / params.chassis.gear_ratio for side in (0, 1)]

    def set_bridge(self, tick, side, enable, forward):
        self.advance(tick)
        self.drive[side] = (1 if forward else -1) if enable else 0

    def advance(self, tick):
        while self.tick < tick:
            self._step()

    def _step(self):
        constant = self.params.motor.torque_constant_nm_a
        torque = [0.0, 0.0]
        for side in (0, 1):
            emf = constant * self.speed[side]
            self.current[side] = winding_step(self.params, self.drive[side], self.current[side], emf, STEP_S)
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
