"""The interface of posture estimators: input and result.

An estimator is two classes, as a law is: a frozen struct of parameters whose tag is its name and whose `estimator`
method makes it, and a class with `step`. It is called in every control period, also without a measurement, so that it
can count periods. It gets only data that the PC could have, not the true posture.
"""

from collections.abc import Mapping
from functools import cache
from typing import Any, ClassVar, Generic, TypeVar, get_args

import msgspec
from msgspec import Meta

from miro_host.memory import NOTHING, Remembering
from miro_host.posture import Posture
from miro_host.registries import AnyEstimator
from miro_host.telemetry_receiver import LastTelemetry

DEAD_S = 0.028
"""3 ms of computing, 1 ms of key-up, 24 ms on the air in a network of three robots."""


class EstimatorInput(msgspec.Struct, frozen=True, gc=False):
    """The input of an estimator at `t_s` after the start of the reference.

    `measured`: the tracker's result that arrives now, None for a frame in which the robot was not found. `v_m_s`,
    `w_rad_s`: velocities commanded one period ago; `left_m_s`, `right_m_s`: the rim speeds sent for them, for wheels of
    the nominal radius. `telemetry`: the robot's last answer by radio. `dead_s`: time from t_s until the last bit of the
    next command leaves the transmitter.
    """

    t_s: float
    period_s: float
    measured: Posture | None
    v_m_s: float
    w_rad_s: float
    left_m_s: float
    right_m_s: float
    telemetry: LastTelemetry | None = None
    dead_s: float = DEAD_S


class Estimate(msgspec.Struct, frozen=True, gc=False):
    """A posture and the time for its comparison with the reference.

    `left_factor`, `right_factor` are the radii of the wheels over the nominal one: the command is divided by them.
    `inner`: values named by the estimator; they are recorded only.
    """

    t_s: float
    posture: Posture
    left_factor: float = 1.0
    right_factor: float = 1.0
    inner: Mapping[str, float] = NOTHING


@cache
def _ranges(parameters: type[msgspec.Struct]) -> dict[str, tuple[float, float]]:
    """Smallest and largest value of each parameter whose annotation has both."""
    ranges = {}
    for field in msgspec.structs.fields(parameters):
        for kind in (field.type, *get_args(field.type)):
            for meta in getattr(kind, "__metadata__", ()):
                if isinstance(meta, Meta) and meta.ge is not None and meta.le is not None:
                    ranges[field.name] = meta.ge, meta.le
    return ranges


class EstimatorParameters(
    msgspec.Struct, AnyEstimator, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind"
):
    """Base of every estimator's parameters. Derive with `frozen=True, kw_only=True, tag="its_name"`.

    Raises ValueError for a number that is not between the two bounds of its annotation, if it has both.
    """

    def __post_init__(self) -> None:
        for name, (least, most) in _ranges(type(self)).items():
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise ValueError(f"{name}: {value!r} is out of range; must be {least} to {most}")

    def estimator(self) -> "Estimator[Any]":
        """A new estimator with these parameters, before its first period."""
        raise NotImplementedError(f"{type(self).__name__} has no method `estimator`")


P = TypeVar("P", bound=EstimatorParameters, covariant=True)


class Estimator(Remembering, Generic[P]):
    """Base of every estimator; its memory and the values that it names are declared as a law's are."""

    INNER: ClassVar[tuple[str, ...]] = ()

    parameters: P

    def step(self, given: EstimatorInput) -> Estimate | None:
        """Runs one control period. Returns None if no posture is known; then the last command is repeated."""
        raise NotImplementedError(f"{type(self).__name__} has no method `step`")
