"""The parameters by which a scenario chooses a reference, and what a reference may not do.

What belongs here: the structs of parameters, with unit and range, and the check of what a trajectory gives. What does
not: the trajectories (`reference`) and the table of names (`reference_registry`).
"""

import math
from collections.abc import Iterator
from typing import Annotated

import msgspec
from msgspec import Meta

from miro_host.parts import PartError, described
from miro_host.reference import Arc, Line, Ramp, Reference, Trajectory
from miro_host.reference_registry import AnyReference

DEGREE = 0.017453292519943295

TurnDeg = Annotated[float, Meta(ge=-180.0, le=180.0)]
Speed = Annotated[float, Meta(ge=0.0, le=1.46)]
Seconds = Annotated[float, Meta(ge=0.0, le=1e3)]
DriveS = Annotated[float, Meta(ge=0.0, le=86_400.0)]


class ReferenceParameters(
    msgspec.Struct, AnyReference, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind"
):
    """Base of every reference's parameters.

    Derive with `frozen=True, kw_only=True, tag="name_of_the_reference"`, and define `trajectory`.
    """

    def trajectory(self, duration_s: float) -> Trajectory:
        """The reference for a run of `duration_s`. It starts in the origin of the world axes, at 0 s."""
        raise NotImplementedError(f"{type(self).__name__} has no method `trajectory`")

    @classmethod
    def name(cls) -> str:
        """The reference's name in scenario files."""
        return str(cls.__struct_config__.tag)


class LineRef(ReferenceParameters, frozen=True, kw_only=True, tag="line"):
    """A straight line from the origin, run with a speed ramp: s = v t^2 / (2 t_r), then v (t - t_r / 2).

    With `drive_s` the reference comes to rest by the same ramp, after so many seconds, and stands from then on.
    Without, it moves for the whole duration.
    """

    heading_deg: TurnDeg = 0.0
    speed_m_s: Speed = 0.20
    ramp_s: Seconds = 0.5
    drive_s: DriveS | None = None

    def trajectory(self, duration_s: float) -> Line:
        return Line(_ramp(self, duration_s), self.heading_deg * DEGREE)


class ArcRef(ReferenceParameters, frozen=True, kw_only=True, tag="arc"):
    """A circular arc from the origin: heading theta_0 + kappa s, the same speed ramp and `drive_s` as the line."""

    heading_deg: TurnDeg = 60.0
    curvature_per_m: Annotated[float, Meta(ge=-100.0, le=100.0)] = -1.0
    speed_m_s: Speed = 0.20
    ramp_s: Seconds = 0.5
    drive_s: DriveS | None = None

    def trajectory(self, duration_s: float) -> Arc:
        return Arc(_ramp(self, duration_s), self.heading_deg * DEGREE, self.curvature_per_m)


def _ramp(keys: LineRef | ArcRef, duration_s: float) -> Ramp:
    drive_s = max(duration_s, keys.ramp_s) if keys.drive_s is None else keys.drive_s
    return Ramp(keys.speed_m_s, keys.ramp_s, drive_s, ramp_down=keys.drive_s is not None)


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
        """The reference at `t_s`. Raises PartError."""
        try:
            found = self.trajectory.at(t_s)
            for value in _numbers(found):
                if type(value) is not float or not math.isfinite(value):
                    raise ValueError(f"it returned {found!r}; all must be finite floats")
        except Exception as error:
            reason = str(error) if type(error) is ValueError else described(error)
            what = f"reference {self.name!r} failed at {t_s:.6f} s: {reason}"
            raise PartError(what, "mend the reference or its parameters") from error
        return found


def _numbers(found: Reference) -> Iterator[object]:
    posture, *rates = msgspec.structs.astuple(found)
    yield from msgspec.structs.astuple(posture)
    yield from rates
