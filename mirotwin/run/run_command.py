"""`mirotwin run`: a scenario from its first control period to its files."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from miro_exact.seed import MAX_SEED
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.firmware.held_signals import held_signals
from mirotwin.recording.recorder import source_of
from mirotwin.rerun.faults import report_faults
from mirotwin.run.run_files import RunFiles, digest_in
from mirotwin.run.run_live_options import live_options
from mirotwin.run.run_stops import Stops
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import (
    Place,
    Whole,
    choose_engine,
    engine_option,
    firmware_option,
    plain_parameters,
    set_option,
    stack_option,
)
from mirotwin.shell.outputs import FILES, OutputFolder
from mirotwin.shell.program import complain, show_line, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time, TimeType
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.expectations import expect_option, report_failures, report_steps
from mirotwin.verify.steps.plan import check_symbols
from mirotwin.verify.steps.player import Player
from mirotwin.verify.steps.reading import steps_of
from mirotwin.verify.steps.running import everything, keep_saved

if TYPE_CHECKING:
    from mirotwin.camera.saved_frames import SavedFrames
    from mirotwin.camera.view import View
    from mirotwin.run.run_live import LiveView


@click.command(short_help="Runs a scenario and writes its files.")
@click.argument("scenario")
@click.option("--out", type=Place(path_type=Path), help="Folder for the files. Default: runs/SCENARIO-SEED.")
@click.option(
    "--seed", type=Whole(0, MAX_SEED), default=0, show_default=True, help="Master seed of all noise."
)
@set_option(
    "A key of the scenario, by its path (network.robot.controller.q1_per_s=0.3; with several, network.0.robot.1. and so"
    " on); may be repeated. VALUE is TOML, or else text. The default folder does not change."
)
@expect_option
@firmware_option("Image to run instead of the robot's own.")
@stack_option
@engine_option
@click.option(
    "--record",
    type=click.Choice(["default", "full"]),
    default="default",
    help="full: also every LM629 sample. Default: every control period, and all bytes sent.",
)
@click.option(
    "--frames",
    type=Place(path_type=Path),
    help="Folder for every camera frame as `look` draws it: frame-NNNNNN.png, or netN-frame-NNNNNN.png.",
)
@click.option(
    "--plain-frames", is_flag=True, help="In --frames the pictures alone, 320 x 240, as the PC gets them."
)
@click.option(
    "--record-frames",
    is_flag=True,
    help="Put every frame into the recording, as --plain-frames saves it; `track` and Foxglove read them.",
)
@click.option(
    "--save-at",
    type=TimeType(),
    multiple=True,
    help="Save the world there as at-TICK.world, such as 1.5s, 20ms or 48000t; may be repeated.",
)
@click.option("--to", "to_tick", type=TimeType(), help="End the run there.")
@click.option(
    "--resume",
    type=Place(),
    metavar="FILE.world",
    help="Go on from a saved world of the same scenario, settings, seed and firmware.",
)
@live_options
@click.option("--force", is_flag=True, help="Replace the files of an earlier run in the folders.")
@click.option("--no-figure", is_flag=True, help="Do not draw figure.svg.")
@click.option("-q", "--quiet", is_flag=True, help="No progress bar and no table.")
def run(
    scenario: str,
    out: Path | None,
    seed: int,
    settings: tuple[str, ...],
    expected: tuple[str, ...],
    firmware: str | None,
    stack_from: int | None,
    engine: str | None,
    record: str,
    frames: Path | None,
    plain_frames: bool,
    record_frames: bool,
    save_at: tuple[Time, ...],
    to_tick: Time | None,
    resume: str | None,
    live: tuple[str, int] | None,
    pace: float | None,
    wait: bool,
    force: bool,
    no_figure: bool,
    quiet: bool,
) -> int:
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

    With --live, Foxglove shows the run while it goes (Open connection, Foxglove WebSocket, the URL of the first line).
    Nothing of that changes a bit of the run.

    Exit code 1: a step, or a check of --expect or of the scenario's [expect] failed; 3: the firmware did what it must
    not.
    """
    active = choose_engine(engine)
    text = load(scenario, (*settings, *expected), everything)
    tell_notes(text.notes)
    steps = steps_of(text.scenario, text.origin)
    if steps and record == "full":
        raise click.UsageError(f"--record full does not go with the steps of {scenario}.")
    stops = Stops(save_at, to_tick, resume)
    if stops and (steps or record == "full"):
        other = f"the steps of {scenario}" if steps else "--record full"
        raise click.UsageError(f"--save-at, --resume and --to do not go with {other}.")
    default = Path("runs") / f"{text.scenario.name}-{seed}"
    folder = OutputFolder(out or default, force, (*FILES, *stops.names), ours=out is None)
    if plain_frames and frames is None:
        raise click.UsageError("--plain-frames needs --frames.")
    if live is None and (pace is not None or wait):
        raise click.UsageError("--pace and --live-wait need --live.")
    earlier = "" if out is not None else digest_in(folder.path)
    image = load_firmware(firmware, stack_from=stack_from)
    check_symbols(steps, image, text.origin)

    with plain_parameters(text.origin):
        world = World(text.scenario, seed, image)
        stops.begin(world)
    source = source_of(text, world, record, stops.resumed)
    checks = Checks(world, expectations_of(text.scenario, text.origin))
    player = Player(world, steps, text.origin) if steps else None
    views: list[View] = []
    if frames is not None or record_frames:
        from mirotwin.camera.view import views_of  # loads the pictures' library

        views = views_of(world, text.origin)
    saved = None if frames is None else _saved(frames, views, plain_frames, force)
    with plain_parameters(text.origin), held_signals() as hold, ExitStack() as opened, folder:
        watched = None
        if live is not None:
            watched = _live(opened, live, 1.0 if pace is None else pace, wait, world, checks)
        if saved is not None:
            saved.begin(hold)
        recorded = views if record_frames else []
        run_files = RunFiles(
            folder,
            source,
            world,
            active,
            hold,
            checks,
            text.settings,
            recorded,
            player,
            stops=stops,
            live=watched,
        )
        bar = ProgressBar(f"simulating {world.scenario.name}", world.periods, quiet)
        summary = run_files.fill(bar, None if no_figure else text.scenario.title)
    if earlier not in ("", summary.digest):
        note = f"{folder.path} held a run with other bits (digest {earlier[:12]}..), now replaced"
        tell_notes([f"{note}; --out keeps both"])
    if not quiet:
        from mirotwin.run.run_table import print_table  # loads rich

        print_table(summary, run_files.tracks, folder.path)
    if player is not None:
        keep_saved(player, folder.path)
        return report_faults(world) or report_steps(player, checks)
    failed = report_failures(checks)
    return report_faults(world) or failed


def _saved(folder: Path, views: Sequence[View], plain: bool, force: bool) -> SavedFrames:
    """What saves each frame. Raises OutputError for a folder in which that cannot be done."""
    from mirotwin.camera.frame_folder import FrameFolder
    from mirotwin.camera.saved_frames import SavedFrames

    return SavedFrames(FrameFolder(folder, "--frames", force), views, plain)


def _live(
    opened: ExitStack, at: tuple[str, int], pace: float, wait: bool, world: World, checks: Checks
) -> LiveView:
    """The server for viewers, which `opened` closes. Raises BadInput where it cannot listen."""
    from mirotwin.report.foxglove.server import Server
    from mirotwin.run.run_live import LiveView

    server = opened.enter_context(Server(*at, f"{world.scenario.name}-{world.seed}", complain))
    show_line(f"live {server.url}")
    return LiveView(server, world, checks, pace, wait)
