"""`mirotwin camera look`: one camera picture, with the tracker's result drawn on it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_sim.scenario.file import load
from mirotwin.runs.result import fault_lines
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.command import Options, command_of
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import (
    AT,
    FORCE,
    NETWORK,
    OUT,
    Engine,
    Firmware,
    ScenarioArgument,
    Seed,
    Settings,
    plain_parameters,
    refuse_steps,
)
from mirotwin.shell.outputs import check_new, whole_file
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.shell.program import report_lines, show_line, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time


class LookOptions(Options, frozen=True, kw_only=True):
    COMMAND = "camera look"
    scenario: ScenarioArgument
    at: Annotated[Time, AT.saying("Simulated time, such as 1.2s: the frame at or before it.")]
    out: Annotated[
        Path | None, OUT.saying("PNG file to write. Default: SCENARIO-SEED-netN-frame-NNNNNN.png.")
    ] = None
    seed: Seed = 0
    network: Annotated[int, NETWORK.saying("Whose camera and tracker.")] = 0
    settings: Settings = ()
    firmware: Firmware = None
    plugins: PluginFiles = PluginFiles()
    force: Annotated[bool, FORCE] = False
    engine: Engine = None


@command_of(LookOptions)
def look(options: LookOptions) -> int:
    """Runs SCENARIO (a built-in name, or a .toml file) to a time and draws the camera's frame, three times enlarged.

    Drawn on it: windows that the tracker looked at (grey; red if the robot was not found there; blue: search of the
    whole picture), an outline around the pixels of each colour class, centroids of the patches, and of each robot its
    measured posture as an arrow, its number and the confidence (1: as expected, 0: nearly refused). Lost robots are
    named.
    """
    scenario, seed, network, moment = options.scenario, options.seed, options.network, options.at
    options.plugins.bring()
    text = load(scenario, (*options.plugins.settings(options.settings), *options.settings))
    tell_notes(text.notes)
    refuse_steps(text.scenario, scenario)
    frame = moment.ticks() // CONTROL_PERIOD_TICKS
    name = text.scenario.name
    out = options.out or Path(f"{name}-{seed}-net{network}-frame-{frame:06d}.png")
    check_new(out, "--out", options.force, scenario, options.firmware)
    image = load_firmware(options.firmware)

    from mirotwin.camera.view import view_of  # loads the pictures' library

    with plain_parameters(text.origin):
        world = RunSpec.of(text, image, seed).world()
        view = view_of(world, network, text.origin)
        if frame >= world.periods:
            ends_s = seconds(world.periods * CONTROL_PERIOD_TICKS)
            raise BadInput(
                text.origin, f"--at {moment.text}", f"the run ends at {ends_s:.3f} s", "look earlier"
            )
        with ProgressBar(f"simulating {name}", frame) as bar:
            while world.index < frame and not world.finished:
                world.step()
                bar.to(world.index)
        if world.finished:
            return report_lines(fault_lines(world.robots))
        drawn: list[bytes] = []
        view.shows.append(lambda view: drawn.append(view.png(plain=False)))
        world.begin_period()
    with whole_file(out, "--out") as staging:
        staging.write_bytes(drawn[0])
    show_line(f"{out}")
    return report_lines(fault_lines(world.robots))
