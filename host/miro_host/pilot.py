"""One robot's chain on the PC, once per camera frame: measurement, estimator, law, integrator, wheel commands.

The law's velocities v_c, w_c are the commanded ones, the integrator's state before the update (`integrator`
says why). Before the first measurement the command is zero. Without an estimate law and integrator are
left alone and the last command is repeated.
"""

import sys
from collections.abc import Mapping
from typing import Any

import msgspec

from miro_exact.domain import DomainError
from miro_exact.plugins import PluginError
from miro_exact.raised import at_place, defined_at, described, raised_at
from miro_exact.state import Items
from miro_host.estimators.interface import DEAD_S, Estimate, Estimator, EstimatorInput
from miro_host.estimators.predict import NoEstimator
from miro_host.integrator import Integrator
from miro_host.laws.interface import Accelerations, Answer, Law, LawInput, Velocities
from miro_host.memory import NOTHING
from miro_host.posture import Posture
from miro_host.references.interface import Reference, Trajectory
from miro_host.telemetry_receiver import LastTelemetry
from miro_host.wheels import Wheels, wheel_command

PERIOD_S = 1001.0 / 30000.0  # one NTSC frame, 800 800 ticks


class WheelCommand(msgspec.Struct, frozen=True, gc=False):
    """The command to the wheels, with z_cmd in m/s and rad/s, and the values named by law and estimator.

    `left`, `right` in 1/256 count per LM629 sample, for wheels whose radii are the nominal one times `left_factor` and
    `right_factor`.
    """

    left: int
    right: int
    v_m_s: float
    w_rad_s: float
    inner: Mapping[str, float] = NOTHING
    left_factor: float = 1.0
    right_factor: float = 1.0
    estimate: Mapping[str, float] = NOTHING


_LARGEST = sys.float_info.max
_FASTEST = 0x8000  # what a frame holds
LARGEST_FACTOR = 2.0
"""A wheel's radius over the nominal one stays between this and its inverse."""
_INFINITY = float("inf")
_LEAST_FACTOR = 1.0 / LARGEST_FACTOR
STANDSTILL = WheelCommand(0, 0, 0.0, 0.0)


class Pilot:
    """Steers one robot along one reference, within the limits among the law's parameters.

    `reference_lead_s` shifts the instant at which the reference is evaluated against the `t_s` handed to `update`; 0 is
    the paper's loop. The shift is ours, not the paper's: a positive value (up to the time the command takes effect) or
    a negative one (back to the exposure of the image in hand) compensates a known delay without touching the law.
    `dead_s`, from a period's begin to the end of its frame, is passed to the estimator. `numbers` is `command` as it is
    saved: wheels, wheel factors, velocities, and the named values in the order of both `INNER`.
    """

    STATE = {
        "integrator": Integrator,
        "law": Law,
        "estimator": Estimator,
        "numbers": Items("d", 0xFFFF, -_LARGEST, _LARGEST),
    }
    NOT_STATE = (
        *("reference", "reference_lead_s", "dead_s", "wheels", "units_per_m_s", "command"),
        *("_asked", "_asked_s"),
    )

    def __init__(
        self,
        reference: Trajectory,
        law: Law[Any],
        wheels: Wheels | None = None,
        *,
        estimator: Estimator[Any] | None = None,
        reference_lead_s: float = 0.0,
        integrator: Integrator | None = None,
        dead_s: float = DEAD_S,
    ) -> None:
        self.reference = reference
        self._asked: Reference | None = None  # the reference at `_asked_s`
        self._asked_s = 0.0
        self.law = law
        self.estimator: Estimator[Any] = NoEstimator().estimator() if estimator is None else estimator
        self.wheels = Wheels() if wheels is None else wheels
        self.units_per_m_s = self.wheels.units_per_m_s
        self.reference_lead_s = reference_lead_s
        self.dead_s = dead_s
        self.integrator = Integrator(law.parameters, PERIOD_S) if integrator is None else integrator
        self.command = STANDSTILL
        nothing = [0.0] * (len(law.INNER) + len(self.estimator.INNER))
        self.numbers = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, *nothing]
        self.after_load()

    def __repr__(self) -> str:
        return f"Pilot({self.reference!r}, {self.law!r}, command={self.command!r})"

    def update(
        self, measured: Posture | None, t_s: float, telemetry: LastTelemetry | None = None
    ) -> WheelCommand:
        """Runs one control period at `t_s` after the reference's start; `measured` and `telemetry` may be missing
        (None).

        Raises PluginError, and leaves integrator and command unchanged, if the law fails or returns a value that is no
        number.
        """
        z, units = self.integrator, self.units_per_m_s
        v_m_s, w_rad_s = z.v_m_s, z.w_rad_s
        left_m_s, right_m_s = self.command.left / units, self.command.right / units
        given = EstimatorInput(
            t_s, z.period_s, measured, v_m_s, w_rad_s, left_m_s, right_m_s, telemetry, self.dead_s
        )
        estimate: Estimate | None = self._answered("estimator", self.estimator, given)
        if estimate is None:
            return self.command
        at_s = estimate.t_s + self.reference_lead_s
        path, reference, posture = self.reference, self.reference_at(at_s), estimate.posture
        asked = LawInput(at_s, z.period_s, reference, path, posture, v_m_s, w_rad_s, telemetry)
        answer: Answer = self._answered("law", self.law, asked)
        inner = _in_order(answer.inner, self.law.INNER)
        if isinstance(answer, Accelerations):
            z.step(answer.v_dot_m_s2, answer.w_dot_rad_s2)  # equation (15)
        else:
            z.go_to(answer.v_m_s, answer.w_rad_s)
        left_factor, right_factor = estimate.left_factor, estimate.right_factor
        left, right = wheel_command(self.wheels, z.v_m_s, z.w_rad_s, left_factor, right_factor)
        named = _in_order(estimate.inner, self.estimator.INNER)
        wheels = float(left), float(right), left_factor, right_factor
        self.numbers = [*wheels, z.v_m_s, z.w_rad_s, *inner.values(), *named.values()]
        self.command = WheelCommand(left, right, z.v_m_s, z.w_rad_s, inner, left_factor, right_factor, named)
        return self.command

    def reference_at(self, t_s: float) -> Reference:
        """The reference at `t_s`: a function of time, which the law and the recording both ask for one instant."""
        if self._asked is None or self._asked_s != t_s:
            self._asked = self.reference.at(t_s)
            self._asked_s = t_s
        return self._asked

    def _answered(self, word: str, plugin: Law[Any] | Estimator[Any], given: Any) -> Any:
        """The output of a plug-in after checks: output and memory are finite and as declared."""
        try:
            answer = plugin.step(given)
            if plugin is self.law:
                check_answer(answer, plugin.INNER)
            elif answer is not None:
                check_estimate(answer, plugin.INNER)
            plugin.check_memory()
        except PluginError:  # of the reference, which the plug-in may have asked
            raise
        except (Exception, SystemExit) as error:
            raise _failure(word, plugin, error) from error
        return answer

    def after_load(self) -> None:
        """Makes the command of its numbers. Raises ValueError for one that no step gives."""
        if len(self.numbers) < 6:
            raise ValueError(f"a command has not enough values: {len(self.numbers)}")
        left, right, left_factor, right_factor, v_m_s, w_rad_s, *inner = self.numbers
        if not all(abs(wheel) <= _FASTEST and wheel == int(wheel) for wheel in (left, right)):
            raise ValueError(f"no frame carries the command ({left}, {right})")
        _check_factors(left_factor, right_factor)
        count = len(self.law.INNER)
        values = dict(zip(self.law.INNER, inner[:count], strict=True))
        named = dict(zip(self.estimator.INNER, inner[count:], strict=True))
        self.command = WheelCommand(
            int(left), int(right), v_m_s, w_rad_s, values, left_factor, right_factor, named
        )


