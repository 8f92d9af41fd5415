"""SUBJECT of the `mirotwin fw` commands: an image, a board, a scenario, a recording or a stream file."""

from __future__ import annotations

import os
from typing import Annotated

import msgspec

from miro_exact import clock
from miro_exact.bad_input import BadInput
from miro_exact.plugins import use_one_of
from miro_robot.inspect.watcher import Watcher
from miro_sim.radio.downlink import TransmissionError
from miro_sim.scenario.board_scenario import AnyText, is_board, load_any
from miro_sim.scenario.file import builtin_names
from miro_sim.world.world import World
from mirotwin.firmware.bare_options import (
    BareOptions,
    has_terminal,
    load_bare_image,
    make_world,
    report,
    target_of,
)
from mirotwin.runs.inspected_run import InspectedRun, watch
from mirotwin.runs.job import load_job
from mirotwin.runs.result import fault_lines
from mirotwin.runs.run import scripted
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.command import Argument, Options
from mirotwin.shell.firmware_image import image_for
from mirotwin.shell.options import (
    FIRMWARE,
    FROM,
    NAME,
    NETWORK,
    SEED,
    SET,
    SLOT,
    TO,
    Engine,
    plain_parameters,
)
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.shell.program import complain, report_lines, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time, window
from mirotwin.verify.expectations import EXPECT, as_settings

IMAGE_SUFFIXES = (".ihx", ".hex", ".ihex")


class SubjectOptions(Options, frozen=True, kw_only=True):
    """SUBJECT and the options of its run."""

    subject: Annotated[str, Argument("SUBJECT", NAME)]
    seed: Annotated[int | None, SEED.saying("Scenario, board: master seed of all noise. Default 0.")] = None
    firmware: Annotated[
        str | None,
        FIRMWARE.saying("Board: its image. Scenario, recording, stream: image to run instead of its own."),
    ] = None
    settings: Annotated[
        tuple[str, ...],
        SET.saying("Scenario, recording, stream: a key to set in its scenario, as for `run`."),
    ] = ()
    expected: Annotated[
        tuple[str, ...],
        EXPECT.saying("Case: a check that judges it, such as FILE.py:CLASS, where that is in a file."),
    ] = ()
    network: Annotated[int | None, NETWORK.saying("Network of the robot. Default 0.")] = None
    slot: Annotated[int | None, SLOT.saying("Slot of the robot. Default: the lowest slot used.")] = None
    plugins: PluginFiles = PluginFiles()
    engine: Engine = None
    bare: BareOptions = BareOptions()

    @property
    def files(self) -> tuple[str | None, ...]:
        """The input files, which must not be written."""
        return (self.subject, self.firmware, *self.bare.files)


class WindowOptions(SubjectOptions, frozen=True, kw_only=True):
    """A subject with its options, and the part of its run that is inspected."""

    from_time: Annotated[Time | None, FROM] = None
    to_time: Annotated[Time | None, TO.saying("End there. Default: the end of the run.")] = None

    def ticks(self, crystal_hz: int) -> tuple[int, int | None]:
        """First and last tick of the window; None: the end of the run. Raises BadInput for an empty window."""
        return window(self.from_time, self.to_time, crystal_hz)


def open_window(options: WindowOptions) -> InspectedRun:
    """The requested run, at its first tick. Raises BadInput where the window is not in it.

    An empty window is refused before anything is read.
    """
    first, last = options.from_time, options.to_time
    if first is None or last is None or first.in_ticks == last.in_ticks:
        options.ticks(clock.TICKS_PER_SECOND)
    run = open_run(options)
    on_board = options.bare.board is not None or is_board(options.subject)
    if on_board and last is None and run.end_tick is None and options.bare.until is None:
        raise BadInput(
            options.subject, "--to", "how long to look is missing", "give --to TIME, such as --to 2s"
        )
    from_tick, to_tick = options.ticks(run.tick_hz)
    begin_tick = run.cpu.cycles * clock.CYCLE_TICKS
    if to_tick is not None and to_tick <= begin_tick:
        reason = f"the run begins at tick {begin_tick}"
        raise BadInput(options.subject, f"--to {to_tick}t", reason, "look later")
    if run.end_tick is not None and from_tick >= run.end_tick:
        reason = f"the run ends at tick {run.end_tick}"
        raise BadInput(options.subject, f"--from {from_tick}t", reason, "look earlier")
    return run


def open_run(options: SubjectOptions) -> InspectedRun:
    """The requested run, at its first tick. Raises BadInput."""
    options.plugins.bring()
    subject = options.subject
    if subject.lower().endswith(IMAGE_SUFFIXES):
        return _image_run(options, subject, options.bare)
    if is_board(subject):
        if options.firmware is None:
            raise BadInput(
                subject, "", "is a board, and no program for it is named", "give --firmware IMAGE.hex"
            )
        return _image_run(options, options.firmware, msgspec.structs.replace(options.bare, board=subject))
    return _robot_run(options)


