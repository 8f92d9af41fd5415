"""An extended Kalman filter: posture and wheel radii, from the camera and the commands that were sent.

What belongs here: the filter's parameters, memory, and the order of its steps. What does not: how wheels follow their
commands (`wheel_model`), how the state moves (`motion`), the algebra (`matrix`).

The state is the posture at the last exposure and one factor per wheel, which is its radius over the nominal one. In
each control period:

    1. The command of one period ago is remembered with the speeds at which its effect finds the wheels.
    2. A new measurement moves the state to its exposure (prediction) and corrects it (update).
    3. A copy of the state is moved on to the effect of the command that is about to be computed. It is handed out.

A command that is computed at t takes effect at t + dead_s + lag_s: the lag of the wheels is taken as a delay. So the
commands known at t determine all that the robot does until the next one takes effect.

What a measurement may be, besides good:

    None                      not found: the filter predicts. The state stays at the last exposure as long as the
                              commands since then are remembered (16 periods), then it is moved on.
    same or older exposure    ignored: a frame that the grabber repeats holds nothing new.
    far from the prediction   refused: its distance in standard deviations, sqrt(e^T S^-1 e) with S the covariance of
                              the innovation e = (x, y, theta), is above `gate`. When `REFUSED` measurements in a row
                              are far, the robot is somewhere else: the posture begins anew, the factors stay.

A `Sighting` brings the tick of its exposure, counted on the same clock as t_s, and its confidence; the standard
deviations are divided by the confidence, but by no less than `LEAST_CONFIDENCE`. Any other measurement is `age_s` old.
"""

from collections.abc import Iterator
from typing import Annotated

from msgspec import Meta

from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.dmath import PI, wrap_pi
from miro_host.estimators.interface import Estimate, Estimator, EstimatorInput, EstimatorParameters
from miro_host.estimators.matrix import (
    Matrix,
    cholesky,
    diagonal,
    forward,
    plus,
    sandwiched,
    solved,
    symmetric,
)
from miro_host.estimators.motion import LEFT, RIGHT, THETA, State, X, Y, driven
from miro_host.estimators.wheel_model import Ramp, Stretch, stretches
from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_host.wheels import Wheels

KEPT = 16
"""Periods of commands that are remembered, 0.53 s: more than the longest age_s + dead_s + lag_s of 0.5 s."""
REFUSED = 5
"""So many measurements in a row are far from the prediction before the filter gives its posture up."""
LEAST_CONFIDENCE = 0.1
LARGEST_FACTOR = 1.5
"""A factor stays between this and its inverse."""
WHEELS = Wheels()

_MEASURED = (X, Y, THETA)
_RANGES = {
    "age_s": (0.0, 0.25),
    "dead_s": (0.0, 0.2),
    "lag_s": (0.0, 0.05),
    "slope_m_s2": (0.1, 1000.0),
    "position_noise_m": (1e-6, 1.0),
    "heading_noise_rad": (1e-6, 3.0),
    "position_drift_m": (0.0, 1.0),
    "heading_drift_rad": (0.0, 3.0),
    "wheel_spread": (1e-6, 0.5),
    "wheel_drift": (0.0, 0.1),
    "gate": (1.0, 1000.0),
}


class EkfParameters(EstimatorParameters, frozen=True, kw_only=True, tag="ekf"):
    """Parameters of the filter; all noise is given as standard deviations.

    Timing: `age_s` from exposure to arrival of a measurement that does not tell its exposure; `dead_s` from arrival to
    the end of the frame (3 ms of computing, 1 ms of key-up, 24 ms on the air in a network of three robots); `lag_s`
    from there to the wheels' speed (firmware, LM629, motor; 2 to 4 ms fit a robot equally well); `slope_m_s2` of the
    LM629's speed.

    Camera: `position_noise_m` per axis, `heading_noise_rad`. The defaults suit the camera `pixels`, whose errors of
    0.5 mm and 0.014 rad change little from frame to frame. For `gaussian` with its default errors they are 0.0081 and
    0.028.

    Robot, per square root of a second: `position_drift_m` per axis, `heading_drift_rad`, `wheel_drift` of each factor.
    `wheel_spread` is the standard deviation of a factor at the beginning: an even spread of 1.5 % has 0.0087.
    """

    age_s: Annotated[float, Meta(ge=0.0, le=0.25)] = 1001.0 / 30000.0
    dead_s: Annotated[float, Meta(ge=0.0, le=0.2)] = 0.028
    lag_s: Annotated[float, Meta(ge=0.0, le=0.05)] = 0.003
    slope_m_s2: Annotated[float, Meta(ge=0.1, le=1000.0)] = 6.0
    position_noise_m: Annotated[float, Meta(ge=1e-6, le=1.0)] = 0.001
    heading_noise_rad: Annotated[float, Meta(ge=1e-6, le=3.0)] = 0.02
    position_drift_m: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.002
    heading_drift_rad: Annotated[float, Meta(ge=0.0, le=3.0)] = 0.01
    wheel_spread: Annotated[float, Meta(ge=1e-6, le=0.5)] = 0.0087
    wheel_drift: Annotated[float, Meta(ge=0.0, le=0.1)] = 0.0002
    gate: Annotated[float, Meta(ge=1.0, le=1000.0)] = 5.0

    def __post_init__(self) -> None:
        for name, (least, most) in _RANGES.items():
            if not least <= getattr(self, name) <= most:
                raise ValueError(
                    f"{name}: {getattr(self, name)!r} is out of range; must be {least} to {most}"
                )

    def estimator(self) -> "Ekf":
        return Ekf(self)


