"""Mechanical systems with nonholonomic constraints and their reduced form: equations (1) to (7).

    (1)  A q' = 0        (2)  A S = 0        (4)  q' = S z        (5)  q'' = S z' + S' z
    (3)  M q'' + V = E tau - A^T lambda
    (6)  S^T (M S z' + M S' z + V) = S^T E tau
    (7)  H z' + G = tau,   H = (S^T E)^-1 S^T M S,   G = (S^T E)^-1 S^T (M S' z + V)

With n coordinates and m constraints, H is (n-m) x (n-m). The paper calls G and tau (n-m) x m matrices; by (7) they are
columns of n-m numbers, which for its robot, m = 1, is the same.
"""

import msgspec

from tests.host.theory.matrices import (
    Matrix,
    Vector,
    added,
    dot,
    product,
    solution,
    solved,
    times,
    transposed,
)


class System(msgspec.Struct, frozen=True):
    """A system at one instant: M (n x n), V (n), E (n x r), A (m x n), S (n x (n-m)) and S' along its motion.

    The paper assumes r = n - m.
    """

    inertia: Matrix
    force: Vector
    inputs: Matrix
    constraints: Matrix
    directions: Matrix
    directions_rate: Matrix


class Reduced(msgspec.Struct, frozen=True):
    """H and G of equation (7)."""

    h: Matrix
    g: Vector


def constrained(system):
    """A S, which equation (2) wants to be 0."""
    return product(system.constraints, system.directions)


def reduced(system, z):
    """H and G of equation (7) at the velocities z. ValueError where S^T E is singular: an input is missing."""
    across = transposed(system.directions)
    through = product(across, system.inputs)  # S^T E
    h = solution(through, product(across, product(system.inertia, system.directions)))
    drift = added(times(system.inertia, times(system.directions_rate, z)), system.force)  # M S' z + V
    return Reduced(h, solved(through, times(across, drift)))


def acceleration(system, z, z_dot):
    """q'' of equation (5)."""
    return added(times(system.directions, z_dot), times(system.directions_rate, z))


def constraint_forces(system, z, z_dot, torque):
    """lambda of equation (3): what the constraints do to keep (1), from A A^T lambda = A (E tau - M q'' - V)."""
    q_accel = acceleration(system, z, z_dot)
    inertial = added(times(system.inertia, q_accel), system.force)
    rest = [one - other for one, other in zip(times(system.inputs, torque), inertial, strict=True)]
    square = product(system.constraints, transposed(system.constraints))
    return solved(square, times(system.constraints, rest))


def residual(system, z, z_dot, torque):
    """M q'' + V - E tau + A^T lambda: what is left of equation (3), 0 for a motion that the reduction allows."""
    forces = times(transposed(system.constraints), constraint_forces(system, z, z_dot, torque))
    inertial = added(times(system.inertia, acceleration(system, z, z_dot)), system.force)
    driven = times(system.inputs, torque)
    return [one - other + force for one, other, force in zip(inertial, driven, forces, strict=True)]


def energy(system, z):
    """The kinetic energy q'^T M q' / 2 in J."""
    q_dot = times(system.directions, z)
    return 0.5 * dot(q_dot, times(system.inertia, q_dot))


def power(system, z, torque):
    """q'^T E tau in W: constraint forces do no work, so this is the rate of the energy."""
    return dot(times(system.directions, z), times(system.inputs, torque))
