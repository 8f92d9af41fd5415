"""The tracker's data about one robot: its last two sightings, and the predicted place."""

from __future__ import annotations

import math

from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.dmath import wrap_pi
from miro_exact.state import TICK
from miro_host.posture import Posture

MOST_SPEED_M_S = 2.0
"""Largest speed of a robot and its patches, in m/s, also while it turns."""
REACH_M = 0.010
"""Added to the distance that a robot can go since its last sighting, for errors of measurement, in metres."""
LONGEST_GAP_S = 0.2
"""Sightings further apart than this, in seconds, give no velocity."""
LONGEST_AHEAD_S = 0.1
"""Longest prediction, in seconds: a lost robot has often hit something."""

_PLACE = ("d", -100.0, 100.0)
_HEADING = ("d", -3.2, 3.2)


class Sighting(Posture, frozen=True):
    """A measured posture, the tick of the exposure and how good the pair of patches was.

    `confidence`: how far the pair is from the bounds of what is taken for a robot. 1 is a pair with the pattern's
    distance and patches of the expected area, 0 is a pair on a bound. It says nothing about the calibration.
    """

    tick: int
    confidence: float


class Track:
    """The last sighting, and the one before it; `seen` counts them up to 2."""

    STATE = {
        "seen": ("q", 0, 2),
        "tick": TICK,
        "x_m": _PLACE,
        "y_m": _PLACE,
        "theta_rad": _HEADING,
        "before_tick": TICK,
        "before_x_m": _PLACE,
        "before_y_m": _PLACE,
        "before_theta_rad": _HEADING,
    }

    def __init__(self) -> None:
        self.seen = self.tick = self.before_tick = 0
        self.x_m = self.y_m = self.theta_rad = 0.0
        self.before_x_m = self.before_y_m = self.before_theta_rad = 0.0

    def __repr__(self) -> str:
        return f"Track(seen={self.seen}, tick={self.tick}, {(self.x_m, self.y_m, self.theta_rad)})"

    def after_load(self) -> None:
        """Raises ValueError for two sightings in the wrong order."""
        if self.seen == 2 and self.before_tick >= self.tick:
            raise ValueError(f"the sighting before tick {self.tick} has tick {self.before_tick}")

    def remember(self, sighting: Sighting) -> None:
        """Takes the next sighting; one of the same tick replaces the last, an older one starts again."""
        tick = sighting.tick
        if self.seen and tick > self.tick:
            self.before_tick = self.tick
            self.before_x_m = self.x_m
            self.before_y_m = self.y_m
            self.before_theta_rad = self.theta_rad
            self.seen = 2
        elif self.seen == 0 or tick < self.tick:
            self.seen = 1
        self.tick = tick
        self.x_m = sighting.x_m
        self.y_m = sighting.y_m
        self.theta_rad = sighting.theta_rad

    def unseen_s(self, tick: int) -> float:
        """Seconds since the last sighting."""
        return (tick - self.tick) / TICKS_PER_SECOND

    def reach_m(self, tick: int) -> float:
        """Largest distance from its last sighting at which it is searched at a tick, in metres."""
        return MOST_SPEED_M_S * self.unseen_s(tick) + REACH_M

    def predicted(self, tick: int) -> tuple[float, float, float]:
        """x, y and heading at a tick if it goes and turns on as between its last two sightings."""
        gap_s = (self.tick - self.before_tick) / TICKS_PER_SECOND
        if self.seen < 2 or gap_s > LONGEST_GAP_S:
            return self.x_m, self.y_m, self.theta_rad
        ahead = max(0.0, min(self.unseen_s(tick), LONGEST_AHEAD_S)) / gap_s
        dx, dy = self.x_m - self.before_x_m, self.y_m - self.before_y_m
        length_m = math.sqrt(dx * dx + dy * dy)
        most_m = MOST_SPEED_M_S * gap_s
        ahead_x = ahead * most_m / length_m if length_m > most_m else ahead
        turn = wrap_pi(self.theta_rad - self.before_theta_rad)
        return self.x_m + ahead_x * dx, self.y_m + ahead_x * dy, wrap_pi(self.theta_rad + ahead * turn)
