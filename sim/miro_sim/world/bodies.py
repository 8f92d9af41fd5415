"""The robots of a world as bodies on one pitch: when pairs have to be checked for contact, and which robots touch.

A report changes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from miro_exact.clock import NEVER_TICK
from miro_host.posture import Posture
from miro_sim.pitch.contact import GRID_TICKS, next_look, touch
from miro_sim.world.robot import Robot

Pair = tuple[Robot, Robot]


class Bodies:
    """All robots of a world. `touching`: the pairs that touched at the last look."""

    NOT_STATE = ("pairs", "touching")

    def __init__(self, robots: Sequence[Robot]) -> None:
        self.pairs: list[tuple[Robot, Robot, float]] = [
            (one, other, one.drive.params.top_speed_m_s() + other.drive.params.top_speed_m_s())
            for one, other in combinations(robots, 2)
        ]
        self.touching: list[Pair] = []

    def next_tick(self, tick: int) -> int:
        """The next tick of the contact grid at which two robots may touch."""
        soonest = NEVER_TICK
        for one, other, closing_m_s in self.pairs:
            soonest = min(soonest, next_look(tick, _posture(one, tick), _posture(other, tick), closing_m_s))
        return soonest

    def start_at(self, tick: int) -> None:
        """Takes those that touch at `tick` for touching already: only what begins later is reported."""
        self.touching = [
            (one, other) for one, other, _ in self.pairs if touch(_posture(one, tick), _posture(other, tick))
        ]

    def look(self, tick: int) -> list[Pair]:
        """The pairs that have begun to touch; asked at ticks of the grid only, else there is nothing to see."""
        if tick % GRID_TICKS or not self.pairs:
            return []
        before = self.touching
        self.start_at(tick)
        return [pair for pair in self.touching if pair not in before]


def _posture(robot: Robot, tick: int) -> Posture:
    return Posture(*robot.drive.pose_at(tick))
