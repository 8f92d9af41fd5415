"""Tracking errors as the PC could plot them: measurements against the reference at their exposure.

A measurement arrives some frames after its exposure. It is compared with the reference at the exposure, so a delay by
itself is no error: this is the best that a laboratory without another camera can plot.
"""

from __future__ import annotations

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_sim.periods import RobotPeriod
from mirotwin.recording.track import TrackingErrors, error_of
from mirotwin.report.summary import Tracking, tracking_of

LONGEST_FRAMES = 40
"""More than any camera's delay: so long a reference is kept."""


class MeasuredErrors:
    """Errors of one robot as its host sees them. `delay_frames`: of a camera whose measurements bear no tick."""

    def __init__(self, delay_frames: int) -> None:
        self.delay_frames = delay_frames
        self.errors = TrackingErrors()
        self._references: dict[int, Posture] = {}

    def tracking(self, after_tick: int) -> Tracking:
        """The figures of what was exposed after a tick."""
        return tracking_of([sample for sample in self.errors if sample.tick > after_tick])

    def add(self, robot: RobotPeriod, tick: int) -> None:
        """Takes over the measurement of the next control period."""
        self._references[tick] = robot.reference
        self._references.pop(tick - LONGEST_FRAMES * CONTROL_PERIOD_TICKS, None)
        seen = robot.measurement
        if seen is None:
            return
        exposed = seen.tick if isinstance(seen, Sighting) else tick - self.delay_frames * CONTROL_PERIOD_TICKS
        reference = self._references.get(exposed)
        if reference is not None:
            self.errors.append(
                error_of(msgspec.structs.replace(robot, truth=seen, reference=reference), exposed)
            )
