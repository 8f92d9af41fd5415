"""The robots of a world as bodies on one pitch: which of them touch, checked at the ticks of the contact grid.

Robots that may touch note where they are at each tick of the grid while they run alone (`Robot.run`). The notes are
looked at after the piece. Of a pair that is too far apart to touch in it nothing is asked before it could meet. A
report changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from operator import itemgetter

from miro_exact.clock import NEVER_TICK
from miro_sim.pitch.contact import GRID_TICKS, Pose, next_look, touch
from miro_sim.world.robot import Robot

Pair = tuple[Robot, Robot]


class Bodies:
    """All robots of a world. `touching`: the pairs that touched at the last look."""

    NOT_STATE = ("*",)

    def __init__(self, robots: Sequence[Robot]) -> None:
        self.robots = list(robots)
        self.pairs: list[tuple[Robot, Robot, float]] = [
            (first, other, _most_m_s(first) + _most_m_s(other)) for first, other in combinations(robots, 2)
        ]
        self.looks: list[tuple[int, int]] = []  # in this piece: index of a pair, and its first tick
        self.start_again([])

    def start_again(self, touching: list[Pair]) -> None:
        """The robots are somewhere else than they were: `touching` are those that touch there."""
        self.touching = touching
        # The bounds held for other positions: every pair is looked at in the next piece.
        self.next_ticks = [0] * len(self.pairs)  # of each pair: it cannot touch before
        self.next_tick = 0  # the first of them

    def start_at(self, tick: int) -> None:
        """Takes those that touch at `tick` for touching already: only what begins later is reported."""
        self.start_again(
            [
                (first, other)
                for first, other, _ in self.pairs
                if touch(first.drive.pose_at(tick), other.drive.pose_at(tick))
            ]
        )

    def begin(self, tick: int, until_tick: int) -> None:
        """A piece begins at `tick`: robots that may touch in it note where they are, from when they may."""
        # Those of the piece before: robots that are far apart again must not note on.
        if self.looks:
            self.looks = []
            for robot in self.robots:
                robot.note_from(NEVER_TICK)
        if until_tick < self.next_tick:
            return
        poses = {robot: robot.drive.pose_at(tick) for robot in self.robots}
        for index, (first, other, closing_m_s) in enumerate(self.pairs):
            if self.next_ticks[index] <= until_tick:
                look_tick = next_look(tick, poses[first], poses[other], closing_m_s)
                self.next_ticks[index] = look_tick
                if look_tick <= until_tick:
                    self.looks.append((index, look_tick))
                    for robot in (first, other):
                        # `min`: a robot of several pairs notes from the first of their ticks on.
                        robot.note_from(min(look_tick, robot.grid_tick))
        self.next_tick = min(self.next_ticks)

    def look(self) -> list[tuple[int, Robot, Robot]]:
        """Which pairs have begun to touch in the piece, and when; in the order of time."""
        touches = []
        for index, tick in self.looks:
            first, other, closing_m_s = self.pairs[index]
            while tick < min(first.grid_tick, other.grid_tick):  # both have noted it
                pose, other_pose = _noted(first, tick), _noted(other, tick)
                known = (first, other) in self.touching
                if touch(pose, other_pose) != known:
                    if known:
                        # A new list, here and below: a `Mark` holds the old one, and a wait goes back to it.
                        self.touching = [pair for pair in self.touching if pair != (first, other)]
                    else:
                        self.touching = [*self.touching, (first, other)]
                        touches.append((tick, first, other))
                # Also while they touch: that the touch ends must be seen, or the next one is not reported.
                tick = next_look(tick, pose, other_pose, closing_m_s)
            self.next_ticks[index] = tick
        if self.looks:
            self.next_tick = min(self.next_ticks)
        # They were found pair by pair; the log is in the order of time.
        touches.sort(key=itemgetter(0))
        return touches


def _most_m_s(robot: Robot) -> float:
    """Largest speed of the robot unless a force pushes it, in m/s."""
    params = robot.drive.params
    return math.inf if params.disturbance.is_on() else params.top_speed_m_s()


def _noted(robot: Robot, tick: int) -> Pose:
    """Pose of the robot at a tick of the grid; its last note is of the one before `grid_tick`."""
    # From the end: at which tick the notes begin is not kept.
    return robot.noted[len(robot.noted) - (robot.grid_tick - tick) // GRID_TICKS]
