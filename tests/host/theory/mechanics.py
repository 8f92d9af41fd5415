"""Equations (1) to (10), (14) and (15): systems with nonholonomic constraints, and the paper's robot as one of them.

    (1)  A q' = 0        (2)  A S = 0        (4)  q' = S z        (5)  q'' = S z' + S' z
    (3)  M q'' + V = E tau - A^T lambda
    (6)  S^T (M S z' + M S' z + V) = S^T E tau
    (7)  H z' + G = tau,   H = (S^T E)^-1 S^T M S,   G = (S^T E)^-1 S^T (M S' z + V)
    (10) H z' + G + tau_d = tau      (14) tau = H z_r' + G + H u      (15) z' + f = z_r' + u,  tau_d = H f

With n coordinates and m constraints, H is (n-m) x (n-m). The paper calls G and tau (n-m) x m matrices; by (7) they are
columns of n-m numbers, which for its robot, m = 1, is the same.

The paper prints S for Cartesian and for polar coordinates, (8) and (9), and leaves M, V and E open. They are those of a
rigid body whose centre of mass lies in the middle between its wheels; tau = (tau_l, tau_r) is the torque at the wheels.
In polar coordinates M and V follow from the kinetic energy m (rho'^2 + rho^2 phi'^2) / 2 + J theta'^2 / 2.

f = H^-1 tau_d exists for any tau_d, as the paper says, because H is regular. That f is bounded by a number known
beforehand does not follow where the model itself is wrong: with the model's H^ in (14) and the real H in (10),
f = (1 - H^-1 H^) (z_r' + u) + H^-1 tau_d contains u, and so the gain P that is to exceed it.
"""

import math
from typing import NamedTuple

import msgspec
import numpy as np


class System(NamedTuple):
    """A system at one instant: M (n x n), V (n), E (n x r), A (m x n), S (n x (n-m)) and S' along its motion.

    The paper assumes r = n - m.
    """

    inertia: np.ndarray
    force: np.ndarray
    inputs: np.ndarray
    constraints: np.ndarray
    directions: np.ndarray
    directions_rate: np.ndarray


def reduced(system, z):
    """H and G of equation (7) at the velocities z. ValueError where S^T E is singular: an input is missing."""
    m, v, e, _, s, s_rate = system
    through = s.T @ e
    return np.linalg.solve(through, s.T @ m @ s), np.linalg.solve(through, s.T @ (m @ s_rate @ z + v))


def acceleration(system, z, z_dot):
    """q'' of equation (5)."""
    return system.directions @ z_dot + system.directions_rate @ z


def constraint_forces(system, z, z_dot, torque):
    """lambda of equation (3): what the constraints do to keep (1), from A A^T lambda = A (E tau - M q'' - V)."""
    a = system.constraints
    return np.linalg.solve(a @ a.T, a @ without_constraint(system, z, z_dot, torque))


def without_constraint(system, z, z_dot, torque):
    """E tau - M q'' - V: what only the constraints can balance."""
    return system.inputs @ torque - system.inertia @ acceleration(system, z, z_dot) - system.force


class UnicycleBody(msgspec.Struct, frozen=True, kw_only=True):
    """What the robot weighs and how it stands on its wheels."""

    mass_kg: float
    yaw_inertia_kg_m2: float
    wheel_radius_m: float
    track_m: float


ROBOT = UnicycleBody(mass_kg=0.5, yaw_inertia_kg_m2=4.7e-4, wheel_radius_m=0.020, track_m=0.068)
HEAVY = msgspec.structs.replace(ROBOT, mass_kg=0.6)


def inertia(body):
    """H of equation (7), written out: wheel torques for v' = 1 m/s2 (first column) and w' = 1 rad/s2 (second)."""
    forward = 0.5 * body.wheel_radius_m * body.mass_kg
    turn = body.wheel_radius_m * body.yaw_inertia_kg_m2 / body.track_m
    return np.array([[forward, -turn], [forward, turn]])


def accelerated(body, torque):
    """z' by Newton's and Euler's law: m v' = (tau_l + tau_r) / r and J w' = (tau_r - tau_l) b / 2 r."""
    (left, right), r = torque, body.wheel_radius_m
    w_dot = (right - left) * body.track_m / (2.0 * r * body.yaw_inertia_kg_m2)
    return np.array([(left + right) / (body.mass_kg * r), w_dot])


def cartesian_rates(q, z):
    """q' of equation (8); q = (x, y, theta), z = (v, w)."""
    return np.array([z[0] * math.cos(q[2]), z[0] * math.sin(q[2]), z[1]])


def polar_rates(q, z):
    """q' of equation (9); q = (rho, phi, theta), z = (v, w). ZeroDivisionError in the origin."""
    angle = q[1] - q[2]
    return np.array([z[0] * math.cos(angle), -(z[0] / q[0]) * math.sin(angle), z[1]])


def cartesian(body, q, z):
    """The robot at q = (x, y, theta) in m and rad with z = (v, w)."""
    sin, cos = math.sin(q[2]), math.cos(q[2])
    w, r, arm = z[1], body.wheel_radius_m, 0.5 * body.track_m
    return System(
        inertia=np.diag([body.mass_kg, body.mass_kg, body.yaw_inertia_kg_m2]),
        force=np.zeros(3),
        inputs=np.array([[cos, cos], [sin, sin], [-arm, arm]]) / r,
        constraints=np.array([[-sin, cos, 0.0]]),
        directions=np.array([[cos, 0.0], [sin, 0.0], [0.0, 1.0]]),
        directions_rate=np.array([[-sin * w, 0.0], [cos * w, 0.0], [0.0, 0.0]]),
    )


def polar(body, q, z):
    """The same at q = (rho, phi, theta), rho > 0. The constraint is that of (8) in these coordinates."""
    rho, r, arm, mass = q[0], body.wheel_radius_m, 0.5 * body.track_m, body.mass_kg
    sin, cos = math.sin(q[1] - q[2]), math.cos(q[1] - q[2])
    rho_rate, phi_rate, w = polar_rates(q, z)
    turn = phi_rate - w  # of phi - theta
    slip = -cos * turn / rho + sin * rho_rate / (rho * rho)
    return System(
        inertia=np.diag([mass, mass * rho * rho, body.yaw_inertia_kg_m2]),
        force=np.array([-mass * rho * phi_rate * phi_rate, 2.0 * mass * rho * rho_rate * phi_rate, 0.0]),
        inputs=np.array([[cos, cos], [-rho * sin, -rho * sin], [-arm, arm]]) / r,
        constraints=np.array([[sin, rho * cos, 0.0]]),
        directions=np.array([[cos, 0.0], [-sin / rho, 0.0], [0.0, 1.0]]),
        directions_rate=np.array([[-sin * turn, 0.0], [slip, 0.0], [0.0, 0.0]]),
    )


def bounds(h, largest):
    """f_m1, f_m2: the largest |f_i| under disturbances of up to `largest` Nm at each wheel, with any signs."""
    return np.abs(np.linalg.inv(h)) @ largest
