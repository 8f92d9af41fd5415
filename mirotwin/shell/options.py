"""Options that several commands share, each declared once, and the loading of their values."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from miro_exact import engine as engines
from miro_exact.bad_input import BadInput, amount, shortened
from miro_exact.domain import MAX_SEED, DomainError
from miro_exact.plugins import PluginError
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.file import builtin_names
from miro_sim.scenario.keys import Scenario
from mirotwin.shell.command import Argument, Option, Word
from mirotwin.shell.times import TimeType

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class Whole(click.IntRange):
    """A whole number, refused in plain words."""

    name = "N"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            int(value)
        except ValueError:  # of more digits than Python reads, too
            self.fail(f"{shortened(repr(value))} is not a whole number.", param, ctx)
        return super().convert(value, param, ctx)


class FiniteNumber(click.FloatRange):
    """A number in a range: neither "nan" nor "inf" is one."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            finite = math.isfinite(float(value))
        except ValueError:
            finite = False
        if not finite:
            self.fail(f"{shortened(repr(value))} is not a number.", param, ctx)
        return super().convert(value, param, ctx)


class PathType(click.Path):
    """A path. The empty string is none, and an option that comes where a path is missing is none either."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "":
            self.fail("the path is empty.", param, ctx)
        if ctx is not None and any(
            value in option.opts for option in ctx.command.params if isinstance(option, click.Option)
        ):
            self.fail(f"the path is missing before {value}; a file of this name is ./{value}.", param, ctx)
        return super().convert(value, param, ctx)


class EngineName(click.Choice):  # type: ignore[type-arg, unused-ignore]
    """An engine: it has to be that of this process (`program.settle_engine`)."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        name = super().convert(value, param, ctx)
        engines.select(name)
        return name


class ScenarioName(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """A built-in scenario, or a file; a shell completes the names of both."""

    name = "scenario"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem  # only a shell that completes needs it

        names = [name for name in builtin_names() if name.startswith(incomplete)]
        return [*map(CompletionItem, names), CompletionItem(incomplete, type="file")]


def iram_address(word: str) -> int:
    """An address of internal RAM as 0x07 to 0xff."""
    if not re.fullmatch(r"0[xX][0-9a-fA-F]{1,2}", word):
        raise ValueError(f"{shortened(repr(word))} is not an address of internal RAM; give 0x00 to 0xff.")
    return int(word, 16)


NAME = PathType()
"""A path as text."""
PATH = PathType(path_type=Path)
IMAGE = "Firmware image"
"""Heading of options that select the image and how it is read."""


SEED = Option("--seed", type=Whole(0, MAX_SEED), help="Master seed of all noise.")
SET = Option("--set", metavar="KEY=VALUE", help="A key of the scenario, as for `run`; may be repeated.")
BOARD = Option("--board", metavar="BOARD", type=NAME, help="A NAME.board.toml, or one of `mirotwin boards`.")
FIRMWARE = Option(
    "--firmware",
    metavar="IMAGE.ihx",
    type=NAME,
    help="Image to run instead of the robot's own.",
    heading=IMAGE,
)
OUT = Option("-o", "--out", type=PATH, help="File to write.")
FORCE = Option("--force", help="Replace the file at --out.")
QUIET = Option("-q", "--quiet", help="No progress bar, no last line.")
JSON = Option("--json", help="Print one JSON document instead of tables.")
JUNIT = Option("--junit", metavar="FILE.xml", type=PATH, help="Write JUnit XML, replacing the file.")
ARTIFACTS = Option("--artifacts", metavar="DIR", type=PATH, help="Folder for what failures leave.")
NETWORK = Option("--network", type=Whole(0, 0xFFFF), help="Number of the network.")
SLOT = Option("--slot", type=Whole(0, 4), help="Slot of the robot.")
BAUD = Option("--baud", type=Whole(50), metavar="RATE", help="Bit rate of the serial line.")
JOBS = Option("--jobs", type=Whole(1, 256), help="Processes. Default: one for each core.")
ALL = Option("--all", help="List everything, not only what comes first.")
FROM = Option("--from", type=TimeType(), help="Begin there, such as 1.5s, 20ms or 48000t.")
RESUME = Option(
    "--resume",
    type=NAME,
    metavar="FILE.world",
    help="Go on from a saved world of the same scenario, settings, seed and firmware.",
)
AT = Option("--at", type=TimeType(), help="A moment of the run, such as 1.5s, 20ms or 48000t.")
TO = Option("--to", type=TimeType(), help="End there.")

ScenarioArgument = Annotated[str, Argument("SCENARIO", ScenarioName())]
Seed = Annotated[int, SEED]
Settings = Annotated[tuple[str, ...], SET]
Firmware = Annotated[str | None, FIRMWARE]
StackFrom = Annotated[
    int | None,
    Option(
        type=Word("ADDRESS", iram_address, "{:#04x}".format),
        help="Where the stack begins (0x..; it ends at 0xff), for an image without a .map.",
        heading=IMAGE,
    ),
]
Engine = Annotated[
    str | None,
    Option(
        type=EngineName(engines.ENGINES),
        help="How the hot modules run; both give the same bits. Default: compiled if they were built.",
    ),
]


def refuse_steps(scenario: Scenario | BoardScenario, origin: str) -> None:
    """For commands that run a scenario without its steps: raises BadInput if it has any."""
    if scenario.step:
        reason = f"has {amount(len(scenario.step), 'step')}, which only `mirotwin run` and `mirotwin test` do"
        raise BadInput(origin, "step", reason, "run it, and give the run.mcap that it writes")


@contextmanager
def plain_parameters(label: str, done: str = "run") -> Iterator[None]:
    """Within this block, numbers that cannot be computed with, and failing parts, become bad input.

    `label` names the file that they came from.
    """
    try:
        yield
    except DomainError as error:
        reason = f"cannot be {done}: {error}; the parameters are far outside those of a real robot"
        raise BadInput(label, "", reason) from None
    except PluginError as error:
        raise BadInput(label, "", f"cannot be {done}: {error.what}", error.remedy) from error
