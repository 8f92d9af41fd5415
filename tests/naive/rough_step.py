"""One step of a body with friction, from the equations: the impulses of least kinetic energy, one at a time.

Least energy is what maximum dissipation means. Energy is a convex function of the impulses, so going down along one
impulse after the other, each as far as its bounds let it, comes to the bottom in the end: slow, obvious, no case.
"""

import math
from typing import NamedTuple

TURNS = 400
TICK_S = 1 / 24e6


class Motion(NamedTuple):
    """Shafts (rad/s), chassis in its own axes (m/s forward, m/s to the left, rad/s counter-clockwise)."""

    left: float
    right: float
    v: float
    u: float
    w: float


def step(params, before, impulses, ticks, forces=(0.0, 0.0), loads=(0.0, 0.0), plays=(0.0, 0.0)):
    """(motion after it, forces along the two wheels).

    Of the step before: the `forces` along the wheels, their means `loads`, and by how much each shaft is ahead of the
    middle of its play (m at the rim).
    """
    body, time_s = params.chassis, ticks * TICK_S
    weight = body.mass_kg * 9.81
    ball_n = params.ball.friction * params.ball.load_share * weight
    grip_n = (
        1e30 if params.tyre.grip is None else params.tyre.grip * (1 - params.ball.load_share) * weight / 2
    )
    rotor, half_m = params.motor.rotor_inertia_kg_m2, body.track_m / 2
    roll = [params.radius_m(side) / body.gear_ratio for side in (0, 1)]
    half_play = body.gear_backlash_rad * body.wheel_radius_m / 2
    rolling_n = body.rolling_resistance * weight / 2 if half_play else 0.0

    # The axes turn, the velocity over the ground does not; motors and disturbance push.
    cosine, sine = math.cos(before.w * time_s), math.sin(before.w * time_s)
    now = {
        "left": before.left + impulses[0] / rotor,
        "right": before.right + impulses[1] / rotor,
        "v": cosine * before.v + sine * before.u + params.disturbance.force_n * time_s / body.mass_kg,
        "u": cosine * before.u - sine * before.v,
        "w": before.w + params.disturbance.torque_nm * time_s / body.yaw_inertia_kg_m2,
    }
    mass = {"left": rotor, "right": rotor, "v": body.mass_kg, "u": body.mass_kg, "w": body.yaw_inertia_kg_m2}

    for side in (0, 1):  # with play the resistance is on the wheel, and comes first
        arm = {"v": 1.0, "w": (-half_m, half_m)[side]}
        _go_down(now, mass, arm, 0.0, rolling_n * time_s, -rolling_n * time_s)

    # Each friction: which velocities an impulse of 1 changes, its bounds, and the impulse so far.
    parts = []
    for side, shaft in enumerate(("left", "right")):
        friction = params.friction_nm() - rolling_n * roll[side]
        friction *= body.stiction_ratio if before[side] == 0.0 else 1.0
        friction += body.gear_load_friction * abs(roll[side] * loads[side])
        parts.append([{shaft: 1.0}, friction * time_s, -friction * time_s, 0.0])
        ahead = grip_n if plays[side] >= half_play else 0.0
        back = grip_n if plays[side] <= -half_play else 0.0
        wheel = {shaft: -roll[side], "v": 1.0, "w": (-half_m, half_m)[side]}
        parts.append([wheel, ahead * time_s, -back * time_s, 0.0])
    axle = math.fsum(math.sqrt(max(0.0, grip_n * grip_n - force * force)) for force in forces) * time_s
    parts.append([{"u": 1.0}, axle, -axle, 0.0])
    ball = [0.0, 0.0]
    for _ in range(TURNS):
        changed = 0.0
        for part in parts:
            after = _go_down(now, mass, part[0], part[3], part[1], part[2])
            changed, part[3] = max(changed, abs(after - part[3])), after
        if ball_n:
            changed = max(changed, _drag(now, mass, ball, ball_n * time_s, params.ball.behind_m))
        if changed < 1e-19:
            break
    return Motion(**now), (parts[1][3] / time_s, parts[3][3] / time_s)


def _go_down(now, mass, arm, impulse, most, least):
    """Changes one impulse to where energy is least within its bounds, and the velocities with it; returns it."""
    slip = math.fsum(share * now[name] for name, share in arm.items())
    per_impulse = math.fsum(share * share / mass[name] for name, share in arm.items())
    after = min(most, max(least, impulse - slip / per_impulse))
    for name, share in arm.items():
        now[name] += share * (after - impulse) / mass[name]
    return after


def _drag(now, mass, ball, most, behind_m):
    """A move of the ball's impulse downhill, back into its circle; returns by how much it changed."""
    over_ground = (now["v"], now["u"] - behind_m * now["w"])
    short = 1 / (1 / mass["v"] + behind_m * behind_m / mass["w"])  # no longer than the steepest way needs
    wanted = [ball[axis] - short * over_ground[axis] for axis in (0, 1)]
    length = math.hypot(*wanted)
    wanted = [each * min(1.0, most / length) if length else 0.0 for each in wanted]
    x, y = wanted[0] - ball[0], wanted[1] - ball[1]
    ball[:] = wanted
    now["v"] += x / mass["v"]
    now["u"] += y / mass["u"]
    now["w"] -= behind_m * y / mass["w"]
    return max(abs(x), abs(y))
