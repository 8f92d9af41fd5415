"""The interface of reference trajectories and their parameters.

A reference is two classes, like a law: a frozen struct of parameters whose tag is the reference's name, which is the
scenario's `reference` table, and the trajectory that it makes, a function of time without memory.
"""

import math
from typing import Annotated, Protocol, runtime_checkable

import msgspec
from msgspec import Meta

from miro_exact.dmath import atan2, sincos
from miro_exact.plugins import PluginError
from miro_exact.raised import at_place, defined_at, described, raised_at
from miro_host.posture import Posture
from miro_host.registries import AnyReference

DEGREE = 0.017453292519943295

TurnDeg = Annotated[float, Meta(ge=-180.0, le=180.0)]
Cm = Annotated[float, Meta(ge=-1_000.0, le=1_000.0)]


class Reference(msgspec.Struct, frozen=True, gc=False):
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


class Trajectory(Protocol):
    """A reference over time."""

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s` seconds after its start, for any time, also before 0 and after its end."""
        ...


class SamplingPace(msgspec.Struct, frozen=True):
    """The sampling interval and duration that cover a whole trajectory.

    Within `step_s` it goes and turns no more than requested. After `until_s` it stands or repeats its path. After
    `steady_s` its speeds and accelerations repeat.
    """

    step_s: float
    until_s: float
    steady_s: float


@runtime_checkable
class Paced(Trajectory, Protocol):
    """A trajectory with a sampling pace. All of our own have one."""

    def pace(self, step_m: float, step_rad: float) -> SamplingPace:
        """Its pace for steps of `step_m` and `step_rad` at most."""
        ...


class ReferenceParameters(
    msgspec.Struct, AnyReference, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind"
):
    """Base of every reference's parameters.

    Derive with `frozen=True, kw_only=True, tag="name_of_the_reference"`, and define `trajectory`.
    """

    def trajectory(self, duration_s: float) -> Trajectory:
        """The reference for a run of `duration_s`, which begins at 0 s. ValueError if these parameters give none."""
        raise NotImplementedError(f"{type(self).__name__} has no method `trajectory`")


class CheckedReference:
    """A trajectory of another distribution: what it gives is finite, and what it raises names it.

    A trajectory has no memory: it is a function of time.
    """

    def __init__(self, trajectory: Trajectory, name: str) -> None:
        self.trajectory = trajectory
        self.name = name

    def __repr__(self) -> str:
        return f"CheckedReference({self.trajectory!r})"

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`. Raises PluginError."""
        try:
            reference = self.trajectory.at(t_s)
            if not isinstance(reference, Reference):
                raise ValueError(f"`at` returned {reference!r:.40}, which is no Reference")
            if not isinstance(reference.posture, Posture):
                raise ValueError(f"its posture is {reference.posture!r:.60}, which is no Posture")
            for value in (
                *msgspec.structs.astuple(reference.posture),
                *msgspec.structs.astuple(reference)[1:],
            ):
                if type(value) is not float or not math.isfinite(value):
                    raise ValueError(f"it returned {reference!r}; all must be finite floats")
        except (Exception, SystemExit) as error:
            reason = str(error) if type(error) is ValueError else described(error)
            place = raised_at(error) or defined_at(getattr(self.trajectory, "at", None))
            problem = f"reference {self.name!r} failed at {t_s:.6f} s: {at_place(reason, place)}"
            raise PluginError(problem, "mend the reference or its parameters") from error
        return reference


ORIGIN_M = 1e-8
"""Nearer to the origin than this, the polar form has the values of its limit for a path that leaves it."""


def with_polar_form(
    at: Posture, v_m_s: float, w_rad_s: float, v_dot_m_s2: float, w_dot_rad_s2: float
) -> Reference:
    """The reference at the posture `at` with these velocities and accelerations.

    With alpha = phi - theta: rho' = v cos(alpha), phi' = -v sin(alpha) / rho, equation (9), and
    rho'' = v' cos(alpha) + v^2 sin^2(alpha) / rho + v w sin(alpha), equation (18). In the origin all this is 0/0;
    along a path that leaves it forwards alpha = -w rho / (2 v), hence phi = theta, phi' = w / 2, rho' = v, rho'' = v'.
    """
    x, y = at.x_m, at.y_m
    rho = math.sqrt(x * x + y * y)
    if rho < ORIGIN_M:
        polar = (at.theta_rad, v_m_s, 0.5 * w_rad_s, v_dot_m_s2)
    else:
        sin_theta, cos_theta = sincos(at.theta_rad)
        sin_alpha = (y * cos_theta - x * sin_theta) / rho
        cos_alpha = (x * cos_theta + y * sin_theta) / rho
        across = v_m_s * sin_alpha
        polar = (
            atan2(y, x),
            v_m_s * cos_alpha,
            -across / rho,
            v_dot_m_s2 * cos_alpha + across * across / rho + across * w_rad_s,
        )
    return Reference(at, v_m_s, w_rad_s, v_dot_m_s2, w_dot_rad_s2, rho, *polar)