def look(
    run: InspectedRun, options: WindowOptions, *watchers: Watcher, early_ticks: int = 0, late_ticks: int = 0
) -> int:
    """Runs with `watchers` and reports how the run ended; returns the exit code.

    They watch from `early_ticks` before the window to `late_ticks` behind it, or to the end of the run. Raises BadInput
    if the run ends before the window.
    """
    from_tick, to_tick = options.ticks(run.tick_hz)
    first_tick = max(0, from_tick - early_ticks)
    last_tick = None if to_tick is None else to_tick + late_ticks
    end_tick = min((tick for tick in (run.end_tick, last_tick) if tick is not None), default=None)
    with ProgressBar(f"running {options.subject}", end_tick) as bar:
        try:
            with plain_parameters(options.subject):
                reached = watch(run, watchers, first_tick, last_tick, bar.to)
        except TransmissionError as error:
            now = run.cpu.cycles * clock.CYCLE_TICKS
            raise BadInput(options.subject, "", f"cannot be run beyond tick {now}: {error}") from None
    if not reached:
        end = run.cpu.cycles * clock.CYCLE_TICKS
        raise BadInput(
            options.subject, f"--from {from_tick}t", f"the run ended at tick {end}", "look earlier"
        )
    if run.job is not None or not has_terminal(run.world):
        return report_lines(fault_lines(run.world.devices))
    return report(run.world, options.bare)


def _refuse(options: SubjectOptions, kind: str, *fields: str) -> None:
    for option in options.given(*fields):
        raise BadInput(options.subject, "", f"is {kind}, {option} does not apply to it", "leave it out")


def _image_run(options: SubjectOptions, path: str, bare: BareOptions) -> InspectedRun:
    """An image on the bare processor, or on a board."""
    kind = "an image on the bare processor" if bare.board is None else "a board, or an image on one"
    other = () if path == options.firmware else ("firmware",)
    without_noise = ("seed",) if bare.board is None else ()
    _refuse(options, kind, *without_noise, *other, "settings", "expected", "network", "slot")
    image = load_bare_image(path, bare)
    world = make_world(image, bare, target_of(path, image, bare), seed=options.seed or 0)
    cycles = bare.max_cycles
    return InspectedRun(world, end_tick=None if cycles is None else cycles * clock.CYCLE_TICKS)


def _robot_run(options: SubjectOptions) -> InspectedRun:
    for option in options.bare.given():
        raise BadInput(options.subject, "", f"is no image, {option} does not apply to it", "leave it out")
    subject = options.subject
    is_path = os.path.exists(subject) or "/" in subject or "\\" in subject
    end_tick, job = None, None
    if subject in builtin_names() or subject.endswith(".toml") or not is_path:
        _refuse(options, "a scenario, of which nothing is judged here", "expected")
        text = load_any(subject, (*options.plugins.settings(options.settings), *options.settings))
        tell_notes(text.notes)
        spec = RunSpec.of(text, image_for(text, options.firmware), options.seed or 0)
        with plain_parameters(subject):
            world = (_by_steps(spec, text) if text.scenario.step else spec).world()
    else:
        _refuse(options, "a recording or stream, which has its seed", "seed")
        settings = (*options.settings, *as_settings(options.expected))
        job = load_job(subject, options.firmware, settings)
        complain(*job.notes)
        end_tick = job.end_tick
        with plain_parameters(subject):
            world = job.spec.world()
        if world.robots:  # whole control periods: what follows a case's failure may be looked at
            end_tick = -(-end_tick // world.period_ticks) * world.period_ticks
    if not world.robots:
        _refuse(options, "a board", "network", "slot")
    network, index = _which_robot(world, options)
    return InspectedRun(world, network, index, end_tick, job)


def _by_steps(spec: RunSpec, text: AnyText) -> RunSpec:
    """The run of a scenario with steps, as a script of everything that the steps sent and did. Raises BadInput."""
    from mirotwin.verify.steps.reading import steps_in  # `fw run` starts without

    with ProgressBar("doing its steps", spec.scenario.end_tick) as bar:
        return scripted(msgspec.structs.replace(spec, steps=steps_in(text)), bar.to)


def _which_robot(world: World, options: SubjectOptions) -> tuple[int, int]:
    """(network, place among its devices) of the requested one. Raises BadInput."""
    network = options.network or 0
    if network >= len(world.lines):
        remedy = use_one_of(map(str, range(len(world.lines))))
        raise BadInput(options.subject, f"--network {network}", "there is no such network", remedy)
    slots = [device.slot for device in world.lines[network].devices]
    if options.slot is None:
        return network, 0
    if options.slot not in slots:
        there = ", ".join(map(str, slots))
        raise BadInput(
            options.subject, f"--slot {options.slot}", "no robot in that slot", f"there is {there}"
        )
    return network, slots.index(options.slot)
