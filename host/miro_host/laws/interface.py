"""The interface of tracking laws: input, output, and declarations.

A law is two classes. The parameters are a frozen struct whose tag is the law's name; they are the scenario's
`controller` table, and their `law` method makes the law. The law itself has a `step`, which is called once in each
control period in which a posture is known:

    camera ─► estimator ─► posture ─┐
    reference(t) ───────────────────┼─► law.step ─► velocities, or accelerations ─► limits ─► z_cmd = (v, w) ─► wheels
    z_cmd, telemetry ───────────────┘       │
                                            └─► inner values, for the recording only

The mistake that this design prevents is memory outside the saved state: a law keeps what it remembers in attributes
that `STATE` declares, and an attribute that is declared nowhere is refused. A law is given what the PC could have seen,
and no true posture of a robot. No wall keeps it from looking further, since it runs in the same process: whoever checks
a law reads its source.
"""

from collections.abc import Mapping
from typing import Any, ClassVar, Generic, TypeVar

import msgspec

from miro_exact.dmath import sincos, wrap_pi
from miro_host.integrator import Limits
from miro_host.memory import NOTHING, Remembering
from miro_host.posture import Posture
from miro_host.references.interface import Reference, Trajectory
from miro_host.registries import Controller
from miro_host.telemetry_receiver import LastTelemetry


class LawInput(msgspec.Struct, frozen=True, gc=False):
    """The input of a law in one control period.

    `t_s` is the time since the start of the reference at which `reference` was evaluated; `path` gives the reference at
    any other time. `posture` is the estimator's result from the camera's measurements. `v_m_s`, `w_rad_s` are the
    commanded velocities that the last period ended with. `telemetry` is the robot's last answer by radio, None before
    the first.
    """

    t_s: float
    period_s: float
    reference: Reference
    path: Trajectory
    posture: Posture
    v_m_s: float
    w_rad_s: float
    telemetry: LastTelemetry | None = None


class Accelerations(msgspec.Struct, frozen=True, gc=False):
    """An answer for the integrator of equation (15): z_cmd' in m/s2 and rad/s2, held for one period."""

    v_dot_m_s2: float
    w_dot_rad_s2: float
    inner: Mapping[str, float] = NOTHING


class Velocities(msgspec.Struct, frozen=True, gc=False):
    """An answer that is z_cmd itself, in m/s and rad/s; the limits of velocity and of its rate apply."""

    v_m_s: float
    w_rad_s: float
    inner: Mapping[str, float] = NOTHING


Answer = Accelerations | Velocities


class LawParameters(
    Limits, Controller, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="law"
):
    """Base of every law's parameters: the limits of z_cmd, which hold for any law.

    Derive with `frozen=True, kw_only=True, tag="name_of_the_law"`, give each key its unit (`gain_per_s`) and its range
    (`typing.Annotated` with `msgspec.Meta`), and define `law`.

    A law in polar coordinates states how near the origin of the world axes its reference may come, once it has left it,
    as `ORIGIN_CLEARANCE_M`; scenarios with another reference are refused. The paper's assumptions are about such laws,
    and shown for them alone. 0: the law knows no origin.
    """

    ORIGIN_CLEARANCE_M: ClassVar[float] = 0.0

    def law(self) -> "Law[Any]":
        """A new law with these parameters, as it is before its first period."""
        raise NotImplementedError(f"{type(self).__name__} has no method `law`")


P = TypeVar("P", bound=LawParameters, covariant=True)


class Law(Remembering, Generic[P]):
    """Base of every law.

    `INNER` names the values that are recorded beside the command, in the order of the recording; every answer gives all
    of them. `STATE` declares what the law remembers from period to period: attribute to type, see `miro_host.memory`.
    `NOT_STATE` names the attributes that stay as they were made.
    """

    INNER: ClassVar[tuple[str, ...]] = ()
    parameters: P

    def step(self, given: LawInput) -> Answer:
        """Runs one control period. Called in the order of time; not called for a period without a posture."""
        raise NotImplementedError(f"{type(self).__name__} has no method `step`")


class Errors(msgspec.Struct, frozen=True, gc=False):
    """The reference's posture in the robot's axes, as defined by Kanayama et al. (ICRA 1990).

    x ahead, y to the left, theta anticlockwise in (-pi, pi]. They do not depend on the world's origin.
    """

    x_m: float
    y_m: float
    theta_rad: float


def errors(reference: Posture, robot: Posture) -> Errors:
    """The errors of `robot` against `reference`."""
    sin, cos = sincos(robot.theta_rad)
    dx_m, dy_m = reference.x_m - robot.x_m, reference.y_m - robot.y_m
    theta_rad = wrap_pi(reference.theta_rad - robot.theta_rad)
    return Errors(cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m, theta_rad)
