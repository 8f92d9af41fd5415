"""`mirotwin run`: a scenario from its first control period to its files."""

from __future__ import annotations

import hashlib
from pathlib import Path

import click
from rich.table import Table

from miro_exact.bad_input import BadInput
from miro_exact.seed import MAX_SEED
from miro_robot.image import Image
from miro_sim.periods import Period
from miro_sim.scenario.file import ScenarioText, load
from miro_sim.world.world import World
from mirotwin import runner
from mirotwin.cli.console import show
from mirotwin.cli.held_signals import held_signals
from mirotwin.cli.options import (
    Place,
    Whole,
    choose_engine,
    engine_option,
    firmware_option,
    load_image,
    plain_parameters,
    set_option,
)
from mirotwin.cli.program import DONE, FIRMWARE_FAULT, complain
from mirotwin.cli.progress import ProgressBar
from mirotwin.cli.run_files import RunFiles
from mirotwin.files.outputs import OutputFolder
from mirotwin.recording.recorder import Source
from mirotwin.report.summary import Summary, errors_by_robot, off_pitch_text, settling_text


@click.command(short_help="Runs a scenario and writes its files.")
@click.argument("scenario")
@click.option("--out", type=Place(path_type=Path), help="Folder for the files. Default: runs/SCENARIO-SEED.")
@click.option(
    "--seed", type=Whole(0, MAX_SEED), default=0, show_default=True, help="Master seed of all noise."
)
@set_option(
    "A key of the scenario, by its path (network.robot.controller.q1_per_s=0.3; with several, network.0.robot.1. and so"
    " on); may be repeated. VALUE is TOML, or else text. Folder: runs/SCENARIO-SEED all the same."
)
@firmware_option("Image to run instead of the robot's own.")
@engine_option
@click.option(
    "--record",
    type=click.Choice(["default", "full"]),
    default="default",
    help="full: also every LM629 sample. Default: every control period and all bytes on the wire.",
)
@click.option("--force", is_flag=True, help="Replace the files of an earlier run in the folder.")
@click.option("--no-figure", is_flag=True, help="Draw no figure.png, which takes most of a short run's time.")
@click.option("-q", "--quiet", is_flag=True, help="No progress bar and no table.")
def run(
    scenario: str,
    out: Path | None,
    seed: int,
    settings: tuple[str, ...],
    firmware: str | None,
    engine: str | None,
    record: str,
    force: bool,
    no_figure: bool,
    quiet: bool,
) -> int:
    """Runs SCENARIO (a built-in name, or a .toml file) and writes run.mcap, figure.png and summary.json.

    A run that is broken off (Ctrl-C, a full disk, an error) leaves run.part.mcap and summary.part.json instead, with
    all that was recorded; one that is killed leaves run.part.mcap with all but the last half second. decode, export
    and replay read it. Files of an earlier run stay as they are until the new ones are complete.
    """
    active = choose_engine(engine)
    text = load(scenario, settings)
    folder = OutputFolder(out or Path("runs") / f"{text.scenario.name}-{seed}", force)
    image = load_image(firmware)

    source = source_of(text, seed, image, record)
    with plain_parameters(text.origin):
        world = World(text.scenario, seed, image)
    with plain_parameters(text.origin), held_signals() as hold, folder:
        run_files = RunFiles(folder, source, world, active, hold, text.settings)
        bar = ProgressBar(f"simulating {world.scenario.name}", world.periods, quiet)
        summary = run_files.fill(bar, None if no_figure else text.scenario.title)
    if not quiet:
        _print(summary, run_files.periods, folder.path)
    return report_faults(world)


def source_of(text: ScenarioText, seed: int, image: Image, record: str) -> Source:
    """What a recording says that a run was made from."""
    firmware = image.path.read_bytes()
    if hashlib.sha256(firmware).hexdigest() != image.sha256:
        raise BadInput(image.path, "", "changed while it was read", "start again once it is built")
    return Source(
        scenario_name=text.scenario.name,
        scenario_text=text.text,
        seed=seed,
        firmware=firmware,
        firmware_sha256=image.sha256,
        symbols={name: (at.address, at.space) for name, at in image.symbols.names.items()},
        record=record,
    )


def report_faults(world: World) -> int:
    """Says on stderr what the firmware did wrong; returns the exit code."""
    found = runner.faults_by_robot(world)
    for network, slot, faults in found:
        more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
        complain(f"firmware fault: net{network}/robot{slot}: {faults[0]}{more}")
    return FIRMWARE_FAULT if found else DONE


def _print(summary: Summary, periods: list[Period], folder: Path) -> None:
    tracking, link, firmware = summary.tracking, summary.link, summary.firmware
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(style="bold")
    table.add_column()
    table.add_row("scenario", f"{summary.scenario}, seed {summary.seed}")
    if summary.set:
        table.add_row("set", " ".join(summary.set))
    table.add_row(
        "time",
        f"{summary.simulated_s:.2f} s in {summary.wall_s:.2f} s ({summary.realtime_factor:.1f} x real time, "
        f"engine {summary.engine})",
    )
    if tracking.rms_position_cm is not None:
        settled = settling_text(next(iter(errors_by_robot(periods).values())))
        table.add_row(
            "tracking",
            f"rms of the last second {tracking.rms_position_cm:.2f} cm "
            f"(x {tracking.rms_x_cm:.2f}, y {tracking.rms_y_cm:.2f}), {tracking.rms_theta_deg:.2f} deg; {settled}",
        )
    off_pitch = off_pitch_text(summary)
    if off_pitch:
        table.add_row("pitch", off_pitch)
    table.add_row(
        "link",
        f"{link.frames_sent} frames sent, {_known(link.frames_accepted)} accepted, "
        f"{_known(link.frames_rejected)} rejected, {_known(link.frames_stale)} stale; {link.bit_errors} bit errors",
    )
    idle = 100.0 * firmware.idle_cycles / firmware.machine_cycles if firmware.machine_cycles else 0.0
    table.add_row(
        "firmware",
        f"{firmware.instructions} instructions, {firmware.machine_cycles} cycles ({idle:.0f} % idle), "
        f"{firmware.faults} faults",
    )
    table.add_row("digest", summary.digest)
    table.add_row("files", str(folder))
    show(table)


def _known(count: int | None) -> str:
    return "?" if count is None else str(count)
