"""The speed profile that line and arc share: a ramp, steady speed, and perhaps a ramp down."""

from typing import Annotated

import msgspec
from msgspec import Meta

from miro_host.references.interface import Cm, ReferenceParameters, SamplingPace, TurnDeg


class Ramp(msgspec.Struct, frozen=True):
    """Speed profile: from rest to `speed_m_s` in `ramp_s` at constant acceleration, then steady.

    Before 0 s and after `duration_s` the reference stands still. With `ramp_down` it comes to rest as it started: at
    constant deceleration in the last `ramp_s` (in the second half, if `duration_s` is shorter than two ramps).
    Without, there is no ramp at the end. The instants 0 and `duration_s` themselves belong to the drive.
    """

    speed_m_s: float = 0.20
    ramp_s: float = 0.5
    duration_s: float = 6.0
    ramp_down: bool = False

    def __post_init__(self) -> None:
        for name in ("speed_m_s", "ramp_s", "duration_s"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: must be 0 or greater")

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Path length in m, speed in m/s and acceleration in m/s2 at `t_s`."""
        if t_s < 0.0:
            return 0.0, 0.0, 0.0
        if t_s > self.duration_s:
            return self._whole_length(), 0.0, 0.0
        left_s = self.duration_s - t_s
        if self.ramp_down and left_s < self.ramp_s and left_s < t_s:  # the start, run backwards
            slowing = self.speed_m_s / self.ramp_s
            return self._whole_length() - self._length(left_s), slowing * left_s, -slowing
        if t_s < self.ramp_s:
            return self._length(t_s), self.speed_m_s * t_s / self.ramp_s, self.speed_m_s / self.ramp_s
        return self._length(t_s), self.speed_m_s, 0.0

    def pace(self, step_m: float, length_m: float, period_m: float = 0.0) -> SamplingPace:
        """The pace of a path that has been everywhere after `length_m`, and whose shape repeats after `period_m`."""
        if self.speed_m_s == 0.0 or self.duration_s == 0.0:
            return SamplingPace(self.duration_s, self.duration_s, 0.0)
        until_s = min(self.duration_s, self.ramp_s + length_m / self.speed_m_s)
        steady_s = min(self.duration_s, self.ramp_s + period_m / self.speed_m_s)
        if self.ramp_down and period_m > 0.0:  # it may slow down where it has not sped up
            steady_s = self.duration_s
        return SamplingPace(step_m / self.speed_m_s, until_s, steady_s)

    def _whole_length(self) -> float:
        return 2.0 * self._length(0.5 * self.duration_s) if self.ramp_down else self._length(self.duration_s)

    def _length(self, t_s: float) -> float:
        if t_s < self.ramp_s:
            return self.speed_m_s * t_s * t_s / (2.0 * self.ramp_s)
        return self.speed_m_s * (t_s - 0.5 * self.ramp_s)


class RampedReference(ReferenceParameters, frozen=True, kw_only=True):
    """The parameters of a path that begins somewhere, in some direction, and is run with a speed ramp."""

    start_x_cm: Cm = 0.0
    start_y_cm: Cm = 0.0
    heading_deg: TurnDeg = 0.0
    speed_m_s: Annotated[float, Meta(ge=0.0, le=1.46)] = 0.20
    ramp_s: Annotated[float, Meta(ge=0.0, le=1e3)] = 0.5
    drive_s: Annotated[float, Meta(ge=0.0, le=86_400.0)] | None = None

    def ramp(self, duration_s: float) -> Ramp:
        """The profile for a run of `duration_s`."""
        if self.drive_s is None:
            return Ramp(self.speed_m_s, self.ramp_s, max(duration_s, self.ramp_s))
        return Ramp(self.speed_m_s, self.ramp_s, self.drive_s, ramp_down=True)
