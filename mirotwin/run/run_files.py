"""Writes the files of a run while it is under way, and the partial files of an interrupted run.

Signals are held except while the world is stepped, so no file is left between two states. The recording is flushed
several times a second, so a killed process loses at most that much.

`--save-at .. --resume .. --to ..` set the begin of a run, the ticks to save, and its end. A world that continues a
saved one has the same bits as an uninterrupted run. A run resumed within a control period first runs to the end of that
period, because only whole periods are recorded.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec.structs import replace

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.inputs import WORLD_BYTES, read_input
from miro_sim.periods import Period
from miro_sim.scenario.board import BoardScenario
from miro_sim.world.world import World
from mirotwin.recording.recorder import Recorder, RunSource
from mirotwin.recording.track import Tracks
from mirotwin.runs.board_summary import AnySummary, SerialCounts, summarise_board
from mirotwin.runs.learnt import learnt_calibrations, learnt_wheels
from mirotwin.runs.run import Run
from mirotwin.runs.summary import LiveFigures, StepResults, summarise, to_json
from mirotwin.shell.held_signals import Hold
from mirotwin.shell.outputs import KEPT, RECORDING, OutputFolder, part_name
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time
from mirotwin.verify.checks.interface import at, in_ms

if TYPE_CHECKING:
    from mirotwin.camera.view import View
    from mirotwin.verify.steps.player import Player

SUMMARY = "summary.json"
FIGURE = "figure.svg"
WORLD_SUFFIX = ".world"


class Stops:
    """Stops of a run of `world`: it is saved into `folder` at each tick of `save_at`, and ends at `to_tick`.

    Raises BadInput for ticks that the run does not reach.
    """

    def __init__(
        self,
        save_at: Sequence[Time],
        to_tick: Time | None,
        resume: str | None = None,
        crystal_hz: int = TICKS_PER_SECOND,
    ) -> None:
        self.save_ticks = sorted({time.ticks(crystal_hz) for time in save_at})
        self.to_tick = None if to_tick is None else to_tick.ticks(crystal_hz)
        self.resume = resume
        self.resumed = b""
        self.begin_tick = 0

    @property
    def names(self) -> list[str]:
        """The files that it writes."""
        return [f"at-{tick}{WORLD_SUFFIX}" for tick in self.save_ticks]

    def begin(self, world: World) -> None:
        """Loads the saved world into `world`, and runs to the end of its control period."""
        if self.resume is not None:
            saved = read_input(self.resume, WORLD_BYTES)
            try:
                world.load(saved)
            except ValueError as error:
                remedy = "give the scenario, --set, --seed and --firmware of the run that saved it"
                raise BadInput(self.resume, "", f"cannot be resumed: {error}", remedy) from None
            if world.in_period:
                world.run_to(world.period_end)
            self.resumed, self.begin_tick = world.save(), world.tick
            for robot in world.robots:  # what was logged before belongs to no record of this run
                robot.board.left.commands.clear()
                robot.board.right.commands.clear()
        self._check(world)

    def _check(self, world: World) -> None:
        end_tick = world.periods * world.period_ticks
        to_tick = end_tick if self.to_tick is None else self.to_tick
        requested = [("--save-at", tick, to_tick) for tick in self.save_ticks]
        if self.to_tick is not None:
            requested.insert(0, ("--to", to_tick, end_tick))
        for option, tick, last in requested:
            if not world.tick < tick <= last:
                reason = f"the run goes from {at(world.tick, world.clock)} to {at(last, world.clock)}"
                place = f"{option} {tick}t ({in_ms(tick, world.clock)})"
                raise BadInput("", place, reason, "give a time between")

    def move(self, world: World, folder: OutputFolder) -> None:
        """Runs the world to its end, or to `to_tick`."""
        waiting = list(self.save_ticks)
        end_tick = self.to_tick or world.periods * world.period_ticks
        while not world.finished and world.tick < end_tick:
            world.run_to(min([end_tick, world.period_end, *waiting[:1]]))
            if waiting and world.tick == waiting[0]:
                folder.part(f"at-{waiting.pop(0)}{WORLD_SUFFIX}").write_bytes(world.save())

    def __bool__(self) -> bool:
        return bool(self.save_ticks or self.to_tick is not None or self.resume is not None)


@dataclass
class RunFiles:
    """Does `run` and fills `folder`, which is open meanwhile.

    The recording gets each frame of `views`. `move` drives the world (None: its run does); `live` returns the figures
    of a session. `stops`: ticks to save at, and the end. `broken_off`: message about the partial files of an
    interrupted run, else "".
    """

    folder: OutputFolder
    source: RunSource
    run: Run
    settings: tuple[str, ...] = ()
    views: Sequence[View] = ()
    move: Callable[[], object] | None = None
    live: Callable[[], LiveFigures] | None = None
    stops: Stops | None = None
    tracks: Tracks = field(default_factory=Tracks, init=False)
    serial: SerialCounts = field(default_factory=SerialCounts, init=False)
    broken_off: str = field(default="", init=False)
    _wall_s: float = field(default=0.0, init=False)

    def fill(self, bar: ProgressBar, hold: Hold, title: str | None) -> AnySummary:
        """Runs everything and returns the summary. On any exception, parts of the recording and the summary are left.

        `hold` holds signals. `title` None: no figure.
        """
        try:
            self._record(bar, hold)
            self.run.finish()
            summary = self._summary(complete=True)
            self.folder.part(SUMMARY).write_bytes(to_json(summary))
            if self.tracks.robots and title is not None:
                from mirotwin.report.figure import draw

                scenario, seed = self.source.scenario_name, self.source.seed
                draw(self.tracks, self.folder.part(FIGURE), scenario=scenario, seed=seed, title=title)
        except BaseException as error:
            self._leave_parts(str(error) if isinstance(error, BadInput) else "")
            raise
        return summary

    def _record(self, bar: ProgressBar, hold: Hold) -> None:
        def begun(recorder: Recorder) -> None:
            for view in self.views:
                view.shows.append(partial(_keep_frame, recorder))

        def progress(period: Period) -> None:
            if alone:
                self.serial.add(period)
            bar.to(self.tracks.count)

        alone = isinstance(self.run.world.scenario, BoardScenario)
        began_s = time.perf_counter()
        try:
            with self.folder.part(RECORDING).open("wb", buffering=0) as stream, bar:
                self.run.record(stream, self.source, self.tracks, hold, begun, progress, self.move)
        finally:
            self._wall_s = time.perf_counter() - began_s

    def _summary(self, complete: bool, reason: str = "") -> AnySummary:
        begin_tick = 0 if self.stops is None else self.stops.begin_tick
        world, player = self.run.world, self.run.player
        every: dict[str, Any] = {
            "complete": complete,
            "reason": reason,
            "set": self.settings,
            "expectations": self.run.checks.verdicts(),
            "steps": None if player is None else self._steps(player),
            "live": None if self.live is None else self.live(),
        }
        if isinstance(world.scenario, BoardScenario):
            return replace(summarise_board(world, self.serial, self._wall_s, begin_tick), **every)
        return replace(
            summarise(world, self.tracks, self._wall_s, begin_tick),
            calibrations=learnt_calibrations(world.networks),
            wheels=learnt_wheels(world.networks),
            **every,
        )

    def _steps(self, player: Player) -> StepResults:
        verdicts = [verdict for checks in player.checks for verdict in checks.verdicts()]
        failed = f"{player.failure}" if player.failure else ""
        return StepResults(player.done, len(player.steps), failed, tuple(verdicts))

    def _leave_parts(self, reason: str) -> None:
        """Writes the partial files of an interrupted run; none if not even one control period was recorded.

        `reason`: the failed part of the scenario, if there is one.
        """
        if not self.tracks.count:
            return
        self.folder.keep = KEPT
        with suppress(OSError):  # a full disk, which is reported as what broke the run off
            self.folder.part(SUMMARY).write_bytes(to_json(self._summary(complete=False, reason=reason)))
        self.broken_off = (
            f"the run broke off after {amount(self.tracks.count, 'control period')},"
            f" recorded in {self.folder.path / part_name(RECORDING)}"
        )


def _keep_frame(recorder: Recorder, view: View) -> None:
    recorder.write_image(view.network, view.tick, view.png(plain=True))


class _Digest(msgspec.Struct):
    """The fields that every summary has."""

    digest: str


def digest_in(folder: Path) -> str:
    """The digest in the summary of an earlier run; "" where there is none that can be read."""
    try:
        return msgspec.json.decode(read_input(folder / SUMMARY), type=_Digest).digest
    except (BadInput, OSError, msgspec.DecodeError):
        return ""
