"""Postures at the time of the next command: as measured, or predicted.

Prediction goes through the dead time of the loop, from the velocities that were sent.

A measurement is `age_s` old when it arrives, and a command takes effect `ahead_s` after it was computed. Between the
exposure and the effect of the next command the robot executes the commands of the last age_s + ahead_s: a known
sequence of velocities, each held for one period. Each is a circular arc; the robot is assumed to follow at once.
"""

from typing import Annotated

from msgspec import Meta

from miro_exact.dmath import sincos, wrap_pi
from miro_host.estimators.interface import Estimate, Estimator, EstimatorInput, EstimatorParameters
from miro_host.posture import Posture

KEPT = 16
"""Periods of commands that are remembered: more than the longest dead time of 0.5 s."""

DelayS = Annotated[float, Meta(ge=0.0, le=0.25)]


class PredictParameters(EstimatorParameters, frozen=True, kw_only=True, tag="predict"):
    """A measurement moved on by the commands since its exposure, to the time of the next command.

    `age_s`: from exposure to arrival, one camera frame by default. `ahead_s`: from arrival to the command's effect.

    The default of `ahead_s` is that of a network of three robots: 3 ms of computing, 1 ms of key-up, 24 ms on the air,
    and half of the LM629's ramp.
    """

    age_s: DelayS = 1001.0 / 30000.0
    ahead_s: DelayS = 0.033

    def estimator(self) -> "Predictor":
        return Predictor(self)


class Predictor(Estimator[PredictParameters]):
    """Remembers the commands of the last periods, the latest first."""

    STATE = {"v_m_s": f"{KEPT}d", "w_rad_s": f"{KEPT}d"}

    def __init__(self, parameters: PredictParameters) -> None:
        super().__init__(parameters)
        self.v_m_s = [0.0] * KEPT
        self.w_rad_s = [0.0] * KEPT

    def step(self, given: EstimatorInput) -> Estimate | None:
        self.v_m_s = [given.v_m_s, *self.v_m_s[:-1]]
        self.w_rad_s = [given.w_rad_s, *self.w_rad_s[:-1]]
        if given.measured is None:
            return None
        dead_s = self.parameters.age_s + self.parameters.ahead_s
        whole = min(int(dead_s / given.period_s), KEPT - 1)
        posture = given.measured
        for index in range(whole, -1, -1):
            held_s = given.period_s if index < whole else dead_s - whole * given.period_s
            posture = moved(posture, self.v_m_s[index] * held_s, self.w_rad_s[index] * held_s)
        return Estimate(given.t_s + self.parameters.ahead_s, posture)


def moved(posture: Posture, length_m: float, turn_rad: float) -> Posture:
    """The posture after a circular arc of `length_m` that turns by `turn_rad`: its chord is at half the turn."""
    half = 0.5 * turn_rad
    sin_half, _ = sincos(half)
    shrink = sin_half / half if abs(half) > 1e-6 else 1.0  # sin(h) / h is 1 - h^2 / 6
    sin, cos = sincos(posture.theta_rad + half)
    chord_m = length_m * shrink
    return Posture(
        posture.x_m + chord_m * cos, posture.y_m + chord_m * sin, wrap_pi(posture.theta_rad + turn_rad)
    )


class NoEstimator(EstimatorParameters, frozen=True, kw_only=True, tag="none"):
    """The paper's loop: a measurement is taken as the posture at the time at which it arrives."""

    def estimator(self) -> "Unchanged":
        return Unchanged(self)


class Unchanged(Estimator[NoEstimator]):
    """Returns the camera's posture unchanged."""

    def step(self, given: EstimatorInput) -> Estimate | None:
        return None if given.measured is None else Estimate(given.t_s, given.measured)