class Ekf(Estimator[EkfParameters]):
    """The filter. `state` and `covariance` (row by row) hold at `at_s`, once a first measurement made them `known`.

    The commands are remembered as rim speeds, the latest first: `*_to_m_s` as sent, `*_start_m_s`
    when they took effect.
    """

    STATE = {
        "known": "?",
        "at_s": "d",
        "state": "5d",
        "covariance": "25d",
        "refused": "q",
        "left_start_m_s": f"{KEPT}d",
        "left_to_m_s": f"{KEPT}d",
        "right_start_m_s": f"{KEPT}d",
        "right_to_m_s": f"{KEPT}d",
    }
    INNER = ("x_m", "y_m", "theta_rad", "left_factor", "right_factor")

    def __init__(self, parameters: EkfParameters) -> None:
        super().__init__(parameters)
        self.known = False
        self.at_s = 0.0
        self.state: State = [0.0, 0.0, 0.0, 1.0, 1.0]
        spread = parameters.wheel_spread * parameters.wheel_spread
        self.covariance = _flat(diagonal([0.0, 0.0, 0.0, spread, spread]))
        self.refused = 0
        self.left_start_m_s = [0.0] * KEPT
        self.left_to_m_s = [0.0] * KEPT
        self.right_start_m_s = [0.0] * KEPT
        self.right_to_m_s = [0.0] * KEPT

    @property
    def left_factor(self) -> float:
        """Radius of the left wheel over the nominal one."""
        return self.state[LEFT]

    @property
    def right_factor(self) -> float:
        """Radius of the right wheel over the nominal one."""
        return self.state[RIGHT]

    def after_load(self) -> None:
        """Raises ValueError for a memory that no step leaves."""
        super().after_load()
        if not all(1.0 / LARGEST_FACTOR <= self.state[index] <= LARGEST_FACTOR for index in (LEFT, RIGHT)):
            raise ValueError(f"the wheel factors {self.state[LEFT:]} are those of no robot")
        if not -PI <= self.state[THETA] <= PI:
            raise ValueError(f"the heading {self.state[THETA]!r} is not between -pi and pi")
        if not 0 <= self.refused < REFUSED:
            raise ValueError(
                f"{self.refused} measurements in a row were refused, which begins anew at {REFUSED}"
            )
        covariance = _square(self.covariance)
        if covariance != symmetric(covariance):
            raise ValueError("the covariance is not symmetric")
        if self.known:
            cholesky(covariance)

    def step(self, given: EstimatorInput) -> Estimate | None:
        self._remember(given)
        if given.measured is not None:
            self._take(given.measured, given)
        if not self.known:
            return None
        delay_s = self.parameters.dead_s + self.parameters.lag_s
        oldest_s = given.t_s + delay_s - (KEPT - 1) * given.period_s
        if self.at_s < oldest_s:
            self._predict(oldest_s, given)
        way = self._way(self.at_s, given.t_s + delay_s, given)
        state, _ = driven(self.state, way, WHEELS.track_m)
        named = dict(zip(self.INNER, state, strict=True))
        return Estimate(
            given.t_s + delay_s, Posture(state[X], state[Y], state[THETA]), state[LEFT], state[RIGHT], named
        )

    def _remember(self, given: EstimatorInput) -> None:
        """The command of one period ago, which takes effect when the one before it has been held for a period."""
        left, right = given.left_m_s, given.right_m_s
        slope = self.parameters.slope_m_s2
        left_start = _held_to_the_end(self.left_start_m_s[0], self.left_to_m_s[0], slope, given.period_s)
        right_start = _held_to_the_end(self.right_start_m_s[0], self.right_to_m_s[0], slope, given.period_s)
        self.left_start_m_s = [left_start, *self.left_start_m_s[:-1]]
        self.left_to_m_s = [left, *self.left_to_m_s[:-1]]
        self.right_start_m_s = [right_start, *self.right_start_m_s[:-1]]
        self.right_to_m_s = [right, *self.right_to_m_s[:-1]]

    def _way(self, from_s: float, to_s: float, given: EstimatorInput) -> Iterator[Stretch]:
        """What the rims do between two times, as far as commands are remembered."""
        delay_s = self.parameters.dead_s + self.parameters.lag_s
        oldest = int((given.t_s + delay_s - from_s) / given.period_s)
        for index in range(min(oldest, KEPT - 1), -1, -1):
            effect_s = given.t_s + delay_s - (index + 1) * given.period_s
            begin_s = max(from_s - effect_s, 0.0)
            end_s = min(to_s - effect_s, given.period_s)
            if begin_s < end_s:
                yield from stretches(
                    Ramp(self.left_start_m_s[index], self.left_to_m_s[index]),
                    Ramp(self.right_start_m_s[index], self.right_to_m_s[index]),
                    self.parameters.slope_m_s2,
                    begin_s,
                    end_s,
                )

    def _take(self, measured: Posture, given: EstimatorInput) -> None:
        """Prediction to the exposure, then update, refusal or a new beginning."""
        p = self.parameters
        exposed_s, confidence = given.t_s - p.age_s, 1.0
        if isinstance(measured, Sighting):
            exposed_s = measured.tick / TICKS_PER_SECOND
            confidence = min(max(measured.confidence, LEAST_CONFIDENCE), 1.0)
        if exposed_s > given.t_s or (self.known and exposed_s <= self.at_s):
            return
        position, heading = p.position_noise_m / confidence, p.heading_noise_rad / confidence
        noise = [position * position, position * position, heading * heading]
        if not self.known:
            self._begin(measured, exposed_s, noise)
            return
        self._predict(exposed_s, given)
        if self._update(measured, noise):
            self.refused = 0
        elif self.refused + 1 < REFUSED:
            self.refused += 1
        else:
            self._begin(measured, exposed_s, noise)

    def _begin(self, measured: Posture, at_s: float, noise: list[float]) -> None:
        """The posture as measured; the factors and their covariance as they are."""
        made = diagonal([*noise, 0.0, 0.0])
        before = _square(self.covariance)
        for i in (LEFT, RIGHT):
            for j in (LEFT, RIGHT):
                made[i][j] = before[i][j]
        self.known, self.refused, self.at_s = True, 0, at_s
        self.state = [measured.x_m, measured.y_m, wrap_pi(measured.theta_rad), *self.state[LEFT:]]
        self.covariance = _flat(made)

    def _predict(self, to_s: float, given: EstimatorInput) -> None:
        """Moves the state and its covariance on to a later time: P = F P F^T + Q."""
        p = self.parameters
        state, by = driven(self.state, self._way(self.at_s, to_s, given), WHEELS.track_m)
        drift = [p.position_drift_m, p.position_drift_m, p.heading_drift_rad, p.wheel_drift, p.wheel_drift]
        grown = diagonal([each * each * (to_s - self.at_s) for each in drift])
        self.covariance = _flat(plus(sandwiched(by, _square(self.covariance)), grown))
        self.state, self.at_s = state, to_s

    def _update(self, measured: Posture, noise: list[float]) -> bool:
        """Corrects state and covariance, this in Joseph's form, which stays positive. False: refused."""
        before = _square(self.covariance)
        innovation = [
            measured.x_m - self.state[X],
            measured.y_m - self.state[Y],
            wrap_pi(measured.theta_rad - self.state[THETA]),
        ]
        lower = cholesky(plus([[before[i][j] for j in _MEASURED] for i in _MEASURED], diagonal(noise)))
        distance2 = 0.0
        for each in forward(lower, innovation):
            distance2 += each * each
        if distance2 > self.parameters.gate * self.parameters.gate:
            return False
        gain = [[*solved(lower, row[:3]), 0.0, 0.0] for row in before]  # K = P H^T S^-1 with H = (1 0)
        for index, row in enumerate(gain):
            self.state[index] += row[0] * innovation[0] + row[1] * innovation[1] + row[2] * innovation[2]
        self.state[THETA] = wrap_pi(self.state[THETA])
        for index in (LEFT, RIGHT):
            self.state[index] = min(max(self.state[index], 1.0 / LARGEST_FACTOR), LARGEST_FACTOR)
        kept = diagonal([1.0] * 5)  # 1 - K H
        for index, row in enumerate(gain):
            for column in _MEASURED:
                kept[index][column] -= row[column]
        spread = sandwiched(gain, diagonal([*noise, 0.0, 0.0]))
        self.covariance = _flat(plus(sandwiched(kept, before), spread))
        return True


def _held_to_the_end(start_m_s: float, to_m_s: float, slope_m_s2: float, period_s: float) -> float:
    """The speed at which the next command finds a wheel."""
    return Ramp(start_m_s, to_m_s).speed(period_s, slope_m_s2)


def _flat(matrix: Matrix) -> list[float]:
    return [each for row in matrix for each in row]


def _square(flat: list[float]) -> Matrix:
    return [flat[begin : begin + 5] for begin in range(0, 25, 5)]
