"""The matrices of the paper's robot in Cartesian and in polar coordinates: section III, equations (8) and (9).

The paper prints S for both sets of coordinates, and leaves M, V and E open. They are those of a rigid body whose centre
of mass lies in the middle between its wheels; tau = (tau_l, tau_r) is the torque at the wheels. In polar coordinates M
and V follow from the kinetic energy m (rho'^2 + rho^2 phi'^2) / 2 + J theta'^2 / 2. Both have the same H, and G = 0.
"""

import msgspec

from miro_exact.dmath import sincos
from tests.host.theory.matrices import diagonal
from tests.host.theory.mechanics import System


class UnicycleBody(msgspec.Struct, frozen=True, kw_only=True):
    """What the robot weighs and how it stands on its wheels. ValueError unless all are above 0."""

    mass_kg: float
    yaw_inertia_kg_m2: float
    wheel_radius_m: float
    track_m: float

    def __post_init__(self):
        for name in self.__struct_fields__:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be greater than 0")


def inertia(body):
    """H of equation (7), written out: wheel torques for v' = 1 m/s2 (first column) and w' = 1 rad/s2 (second)."""
    forward = 0.5 * body.wheel_radius_m * body.mass_kg
    turn = body.wheel_radius_m * body.yaw_inertia_kg_m2 / body.track_m
    return [[forward, -turn], [forward, turn]]


def cartesian_rates(q, z):
    """q' of equation (8); q = (x, y, theta), z = (v, w)."""
    sin, cos = sincos(q[2])
    return [z[0] * cos, z[0] * sin, z[1]]


def polar_rates(q, z):
    """q' of equation (9); q = (rho, phi, theta), z = (v, w). ZeroDivisionError in the origin."""
    sin, cos = sincos(q[1] - q[2])
    return [z[0] * cos, -(z[0] / q[0]) * sin, z[1]]


def cartesian(body, q, z):
    """The robot at q = (x, y, theta) in m and rad with z = (v, w)."""
    sin, cos = sincos(q[2])
    w, r, arm = z[1], body.wheel_radius_m, 0.5 * body.track_m
    return System(
        inertia=diagonal([body.mass_kg, body.mass_kg, body.yaw_inertia_kg_m2]),
        force=[0.0, 0.0, 0.0],
        inputs=[[cos / r, cos / r], [sin / r, sin / r], [-arm / r, arm / r]],
        constraints=[[-sin, cos, 0.0]],
        directions=[[cos, 0.0], [sin, 0.0], [0.0, 1.0]],
        directions_rate=[[-sin * w, 0.0], [cos * w, 0.0], [0.0, 0.0]],
    )


def polar(body, q, z):
    """The same at q = (rho, phi, theta), rho > 0. The constraint is that of (8) in these coordinates."""
    rho, r, arm, mass = q[0], body.wheel_radius_m, 0.5 * body.track_m, body.mass_kg
    sin, cos = sincos(q[1] - q[2])
    rho_rate, phi_rate, w = polar_rates(q, z)
    turn = phi_rate - w  # of phi - theta
    return System(
        inertia=diagonal([mass, mass * rho * rho, body.yaw_inertia_kg_m2]),
        force=[-mass * rho * phi_rate * phi_rate, 2.0 * mass * rho * rho_rate * phi_rate, 0.0],
        inputs=[[cos / r, cos / r], [-rho * sin / r, -rho * sin / r], [-arm / r, arm / r]],
        constraints=[[sin, rho * cos, 0.0]],
        directions=[[cos, 0.0], [-sin / rho, 0.0], [0.0, 1.0]],
        directions_rate=[
            [-sin * turn, 0.0],
            [-cos * turn / rho + sin * rho_rate / (rho * rho), 0.0],
            [0.0, 0.0],
        ],
    )
