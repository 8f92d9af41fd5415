"""An extended Kalman filter: posture and wheel radii, from the camera and the commands that were sent.

The state is the posture at the last exposure and one factor per wheel, which is its radius over the nominal one. In
each control period:

    1. The command of one period ago is stored with the wheel speeds at the begin of its effect.
    2. A new measurement moves the state to its exposure (prediction) and corrects it (update).
    3. A copy of the state is predicted to the effect of the next command, and returned.

A command that is computed at t takes effect at t + dead_s + lag_s: the lag of the wheels is taken as a delay. So the
commands known at t determine all that the robot does until the next one takes effect. Lost commands are unknown. So the
uncertainty grows by a share `doubt` of each change of the command, and not while commands are constant.

Measurements that are not used:

    None                      not found: the filter predicts. The state stays at the last exposure as long as the
                              commands since then are remembered (16 periods), then it is moved on.
    same or older exposure    ignored: a frame repeated by the grabber has no new data.
    far from the prediction   refused: its distance in standard deviations, sqrt(e^T S^-1 e) with S the covariance of
                              the innovation e = (x, y, theta), is above `gate`. When `REFUSED` measurements in a row
                              are far, the robot is somewhere else: the posture starts again, the factors stay.

A `Sighting` brings the tick of its exposure, counted on the same clock as t_s, and its confidence; the standard
deviations are divided by the confidence, but by no less than `LEAST_CONFIDENCE`. Any other measurement is `age_s` old.
"""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from miro_exact.clock import TICKS_PER_SECOND
from miro_host.estimators.filter import Filter
from miro_host.estimators.interface import Estimate, Estimator, EstimatorInput, EstimatorParameters
from miro_host.estimators.motion import KEPT, Motion
from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_host.wheels import Wheels

REFUSED = 5
"""Consecutive measurements far from the prediction after which the filter restarts its posture."""
LEAST_CONFIDENCE = 0.1
WHEELS = Wheels()
SEEN_NOISE = (0.001, 0.1)
"""Standard deviations of a `Sighting` in m and rad. The tracker's errors of 0.5 mm and 0.014 rad change little from
frame to frame: for a filter that assumes white noise, the same heading error in 25 frames counts as sqrt(50) times that
error in each.
"""
TOLD_NOISE = (0.0081, 0.028)
"""Of any other posture: a third of the bounds in section V-A of the paper, and whole pixels."""


class EkfParameters(EstimatorParameters, frozen=True, kw_only=True, tag="ekf"):
    """Parameters of the filter; all noise is given as standard deviations.

    Timing: `age_s` from exposure to arrival of a measurement without its exposure time; `dead_s` from arrival to the
    end of the frame, left out: the pilot's value for its network; `lag_s` from there to the wheels' speed (firmware,
    LM629, motor; 2 to 4 ms fit a robot equally well); `slope_m_s2` of the LM629's speed.

    Camera: `position_noise_m` per axis, `heading_noise_rad`; left out: `SEEN_NOISE` for measurements with the tick of
    their exposure, as from the cameras `pixels` and `geometric`, and `TOLD_NOISE` for any other posture.

    Robot, per square root of a second: `position_drift_m` per axis, `heading_drift_rad`, `wheel_drift` of each factor.
    `wheel_spread` is the standard deviation of a factor at the beginning: an even spread of 1.5 % has 0.0087. `doubt`:
    the uncertain share of a command's change; one frame in fifty is lost, and 0.14 is the root of that.
    `rim_noise_m_s`: deviation of a rim's mean speed in one period from the commanded speed.
    """

    age_s: Annotated[float, Meta(ge=0.0, le=0.25)] = 1001.0 / 30000.0
    dead_s: Annotated[float, Meta(ge=0.0, le=0.2)] | None = None
    lag_s: Annotated[float, Meta(ge=0.0, le=0.05)] = 0.003
    slope_m_s2: Annotated[float, Meta(ge=0.1, le=1000.0)] = 6.0
    position_noise_m: Annotated[float, Meta(ge=1e-6, le=1.0)] | None = None
    heading_noise_rad: Annotated[float, Meta(ge=1e-6, le=3.0)] | None = None
    position_drift_m: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.002
    heading_drift_rad: Annotated[float, Meta(ge=0.0, le=3.0)] = 0.005
    wheel_spread: Annotated[float, Meta(ge=1e-6, le=0.5)] = 0.0087
    wheel_drift: Annotated[float, Meta(ge=0.0, le=0.1)] = 0.0002
    doubt: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.14
    rim_noise_m_s: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    gate: Annotated[float, Meta(ge=1.0, le=1000.0)] = 5.0

    def estimator(self) -> "Ekf":
        return Ekf(self)

    def filter(self, size: int, *warp: float) -> Filter:
        """A new filter with these parameters, before its first period."""
        drifts = (self.position_drift_m, self.heading_drift_rad, self.wheel_drift, self.rim_noise_m_s)
        motion = Motion(WHEELS.track_m, self.slope_m_s2, self.doubt)
        return Filter(size, motion, self.wheel_spread, drifts, *warp)

    def delay_s(self, given: EstimatorInput) -> float:
        """From now to the effect of the next command."""
        return (given.dead_s if self.dead_s is None else self.dead_s) + self.lag_s

    def noise(self, measured: Posture) -> tuple[float, float]:
        """Standard deviations of a measurement in m and rad."""
        position_m, heading_rad = SEEN_NOISE if isinstance(measured, Sighting) else TOLD_NOISE
        return (
            position_m if self.position_noise_m is None else self.position_noise_m,
            heading_rad if self.heading_noise_rad is None else self.heading_noise_rad,
        )


