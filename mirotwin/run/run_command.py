"""`mirotwin run`: a scenario from its first control period to its files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click
from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_sim.scenario.board_scenario import BoardText, load_any
from mirotwin.recording.recorder import source_of
from mirotwin.run.run_files import RunFiles, Stops, digest_in
from mirotwin.run.run_options import RunOptions
from mirotwin.runs.board_summary import AnySummary
from mirotwin.runs.failure_place import located
from mirotwin.runs.result import Result
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.runs.summary import Summary
from mirotwin.shell.command import command_of
from mirotwin.shell.firmware_image import image_for
from mirotwin.shell.held_signals import held_signals
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.outputs import FILES, OutputFolder, check_file
from mirotwin.shell.plugin_files import unused_in
from mirotwin.shell.program import complain, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.results import Results
from mirotwin.verify.checks.expect import expectations_in
from mirotwin.verify.expectations import as_settings
from mirotwin.verify.steps.reading import steps_in

if TYPE_CHECKING:
    from rich.table import Table

    from mirotwin.camera.view import View


@command_of(RunOptions)
def run(options: RunOptions) -> int:
    """Runs SCENARIO (a built-in name, or a .toml file) and writes run.mcap, figure.svg and summary.json.

    SCENARIO may be a board, too: the scenario of a board (`board = "car.board.toml"` in it), or a board file with
    --firmware and --for. The values that its parts measure and show are in the recording; the last ones are in the
    table.

    An interrupted run (Ctrl-C, a full disk, an error) leaves run.part.mcap and summary.part.json instead, with
    everything recorded so far; a killed run leaves run.part.mcap without the last half second. decode, export and
    replay read it. Files of an earlier run stay unchanged until the new ones are complete.

    A file of three lines is another scenario with single keys changed:

    \b
        scenario = "fig6"
        name = "mine"
        set = { network.robot.controller.q1_per_s = 0.3 }

    The steps of a scenario (`[[step]]`) are executed, as by `mirotwin test`.

    A resumed run has the same bits as an uninterrupted one. Its recording begins with the first whole control period,
    and contains the saved world. Its errors and checks cover the time from there.

    Exit code 1: a step, or a check of --expect or of the scenario's [expect] failed; 3: a firmware fault.
    """
    seed, record = options.seed, options.record
    options.plugins.bring()
    settings = (*options.plugins.settings(options.settings), *options.settings)
    text = load_any(
        options.scenario, (*settings, *_duration(options, settings), *as_settings(options.expected))
    )
    alone = isinstance(text, BoardText)
    if alone and (given := options.given("frames", "record_frames", "record")):
        raise click.UsageError(f"{given[0]} is for robots, and {options.scenario} is for a board.")
    expected, steps = expectations_in(text), steps_in(text)
    tell_notes((*text.notes, *unused_in(text.scenario)))
    if steps and record == "full":
        raise click.UsageError(f"--record full does not go with the steps of {options.scenario}.")
    stops = Stops(options.save_at, options.to_time, options.resume, text.scenario.clock)
    if stops and (steps or record == "full"):
        other = f"the steps of {options.scenario}" if steps else "--record full"
        raise click.UsageError(f"--save-at, --resume and --to do not go with {other}.")
    if options.junit is not None:
        check_file(options.junit, "--junit", options.scenario, options.firmware, options.resume)
    default = Path("runs") / f"{text.scenario.name}-{seed}"
    folder = OutputFolder(
        options.out or default, options.force, (*FILES, *stops.names), ours=options.out is None
    )
    earlier = "" if options.out is not None else digest_in(folder.path)
    image = image_for(text, options.firmware, options.stack_from)

    spec = RunSpec(
        scenario=text.scenario,
        image=image,
        seed=seed,
        expected=expected,
        steps=steps,
        cut=stops.to_tick is not None,
        origin=text.origin,
    )
    with plain_parameters(text.origin):
        world = spec.world()
        stops.begin(world)
    source = source_of(text, world, record, stops.resumed)
    for_programs = options.as_json or options.junit is not None
    under_way = Run.traced(spec, world) if for_programs else Run(spec, world)
    views: list[View] = []
    if options.frames is not None or options.record_frames:
        from mirotwin.camera.view import views_of  # loads the pictures' library

        views = views_of(world, text.origin)
    saved = None
    if options.frames is not None:
        from mirotwin.camera.frame_folder import FrameFolder

        saved = FrameFolder(options.frames, options.force)
    run_files = RunFiles(folder, source, under_way, text.settings, stops=stops)
    with (
        reported(run_files),
        plain_parameters(text.origin),
        held_signals() as hold,
        folder,
    ):
        if saved is not None:
            saved.fill(views, hold)
        if options.record_frames:
            run_files.views = views
        if stops:
            run_files.move = partial(stops.move, world, folder)
        bar = ProgressBar(f"simulating {world.scenario.name}", world.periods, options.quiet)
        summary = run_files.fill(bar, hold, None if options.no_figure else text.scenario.title)
    if earlier not in ("", summary.digest):
        note = f"{folder.path} held a run with other bits (digest {earlier[:12]}..), now replaced"
        tell_notes([f"{note}; --out keeps both"])
    if not (options.quiet or options.as_json):
        from mirotwin.shell.console import show

        show(_table(summary, run_files, folder.path))
    result = under_way.result()
    if for_programs:
        _report(under_way, result, summary, options)
    complain(*result.texts)
    under_way.keep_saved(folder.path)
    return result.code


def _report(run: Run, result: Result, summary: AnySummary, options: RunOptions) -> None:
    """Writes the results file with one case: the run."""
    if run.trace is not None:  # a run that was resumed is not known from its beginning
        result = located(run, result)
    again = replace(options, out=None, force=False, as_json=False, junit=None, no_figure=False, quiet=False)
    result = replace(result, again=again.command_line())
    case = result.as_case(run.world.scenario.name, "run")
    results = Results(command="run", cases=[case], verdict=result.verdict, summary=summary)
    if options.as_json:
        results.print_json()
    results.write_junit(options.junit)


def _duration(options: RunOptions, settings: tuple[str, ...]) -> tuple[str, ...]:
    """The setting of --for."""
    time = options.for_time
    if time is None:
        return ()
    clock = TICKS_PER_SECOND
    if time.in_ticks:  # of the crystal, which the scenario says
        clock = load_any(options.scenario, (*settings, "duration_s=1")).scenario.clock
    return (f"duration_s={time.seconds(clock)!r}",)


def _table(summary: AnySummary, run_files: RunFiles, folder: Path) -> Table:
    from miro_host.laws.interface import LawParameters
    from mirotwin.run.board_table import board_table  # load rich
    from mirotwin.run.run_table import table_of

    if isinstance(summary, Summary):
        law = run_files.run.world.scenario.networks[0].robot[0].controller
        polar = isinstance(law, LawParameters) and law.ORIGIN_CLEARANCE_M > 0.0
        return table_of(summary, run_files.tracks, folder, polar)
    return board_table(summary, run_files.serial, f"{run_files.run.world.image.path}", folder)


@contextmanager
def reported(run_files: RunFiles) -> Iterator[None]:
    """Context for code that writes files.

    If it is interrupted, reports the remaining files, and the verdict if there is one (a full disk).
    """
    try:
        yield
    except BaseException as error:
        if run_files.broken_off:
            complain(run_files.broken_off)
        if isinstance(error, BadInput) and run_files.run.tick >= 0:
            complain(*run_files.run.result().texts)
        raise