def _failure(word: str, plugin: Law[Any] | Estimator[Any], error: BaseException) -> PluginError:
    """The PluginError for a plug-in's exception: its name and the reason in one line."""
    known = type(error) in (ValueError, DomainError)
    reason = str(error) if known else described(error)
    place = raised_at(error) or defined_at(plugin.step)
    problem = f"{word} {plugin.parameters.name()!r} failed: {at_place(reason, place)}"
    if isinstance(error, DomainError):
        return PluginError(problem, "the parameters are far outside those of a real robot")
    return PluginError(problem, f"mend the {word} or its parameters")


def check_answer(answer: object, inner: tuple[str, ...]) -> None:
    """Raises ValueError for an answer that is not one, for one without the inner values, and for NaN and infinity."""
    if isinstance(answer, Accelerations):
        _check("v_dot_m_s2", answer.v_dot_m_s2)
        _check("w_dot_rad_s2", answer.w_dot_rad_s2)
    elif isinstance(answer, Velocities):
        _check("v_m_s", answer.v_m_s)
        _check("w_rad_s", answer.w_rad_s)
    else:
        raise ValueError(f"`step` returned {str(answer)[:40]!r}, neither Accelerations nor Velocities")
    _check_inner(answer.inner, inner)


def check_estimate(estimate: object, inner: tuple[str, ...]) -> None:
    """Raises ValueError for an estimate that is not one, one without the named values, NaN, infinity and odd wheels."""
    if not isinstance(estimate, Estimate) or not isinstance(estimate.posture, Posture):
        raise ValueError(f"`step` returned {str(estimate)[:40]!r}, which is no Estimate of a Posture")
    posture = estimate.posture
    _check("t_s", estimate.t_s)
    _check("x_m", posture.x_m)
    _check("y_m", posture.y_m)
    _check("theta_rad", posture.theta_rad)
    _check("left_factor", estimate.left_factor)
    _check("right_factor", estimate.right_factor)
    _check_factors(estimate.left_factor, estimate.right_factor)
    _check_inner(estimate.inner, inner)


def _check_factors(left: float, right: float) -> None:
    if not (_LEAST_FACTOR <= left <= LARGEST_FACTOR and _LEAST_FACTOR <= right <= LARGEST_FACTOR):
        raise ValueError(f"the wheel factors ({left}, {right}) are those of no robot")


def _in_order(values: Mapping[str, float], declared: tuple[str, ...]) -> Mapping[str, float]:
    """A copy in declared order: the plug-in may continue to modify its own mapping."""
    return {name: values[name] for name in declared}


def _check_inner(values: Mapping[str, float], declared: tuple[str, ...]) -> None:
    known = len(values) == len(declared)
    for name in values:
        known = known and name in declared
    if not known:
        raise ValueError(f"its inner values are {sorted(values)}, but INNER declares {sorted(declared)}")
    for name, value in values.items():
        _check(name, value)


def _check(name: str, value: object) -> None:
    real = value if type(value) is float else _INFINITY
    if real - real != 0.0:
        raise ValueError(f"`step` returned {name} = {str(value)[:40]}, which is not a finite float")
