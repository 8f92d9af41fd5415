"""The filter of `ekf` with the encoder counts in the robots' answers. What each source measures, and what only both
together show:

    commands    the desired motion of the wheels: known at once, but possibly not obeyed
    encoders    the actual motion of the wheels, every third or fifth period, some 35 ms late. Alone they never show a
                shift or a turn of the whole pitch, and show scale only as far as the wheel radius is known
    camera      the robot's position, displaced by the warp of a wrong calibration

    wheel factor    camera and encoders differ by the same share of the way, everywhere
    slip            they differ in a burst: the wheels turned and the robot did not follow
    warp            they differ by place: the camera's displacement changes along the path. Its mean over the path
                    cannot be told from the posture, nor its scale from the wheels' mean radius
    disobedience    encoders and commands differ: lost frames, noise on the commands, a motor at its limit, contact.
                    Until the next count it looks like slip

An answer's counts were read at one instant. The filter is moved to that time and corrected by the difference between
each rim's way and the commanded way since the last count. The way is known modulo 65536 counts (0.50 m); the value
nearest to the commanded way is used, so a long silence does no harm if the commands were obeyed within 0.25 m.

An answer may also be old or repeated (ignored), come before the posture is known (counting begins there), be read
before the last exposure (the next one is used), or be impossible by `count_gate` standard deviations, as after a reset
of the robot, whose counts begin at 0 (counting begins there). Without answers this is `ekf`, but for its default of
`rim_noise_m_s`.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.dmath import PI, sincos
from miro_host.estimators.ekf import WHEELS, Ekf, EkfParameters
from miro_host.estimators.filter import Filter
from miro_host.estimators.interface import EstimatorInput
from miro_host.posture import Posture
from miro_host.telemetry_receiver import LastTelemetry, unwrapped
from miro_host.wheels import COUNTS_PER_WHEEL_TURN, nearest

METRES_PER_COUNT = 2.0 * PI * WHEELS.radius_m / COUNTS_PER_WHEEL_TURN
KEPT = 0.7
"""Of surprise and slip, from one measurement to the next."""
SURPRISE = 1.5
"""Mean of the camera's innovations along the heading, in standard deviations, above which the robot is taken to slip.
Of white noise the mean has a standard deviation of 0.42."""


class EkfTelemetryParameters(EkfParameters, frozen=True, kw_only=True, tag="ekf+telemetry"):
    """Those of `ekf`, and: `sampled_s`, time between a robot's reading of its counts and its answer's first start bit
    (0.95 ms for the left one, 0.65 ms for the right one); `count_noise_m`, standard deviation of a rim's way between
    two counts, for rounding and for that instant; `count_gate`, in standard deviations; `warp_m` of the camera's
    displacement per axis and `warp_length_m`, the way over which it changes. A `warp_m` of 0 is a correct camera.
    """

    rim_noise_m_s: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.02
    sampled_s: Annotated[float, Meta(ge=0.0, le=0.02)] = 0.0008
    count_noise_m: Annotated[float, Meta(ge=1e-6, le=0.1)] = 5e-5
    count_gate: Annotated[float, Meta(ge=1.0, le=1000.0)] = 8.0
    warp_m: Annotated[float, Meta(ge=0.0, le=0.1)] = 0.0
    warp_length_m: Annotated[float, Meta(ge=0.01, le=10.0)] = 0.5

    def estimator(self) -> "EkfTelemetry":
        return EkfTelemetry(self)

    def filter(self, size: int, *warp: float) -> Filter:
        return super().filter(size, self.warp_m, self.warp_length_m)


class EkfTelemetry(Ekf):
    """The filter, the last used answer with its counts, the last exposure, and the slip at it.

    `slip_m_s`: speed of the wheels minus that of the robot, averaged over some frames; 0 while deviations are small.
    """

    STATE: ClassVar[Mapping[str, Any]] = {
        "counting": "?",
        "telemetry_tick": "q",
        "left_count": "q",
        "right_count": "q",
        "seen_s": "d",
        "surprise": "d",
        "slip_m_s": "d",
    }
    INNER: ClassVar[tuple[str, ...]] = (*Ekf.INNER, "slip_m_s", "warp_x_m", "warp_y_m")
    SIZE: ClassVar[int] = 9

    parameters: EkfTelemetryParameters

    def __init__(self, parameters: EkfTelemetryParameters) -> None:
        super().__init__(parameters)
        self.counting = False
        self.telemetry_tick = -1
        self.left_count = 0
        self.right_count = 0
        self.seen_s = 0.0
        self.surprise = 0.0
        self.slip_m_s = 0.0

    def _named(self, posture: Posture, state: list[float], *more: float) -> dict[str, float]:
        return super()._named(posture, state, self.slip_m_s, state[7], state[8])

    def _measure(self, given: EstimatorInput) -> None:
        """Processes the camera's measurement and a new answer, in the order of their times."""
        telemetry = given.telemetry
        if telemetry is None or telemetry.tick <= self.telemetry_tick:
            super()._measure(given)
            return
        read_s = telemetry.tick / TICKS_PER_SECOND - self.parameters.sampled_s
        first = given.measured is not None and self._exposed_s(given.measured, given.t_s) < read_s
        if first:
            super()._measure(given)
        if read_s <= given.t_s:
            self.telemetry_tick = telemetry.tick
            self._count(telemetry, read_s)
        if not first:
            super()._measure(given)

    def _count(self, telemetry: LastTelemetry, read_s: float) -> None:
        """Prediction to the instant of the counts, then correction by them, or the beginning of counting."""
        ekf = self.filter
        if not ekf.known or read_s <= ekf.at_s:
            return
        ekf.predict(read_s)
        left_m = self._beyond_m(telemetry.position_left - self.left_count, ekf.left_m)
        right_m = self._beyond_m(telemetry.position_right - self.right_count, ekf.right_m)
        self.left_count, self.right_count = telemetry.position_left, telemetry.position_right
        gate = self.parameters.count_gate if self.counting else 0.0
        noise_m2 = self.parameters.count_noise_m * self.parameters.count_noise_m
        ekf.count(5, left_m, noise_m2, gate)
        ekf.count(6, right_m, noise_m2, gate)
        self.counting = True

    @staticmethod
    def _beyond_m(counts: int, commanded_m: float) -> float:
        """The way of a rim beyond the commanded one; of the ways that fit its counter the nearest."""
        commanded = commanded_m / METRES_PER_COUNT
        whole = nearest(commanded)
        return ((unwrapped(counts, whole) - whole) + (whole - commanded)) * METRES_PER_COUNT

    def _begin(self) -> None:
        super()._begin()
        self.counting = False
        self.seen_s = self.filter.at_s
        self.surprise = self.slip_m_s = 0.0

    def _believed(self, measured: Posture, noise: tuple[float, float]) -> bool:
        """Raises the posture's uncertainty if the camera deviates again and again, so that the wheels are not
        blamed.
        """
        ekf, state = self.filter, self.filter.state
        sin, cos = sincos(state[2])
        x_m, y_m = measured.x_m - state[0] - state[7], measured.y_m - state[1] - state[8]
        ahead_m = x_m * cos + y_m * sin
        spread_m = math.sqrt(
            ekf.along_m2(cos, sin, noise[0]) + self.parameters.warp_m * self.parameters.warp_m
        )
        self.surprise = KEPT * self.surprise + (1.0 - KEPT) * ahead_m / spread_m
        slip_m_s = 0.0
        if abs(self.surprise) > SURPRISE:
            slip_m_s = -ahead_m / (ekf.at_s - self.seen_s)
            turn_rad = ahead_m / WHEELS.track_m  # of which one wheel may slip more than the other
            ekf.loosen(ahead_m * ahead_m, turn_rad * turn_rad)
        self.slip_m_s = KEPT * self.slip_m_s + (1.0 - KEPT) * slip_m_s
        self.seen_s = ekf.at_s
        return super()._believed(measured, noise)
