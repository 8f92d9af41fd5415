"""The options of `mirotwin run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import click

from miro_sim.scenario.file import LONGEST_S
from mirotwin.shell.command import Option, Options
from mirotwin.shell.options import (
    FORCE,
    JSON,
    JUNIT,
    OUT,
    PATH,
    QUIET,
    RESUME,
    SET,
    TO,
    Engine,
    Firmware,
    ScenarioArgument,
    Seed,
    StackFrom,
)
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.shell.times import Time, TimeType
from mirotwin.verify.expectations import Expected


class RunOptions(Options, frozen=True, kw_only=True):
    COMMAND = "run"
    scenario: ScenarioArgument
    out: Annotated[Path | None, OUT.saying("Folder for the files. Default: runs/SCENARIO-SEED.")] = None
    seed: Seed = 0
    settings: Annotated[
        tuple[str, ...],
        SET.saying(
            "A key of the scenario, by its path (network.robot.controller.q1_per_s=0.3; with several,"
            " network.0.robot.1. and so on); may be repeated. VALUE is TOML, or else text. The default folder does not"
            " change."
        ),
    ] = ()
    expected: Expected = ()
    firmware: Firmware = None
    stack_from: StackFrom = None
    plugins: PluginFiles = PluginFiles()
    engine: Engine = None
    record: Annotated[
        Literal["default", "full"],
        Option(
            type=click.Choice(["default", "full"]),
            help="full: also every LM629 sample. default: every control period, and all bytes sent.",
        ),
    ] = "default"
    frames: Annotated[
        Path | None,
        Option(
            type=PATH,
            help="Folder for every camera frame, 320 x 240, as the PC gets it: frame-NNNNNN.png, or"
            " netN-frame-NNNNNN.png. `camera look` draws one with what the tracker made of it.",
        ),
    ] = None
    record_frames: Annotated[
        bool, Option(help="Put every frame into the recording; `camera track` and Foxglove read them.")
    ] = False
    save_at: Annotated[
        tuple[Time, ...],
        Option(
            type=TimeType(),
            help="Save the world there as at-TICK.world, such as 1.5s, 20ms or 48000t; may be repeated.",
        ),
    ] = ()
    for_time: Annotated[
        Time | None,
        Option(
            "--for",
            type=TimeType(positive=True, longest_s=LONGEST_S),
            help="How long to run, such as 2s: instead of the scenario's duration_s.",
        ),
    ] = None
    to_time: Annotated[Time | None, TO.saying("End the run there.")] = None
    resume: Annotated[str | None, RESUME] = None
    force: Annotated[bool, FORCE.saying("Replace the files of an earlier run in the folders.")] = False
    as_json: Annotated[bool, JSON.saying("Print one JSON document instead of the table.")] = False
    junit: Annotated[Path | None, JUNIT] = None
    no_figure: Annotated[bool, Option(help="Do not draw figure.svg.")] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar and no table.")] = False
