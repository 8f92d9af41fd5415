"""`mirotwin run`: a scenario from its first control period to its files."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.recording.recorder import source_of
from mirotwin.run.run_files import RunFiles, Stops, digest_in
from mirotwin.run.run_options import RunOptions
from mirotwin.shell.command import command_of
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.held_signals import held_signals
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.outputs import FILES, OutputFolder
from mirotwin.shell.program import tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.expectations import as_settings, report_run, verdict_first
from mirotwin.verify.steps.player import player_of
from mirotwin.verify.steps.reading import everything, steps_of
from mirotwin.verify.steps.running import keep_saved

if TYPE_CHECKING:
    from mirotwin.camera.view import View


@command_of(RunOptions)
def run(options: RunOptions) -> int:
    """Runs SCENARIO (a built-in name, or a .toml file) and writes run.mcap, figure.svg and summary.json.

    A run that is broken off (Ctrl-C, a full disk, an error) leaves run.part.mcap and summary.part.json instead, with
    all that was recorded; one that is killed leaves run.part.mcap with all but the last half second. decode, export
    and replay read it. Files of an earlier run stay as they are until the new ones are complete.

    A file of three lines is another scenario with single keys changed:

    \b
        scenario = "fig6"
        name = "mine"
        set = { network.robot.controller.q1_per_s = 0.3 }

    The steps of a scenario (`[[step]]`) are done, as by `mirotwin test`.

    A run that is resumed has the bits of one that never stopped. Its recording begins with the first whole control
    period, and holds the saved world. Its errors and checks cover the time from there.

    Exit code 1: a step, or a check of --expect or of the scenario's [expect] failed; 3: the firmware did what it must
    not.
    """
    seed, record = options.seed, options.record
    text = load(options.scenario, (*options.settings, *as_settings(options.expected)), everything)
    tell_notes(text.notes)
    steps = steps_of(text.scenario, text.origin)
    if steps and record == "full":
        raise click.UsageError(f"--record full does not go with the steps of {options.scenario}.")
    stops = Stops(options.save_at, options.to_time, options.resume)
    if stops and (steps or record == "full"):
        other = f"the steps of {options.scenario}" if steps else "--record full"
        raise click.UsageError(f"--save-at, --resume and --to do not go with {other}.")
    default = Path("runs") / f"{text.scenario.name}-{seed}"
    folder = OutputFolder(
        options.out or default, options.force, (*FILES, *stops.names), ours=options.out is None
    )
    earlier = "" if options.out is not None else digest_in(folder.path)
    image = load_firmware(options.firmware, stack_from=options.stack_from)

    with plain_parameters(text.origin):
        world = World(text.scenario, seed, image)
        stops.begin(world)
    source = source_of(text, world, record, stops.resumed)
    checks = Checks(world, expectations_of(text.scenario, text.origin), cut=stops.to_tick is not None)
    player = player_of(world, steps, text.origin)
    views: list[View] = []
    if options.frames is not None or options.record_frames:
        from mirotwin.camera.view import views_of  # loads the pictures' library

        views = views_of(world, text.origin)
    saved = None
    if options.frames is not None:
        from mirotwin.camera.frame_folder import FrameFolder

        saved = FrameFolder(options.frames, options.force)
    with (
        verdict_first(world, checks, player),
        plain_parameters(text.origin),
        held_signals() as hold,
        folder,
    ):
        if saved is not None:
            saved.fill(views, hold)
        recorded = views if options.record_frames else []
        move = player.run if player else partial(stops.move, world, folder) if stops else None
        run_files = RunFiles(
            folder, source, world, hold, checks, text.settings, recorded, player, move, stops=stops
        )
        bar = ProgressBar(f"simulating {world.scenario.name}", world.periods, options.quiet)
        summary = run_files.fill(bar, None if options.no_figure else text.scenario.title)
    if earlier not in ("", summary.digest):
        note = f"{folder.path} held a run with other bits (digest {earlier[:12]}..), now replaced"
        tell_notes([f"{note}; --out keeps both"])
    if not options.quiet:
        from mirotwin.run.run_table import print_table  # loads rich

        print_table(summary, run_files.tracks, folder.path)
    code = report_run(world, checks, player)
    if player is not None:
        keep_saved(player, folder.path)
    return code
