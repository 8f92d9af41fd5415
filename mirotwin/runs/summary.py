"""The figures of a run: `summary.json` and the table on the screen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import msgspec

from miro_exact import engine
from miro_exact.bad_input import amount
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND, seconds
from mirotwin.recording.theory.figures import SlidingGains, Theory, gains_of, rms, theory_of
from mirotwin.recording.track import ErrorSample, Tracks, last_second, settled
from mirotwin.runs.learnt import LearntCalibration, LearntWheels
from mirotwin.shell.json_text import json_bytes
from mirotwin.verify.checks.interface import Expectation

if TYPE_CHECKING:
    from miro_sim.world.world import World  # a hot module: not before the engine was chosen


class Tracking(msgspec.Struct, frozen=True):
    """The tracking error of a robot.

    `rms_*`: root mean square over the last second of the run (all of it, if shorter), one value a control period;
    position is the distance. `settling_s`: the last time at which the robot was outside 3 cm or 0.15 rad; 0 if it never
    was; None (not settled) if that time is within the last second. `off_pitch_s`: time in which a corner of the robot's
    square was beyond the edge of the pitch, in whole control periods.
    """

    rms_x_cm: float | None
    rms_y_cm: float | None
    rms_theta_deg: float | None
    rms_position_cm: float | None
    settling_s: float | None
    off_pitch_s: float | None


class RobotTracking(msgspec.Struct, frozen=True, omit_defaults=True):
    """The tracking of one robot among several; `theory` is missing if no host steered it."""

    network: int
    slot: int
    tracking: Tracking
    theory: Theory | None = None


class LinkCounts(msgspec.Struct, frozen=True):
    """Frames sent by all hosts; accepted, rejected (CRC) and stale as counted by the robots' firmware,
    added up.

    `frames_*` of the robots are None when the firmware exports no counters. `bit_errors`: bits that the
    radio turned over, both ways, all listeners.
    """

    frames_sent: int
    frames_accepted: int | None
    frames_rejected: int | None
    frames_stale: int | None
    bit_errors: int


class VisionCounts(msgspec.Struct, frozen=True):
    """Counts of all hosts' cameras: frames exposed, robots not found in them, frames dropped and repeated.

    `wrong`: measurements further off than three times the worst case of the calibration, `swapped`: nearer to another
    robot of the team than to their own; both compared with the true postures, which no host knows.
    """

    frames: int
    lost: int
    dropped: int
    repeated: int
    wrong: int
    swapped: int


class FirmwareCounts(msgspec.Struct, frozen=True):
    """The image, and cycles executed, summed over all robots; `machine_cycles` includes `idle_cycles`."""

    sha256: str
    instructions: int
    machine_cycles: int
    idle_cycles: int
    faults: int


class StepResults(msgspec.Struct, frozen=True, omit_defaults=True):
    """Results of a scenario's steps (`mirotwin.verify.steps`): how many were done, which failed and how.

    `expectations`: the checks that steps began.
    """

    done: int
    count: int
    failed: str = ""
    expectations: tuple[Expectation, ...] = ()


class Plug(msgspec.Struct, frozen=True):
    """A port: how many clients were there and were refused, bytes from and to them, and those that none had read."""

    name: str
    clients: int
    refused: int
    bytes_in: int
    bytes_out: int
    dropped: int


class LiveFigures(msgspec.Struct, frozen=True):
    """A session: virtual seconds in a second of the wall clock, and how far the world was behind it.

    `late_max_ms` in virtual time at most; `late_s`: how much of it was passed 20 ms or more behind.
    """

    realtime: float
    late_max_ms: float
    late_s: float
    plugs: tuple[Plug, ...]


class Summary(msgspec.Struct, frozen=True, omit_defaults=True):
    """`summary.json`. `tracking` and `theory` are the first robot's; `robots` lists all when there are several.

    `wall_s` is the time of the simulation loop, recording included, start-up and figure excluded. `complete` is written
    only if it is false: the run was interrupted, and all figures are of the part before; `reason`: the failed part of
    the scenario, if there is one (its name, robot and time). `resumed_s` is written only for a run that continued a
    saved world: tracking, theory and expectations cover the time from there, counters the time from 0. `set`: the keys
    of the scenario that were set on the command line (`KEY=VALUE`), only where there were some. `calibrations`: of
    hosts that learn their cameras' position, `wheels`: of robots whose estimator learns their wheels. `expectations`:
    the checks of the run, including the always-on ones. `live`: pace of a live session, and traffic of its ports.
    """

    scenario: str
    seed: int
    engine: str
    digest: str
    simulated_s: float
    wall_s: float
    realtime_factor: float
    tracking: Tracking
    link: LinkCounts
    firmware: FirmwareCounts
    vision: VisionCounts | None = None
    calibrations: tuple[LearntCalibration, ...] = ()
    wheels: tuple[LearntWheels, ...] = ()
    theory: Theory | None = None
    robots: tuple[RobotTracking, ...] = ()
    complete: bool = True
    reason: str = ""
    resumed_s: float | None = None
    set: tuple[str, ...] = ()
    expectations: tuple[Expectation, ...] = ()
    live: LiveFigures | None = None
    steps: StepResults | None = None


def tracking_of(samples: Sequence[ErrorSample]) -> Tracking:
    """The figures of one robot; None throughout when there is no sample."""
    if not samples:
        return Tracking(None, None, None, None, None, None)
    last = last_second(samples)
    return Tracking(
        rms_x_cm=rms([sample.x_cm for sample in last]),
        rms_y_cm=rms([sample.y_cm for sample in last]),
        rms_theta_deg=rms([math.degrees(sample.theta_rad) for sample in last]),
        rms_position_cm=rms([sample.position_cm for sample in last]),
        settling_s=_settling_s(samples),
        off_pitch_s=seconds(CONTROL_PERIOD_TICKS * len([sample for sample in samples if sample.off_pitch])),
    )


def rms_name(samples: Sequence[ErrorSample]) -> str:
    """Name of `rms_*` of these samples, for people; with the times if they cover less than a second."""
    last = last_second(samples)
    from_tick, to_tick = last[0].tick, last[-1].tick + CONTROL_PERIOD_TICKS
    if to_tick - from_tick >= TICKS_PER_SECOND:
        return "rms of the last second"
    return f"rms ({seconds(from_tick):.2f} s to {seconds(to_tick):.2f} s)"


def _settling_s(samples: Sequence[ErrorSample]) -> float | None:
    if not settled(samples):
        return None
    outside = [sample.tick for sample in samples if not sample.within_limits]
    return seconds(outside[-1]) if outside else 0.0


def settling_text(samples: Sequence[ErrorSample]) -> str:
    """The settling time as text."""
    settling_s = _settling_s(samples)
    return "not settled" if settling_s is None else f"settled at {settling_s:.2f} s"


def summarise(world: World, tracks: Tracks, wall_s: float, begin_tick: int = 0) -> Summary:
    """The summary of a run of `world` from `begin_tick`, without the optional fields."""
    gains = gains_of(world.scenario)
    counters: Mapping[str, Mapping[str, Any]] = world.counters()
    everyone = tuple(
        RobotTracking(*id, tracking_of(track.errors), theory_of(track.theory, gains.get(id, SlidingGains())))
        for id, track in tracks.robots.items()
    )
    return Summary(
        scenario=world.scenario.name,
        seed=world.seed,
        engine=engine.active(),
        digest=tracks.digest,
        simulated_s=seconds(world.tick),
        wall_s=wall_s,
        realtime_factor=seconds(world.tick - begin_tick) / wall_s if wall_s > 0.0 else 0.0,
        tracking=everyone[0].tracking if everyone else tracking_of([]),
        link=LinkCounts(**counters["link"]),
        firmware=FirmwareCounts(sha256=world.image.sha256 or "", **counters["firmware"]),
        vision=VisionCounts(**counters["vision"]) if counters["vision"] else None,
        theory=everyone[0].theory if everyone else None,
        robots=everyone if len(everyone) > 1 else (),
        resumed_s=seconds(begin_tick) if begin_tick else None,
    )


def off_pitch_text(summary: Summary) -> str:
    """The robots that left the pitch and the durations, as text; empty if none did."""
    everyone = summary.robots or (RobotTracking(0, -1, summary.tracking),)
    off = [
        f"{robot.tracking.off_pitch_s:.2f} s"
        + (f" (net{robot.network}/robot{robot.slot})" if summary.robots else "")
        for robot in everyone
        if robot.tracking.off_pitch_s
    ]
    return f"off it for {', '.join(off)} (the pitch has no walls here)" if off else ""


def vision_text(vision: VisionCounts) -> str:
    """The camera counts as text; zero counts are left out, except lost robots."""
    happened = (
        (vision.dropped, "frame dropped", "frames dropped"),
        (vision.repeated, "frame repeated", "frames repeated"),
        (vision.wrong, "measurement WRONG", "measurements WRONG"),
        (vision.swapped, "robot SWAPPED", "robots SWAPPED"),
    )
    parts = [amount(vision.frames, "frame"), amount(vision.lost, "robot not found", "robots not found")]
    return ", ".join(parts + [amount(*counted) for counted in happened if counted[0]])


def to_json(summary: msgspec.Struct) -> bytes:
    """`summary.json`: indented, keys in the order above, a newline at the end."""
    return json_bytes(summary, indent=2) + b"\n"