class Ekf(Estimator[EkfParameters]):
    """The filter, and how many measurements in a row it refused."""

    STATE: ClassVar[Mapping[str, Any]] = {"filter": Filter, "refused": "q"}
    INNER: ClassVar[tuple[str, ...]] = ("x_m", "y_m", "theta_rad", "left_factor", "right_factor")
    SIZE: ClassVar[int] = 5

    def __init__(self, parameters: EkfParameters) -> None:
        super().__init__(parameters)
        self.filter = parameters.filter(self.SIZE)
        self.refused = 0

    def check_memory(self) -> None:
        """Raises ValueError for a number that is not one. There are no other attributes: this class is ours."""
        if not self.filter.finite():
            raise ValueError("the filter holds a number that is not finite")

    def after_load(self) -> None:
        """Raises ValueError for a memory that no step leaves."""
        super().after_load()
        if not 0 <= self.refused < REFUSED:
            raise ValueError(
                f"{self.refused} measurements in a row were refused, the filter starts again at {REFUSED}"
            )

    def step(self, given: EstimatorInput) -> Estimate | None:
        ekf = self.filter
        effect_s = given.t_s + self.parameters.delay_s(given)
        ekf.command(given.left_m_s, given.right_m_s, effect_s, given.period_s)
        self._measure(given)
        if not ekf.known:
            return None
        oldest_s = effect_s - (KEPT - 1) * given.period_s
        if ekf.at_s < oldest_s:
            ekf.predict(oldest_s)
        ekf.run(effect_s)
        motion, state = ekf.motion, ekf.state
        posture = Posture(motion.x_m, motion.y_m, motion.theta_rad)
        return Estimate(effect_s, posture, state[3], state[4], self._named(posture, state))

    def _named(self, posture: Posture, state: list[float], *more: float) -> dict[str, float]:
        """The values in `INNER`."""
        values = posture.x_m, posture.y_m, posture.theta_rad, state[3], state[4], *more
        return dict(zip(self.INNER, values, strict=True))

    def _measure(self, given: EstimatorInput) -> None:
        """Processes the arrived measurement."""
        if given.measured is not None:
            self._see(given.measured, given.t_s)

    def _exposed_s(self, measured: Posture, now_s: float) -> float:
        if isinstance(measured, Sighting):
            return measured.tick / TICKS_PER_SECOND
        return now_s - self.parameters.age_s

    def _see(self, measured: Posture, now_s: float) -> None:
        """Prediction to the exposure, then update, refusal or a new beginning."""
        ekf, exposed_s = self.filter, self._exposed_s(measured, now_s)
        if exposed_s > now_s or (ekf.known and exposed_s <= ekf.at_s):
            return
        position_m, heading_rad = self.parameters.noise(measured)
        if isinstance(measured, Sighting):
            confidence = min(max(measured.confidence, LEAST_CONFIDENCE), 1.0)
            position_m, heading_rad = position_m / confidence, heading_rad / confidence
        seen = measured.x_m, measured.y_m, measured.theta_rad
        noise = position_m * position_m, heading_rad * heading_rad
        if ekf.known:
            ekf.predict(exposed_s)
            if self._believed(measured, noise):
                ekf.see(*seen, *noise)
                self.refused = 0
                return
            self.refused += 1
            if self.refused < REFUSED:
                return
        ekf.start(*seen, exposed_s, *noise)
        self._begin()

    def _begin(self) -> None:
        """The posture is that of one measurement."""
        self.refused = 0

    def _believed(self, measured: Posture, noise: tuple[float, float]) -> bool:
        """True if a measurement is near enough to the prediction."""
        distance2 = self.filter.distance2(measured.x_m, measured.y_m, measured.theta_rad, *noise)
        return distance2 <= self.parameters.gate * self.parameters.gate
