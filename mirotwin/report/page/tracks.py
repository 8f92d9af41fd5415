"""The columns of `recording.track`, and further ones for pages: velocities, and the motion of each wheel.

The LM629's velocity is known at each exposure. The actual one is the mean over the period before it: encoder counts per
sample of 8192 ticks. NaN if the position was set meanwhile.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, LM629_SAMPLE_TICKS, TICKS_PER_SECOND
from miro_host.wheels import UNITS_PER_COUNT, Wheels
from miro_robot.lm629.commands import BY_OPCODE
from miro_sim.periods import Axis, Period, RobotId, RobotPeriod
from mirotwin.recording.channels import SampleMessage
from mirotwin.recording.track import NAN, RobotTrack, Series, column

SIDES = ("left", "right")
M_S_PER_COUNT = UNITS_PER_COUNT / Wheels().units_per_m_s
"""Wheel speed of one count per sample, of a wheel with the nominal radius."""
_VELOCITY_SCALE = M_S_PER_COUNT / 65536.0
_PERIOD_SAMPLES = CONTROL_PERIOD_TICKS / LM629_SAMPLE_TICKS
_SETS_POSITION = frozenset(
    opcode for opcode, command in BY_OPCODE.items() if command.name in ("RESET", "DFH")
)
_WRAP = 1 << 32


class WheelTrack:
    """One wheel: speeds in m/s at the nominal radius.

    `commanded`: by the host, `profile`: of the LM629, `actual`: measured.
    """

    def __init__(self) -> None:
        self.commanded, self.profile, self.actual = column(), column(), column()
        self._position: int | None = None

    def add(self, axis: Axis, commanded: int | None) -> None:
        before, self._position = self._position, axis.real_position
        self.commanded.append(NAN if commanded is None else commanded / UNITS_PER_COUNT * M_S_PER_COUNT)
        self.profile.append(axis.desired_velocity * _VELOCITY_SCALE)
        again = any(opcode in _SETS_POSITION for _, opcode, _ in axis.commands)
        if before is None or again:
            self.actual.append(NAN)
            return
        moved = (axis.real_position - before + _WRAP // 2) % _WRAP - _WRAP // 2
        self.actual.append(moved / _PERIOD_SAMPLES * M_S_PER_COUNT)


class PageTrack(RobotTrack):
    """One robot. `steered`: a host steers it along its reference. `fine`: the LM629's velocity at each of its samples,
    if the recording is full.
    """

    def __init__(self, id: RobotId, steered: bool, delay_frames: int) -> None:
        super().__init__(delay_frames)
        self.id = id
        self.steered = steered
        self.v_m_s, self.w_rad_s = column(), column()
        self.told_v_m_s, self.told_w_rad_s = column(), column()
        self.wheels = {side: WheelTrack() for side in SIDES}
        self.fine = {side: Series() for side in SIDES}

    @property
    def name(self) -> str:
        return f"net{self.id[0]}/robot{self.id[1]}"

    def add(self, robot: RobotPeriod, tick: int) -> None:
        super().add(robot, tick)
        control = robot.control
        self.v_m_s.append(robot.v_m_s)
        self.w_rad_s.append(robot.w_rad_s)
        self.told_v_m_s.append(NAN if control is None else control.v_m_s)
        self.told_w_rad_s.append(NAN if control is None else control.w_rad_s)
        for side in SIDES:
            self.wheels[side].add(getattr(robot, side), None if control is None else getattr(control, side))


class PageTracks(msgspec.Struct, frozen=True):
    """All robots of a run, in the order of the world. `first`: number of the first control period."""

    first: int
    ticks: list[int]
    robots: list[PageTrack]

    def shows(self, tick: int) -> bool:
        return bool(self.ticks) and self.ticks[0] <= tick < self.ticks[-1] + CONTROL_PERIOD_TICKS

    @property
    def times_s(self) -> list[float]:
        return [tick / TICKS_PER_SECOND for tick in self.ticks]


def tracks_of(periods: Sequence[Period], steered: Sequence[bool], delay_frames: int) -> PageTracks:
    """`steered`: for each network, whether its host steers."""
    robots: dict[RobotId, PageTrack] = {}
    for period in periods:
        for robot in period.robots:
            id = (robot.network, robot.slot)
            if id not in robots:
                robots[id] = PageTrack(id, steered[robot.network], delay_frames)
            robots[id].add(robot, period.tick)
    first = periods[0].index if periods else 0
    return PageTracks(first, [period.tick for period in periods], list(robots.values()))


def add_samples(tracks: PageTracks, samples: Sequence[tuple[RobotId, SampleMessage]]) -> None:
    """Puts the LM629 samples of a full recording to their robots, as far as the tracks go."""
    robots = {robot.id: robot for robot in tracks.robots}
    for id, sample in samples:
        if id in robots and tracks.shows(sample.tick):
            for side, fine in robots[id].fine.items():
                fine.append(sample.tick, getattr(sample, f"{side}_desired_velocity") * _VELOCITY_SCALE)
