"""The robots of a world as bodies on one pitch: which of them touch, seen at the ticks of the contact grid.

Robots that may touch note where they are at each tick of the grid while they run alone (`Robot.run`). The notes are
looked at after the piece. A report changes nothing.
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

    NOT_STATE = ("robots", "pairs", "looks", "touching")

    def __init__(self, robots: Sequence[Robot]) -> None:
        self.robots = robots
        self.pairs: list[tuple[Robot, Robot, float]] = [
            (one, other, one.drive.params.top_speed_m_s() + other.drive.params.top_speed_m_s())
            for one, other in combinations(robots, 2)
        ]
        self.looks: list[tuple[int, Robot, Robot, float]] = []  # in this piece: the first tick of each pair
        self.touching: list[Pair] = []

    def begin(self, tick: int, until_tick: int) -> None:
        """A piece begins at `tick`: robots that may touch in it note where they are, from when they may."""
        self.looks = []
        at = {}
        for robot in self.robots:
            at[robot] = _posture(robot, tick)
            robot.note_from(NEVER_TICK)
        for one, other, closing_m_s in self.pairs:
            look_tick = next_look(tick, at[one], at[other], closing_m_s)
            if look_tick <= until_tick:
                self.looks.append((look_tick, one, other, closing_m_s))
                for robot in (one, other):
                    robot.note_from(min(look_tick, robot.grid_tick))

    def start_at(self, tick: int) -> None:
        """Takes those that touch at `tick` for touching already: only what begins later is reported."""
        self.touching = [
            (one, other) for one, other, _ in self.pairs if touch(_posture(one, tick), _posture(other, tick))
        ]

    def look(self) -> list[tuple[int, Robot, Robot]]:
        """Which pairs have begun to touch in the piece, and when; in the order of time."""
        found = []
        for tick, one, other, closing_m_s in self.looks:
            while tick < min(one.grid_tick, other.grid_tick):  # both have noted it
                postures = _noted(one, tick), _noted(other, tick)
                known = (one, other) in self.touching
                if touch(*postures) != known:
                    if known:
                        self.touching = [pair for pair in self.touching if pair != (one, other)]
                    else:
                        self.touching = [*self.touching, (one, other)]
                        found.append((tick, one, other))
                tick = next_look(tick, *postures, closing_m_s)
        return sorted(found, key=lambda touch: touch[0])


def _posture(robot: Robot, tick: int) -> Posture:
    return Posture(*robot.drive.pose_at(tick))


def _noted(robot: Robot, tick: int) -> Posture:
    """Where the robot was at a tick of the grid; its last note is of the one before `grid_tick`."""
    return Posture(*robot.noted[(tick - robot.grid_tick) // GRID_TICKS])
