"""The options of `mirotwin run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import click

from miro_exact.bad_input import shortened
from mirotwin.rerun.pacing import FASTEST
from mirotwin.shell.command import Option, Options
from mirotwin.shell.options import (
    FORCE,
    OUT,
    PATH,
    QUIET,
    RESUME,
    SET,
    TO,
    Engine,
    FiniteNumber,
    Firmware,
    ScenarioArgument,
    Seed,
    StackFrom,
)
from mirotwin.shell.times import Time, TimeType
from mirotwin.verify.expectations import Expected

HERE = "127.0.0.1"
PORT = 8765
"""Where Foxglove looks first."""
HIGHEST_PORT = 65_535
LIVE = "Watching it live"


class Address(NamedTuple):
    """Where a server listens."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


DEFAULT = Address(HERE, PORT)


class HostPortType(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """HOST:PORT, or PORT."""

    name = "host:port"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, Address):
            return value
        host, _, port = f"{value}".rpartition(":")
        if not (port.isascii() and port.isdecimal() and len(port) <= 5) or int(port) > HIGHEST_PORT:
            self.fail(
                f"{shortened(repr(value))} is no HOST:PORT; write --live={DEFAULT}, or --live alone at the end."
            )
        return Address(host.strip("[]") or HERE, int(port))


class PaceFactor(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """A positive number, or "max" (0.0)."""

    name = "factor"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "max":
            return 0.0
        return FiniteNumber(0.0, FASTEST, min_open=True).convert(value, param, ctx)

    def written(self, value: float) -> str:
        return f"{value:g}" if value else "max"


PACE = Option(
    "--pace",
    type=PaceFactor(),
    help="Virtual seconds in a second of the wall clock, or max.",
)


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
            help="Folder for every camera frame as `camera look` draws it: frame-NNNNNN.png, or"
            " netN-frame-NNNNNN.png.",
        ),
    ] = None
    plain_frames: Annotated[
        bool, Option(help="In --frames the pictures alone, 320 x 240, as the PC gets them.", needs="frames")
    ] = False
    record_frames: Annotated[
        bool,
        Option(
            help="Put every frame into the recording, as --plain-frames saves it; `camera track` and Foxglove read"
            " them."
        ),
    ] = False
    save_at: Annotated[
        tuple[Time, ...],
        Option(
            type=TimeType(),
            help="Save the world there as at-TICK.world, such as 1.5s, 20ms or 48000t; may be repeated.",
        ),
    ] = ()
    to_time: Annotated[Time | None, TO.saying("End the run there.")] = None
    resume: Annotated[
        str | None,
        RESUME,
    ] = None
    live: Annotated[
        Address | None,
        Option(
            type=HostPortType(),
            metavar="[HOST:PORT]",
            alone=f"{DEFAULT}",
            help=f"Let Foxglove watch. Default place: {DEFAULT}; port 0 is any that is free.",
            heading=LIVE,
        ),
    ] = None
    pace: Annotated[float | None, PACE.saying(f"{PACE.help} Default: 1.", heading=LIVE, needs="live")] = None
    live_wait: Annotated[
        bool,
        Option(help="Begin when a viewer is there and has asked for topics.", heading=LIVE, needs="live"),
    ] = False
    force: Annotated[bool, FORCE.saying("Replace the files of an earlier run in the folders.")] = False
    no_figure: Annotated[bool, Option(help="Do not draw figure.svg.")] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar and no table.")] = False
