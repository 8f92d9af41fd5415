"""`mirotwin camera look`: one picture of what the camera sees, and what the tracker makes of it."""

from __future__ import annotations

from pathlib import Path

import click

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_exact.seed import MAX_SEED
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.rerun.faults import report_faults
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import (
    Place,
    Whole,
    choose_engine,
    engine_option,
    firmware_option,
    plain_parameters,
    refuse_steps,
    set_option,
)
from mirotwin.shell.outputs import check_new, check_not_input, whole_file
from mirotwin.shell.program import DONE, FIRMWARE_FAULT, show_line, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time, TimeType


@click.command(short_help="Draws what the camera sees and what the tracker makes of it.")
@click.argument("scenario")
@click.option(
    "--at",
    type=TimeType(),
    required=True,
    help="Simulated time, such as 1.2s: the frame at or before it.",
)
@click.option(
    "--out",
    type=Place(path_type=Path),
    help="PNG file to write. Default: SCENARIO-SEED-netN-frame-NNNNNN.png.",
)
@click.option(
    "--seed", type=Whole(0, MAX_SEED), default=0, show_default=True, help="Master seed of all noise."
)
@click.option(
    "--network", type=Whole(0, 0xFFFF), default=0, show_default=True, help="Whose camera and tracker."
)
@set_option("A key of the scenario, as for `run`; may be repeated.")
@firmware_option("Image to run instead of the robot's own.")
@click.option("--plain", is_flag=True, help="The picture alone, 320 x 240, as the PC gets it.")
@click.option("--force", is_flag=True, help="Replace the file at --out.")
@engine_option
def look(
    scenario: str,
    at: Time,
    out: Path | None,
    seed: int,
    network: int,
    settings: tuple[str, ...],
    firmware: str | None,
    plain: bool,
    force: bool,
    engine: str | None,
) -> int:
    """Runs SCENARIO (a built-in name, or a .toml file) to a time and draws the camera's frame, three times enlarged.

    Drawn on it: windows that the tracker looked at (grey; red if the robot was not found there; blue: search of the
    whole picture), an outline around the pixels of each colour class, centroids of the patches, and of each robot its
    measured posture as an arrow, its number and the confidence (1: as expected, 0: nearly refused). Lost robots are
    named.
    """
    choose_engine(engine)
    text = load(scenario, settings)
    tell_notes(text.notes)
    refuse_steps(text.scenario, scenario)
    frame = at.ticks() // CONTROL_PERIOD_TICKS
    name = text.scenario.name
    out = out or Path(f"{name}-{seed}-net{network}-frame-{frame:06d}.png")
    check_new(out, "--out", force)
    check_not_input(out, "--out", scenario, firmware)
    image = load_firmware(firmware)

    from mirotwin.camera.view import view_of  # loads the pictures' library

    with plain_parameters(text.origin):
        world = World(text.scenario, seed, image)
        view = view_of(world, network, text.origin)
        if frame >= world.periods:
            ends_s = seconds(world.periods * CONTROL_PERIOD_TICKS)
            raise BadInput(text.origin, f"--at {at.text}", f"the run ends at {ends_s:.3f} s", "look earlier")
        with ProgressBar(f"simulating {name}", frame) as bar:
            while world.index < frame and not world.finished:
                world.step()
                bar.to(world.index)
        if world.finished:
            return report_faults(world)
        drawn: list[bytes] = []
        view.shows.append(lambda view: drawn.append(view.png(plain)))
        world.begin_period()
    with whole_file(out, "--out") as staging:
        staging.write_bytes(drawn[0])
    show_line(f"{out}")
    return FIRMWARE_FAULT if report_faults(world) else DONE
