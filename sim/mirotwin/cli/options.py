"""Options that several commands share, and what is loaded because of them.

What belongs here: the options' words, the choice of engine, loading a firmware image, and what is said of parameters
that cannot be simulated. What does not: single commands.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import click

from miro_exact import engine as engines
from miro_exact.bad_input import BadInput
from miro_exact.domain import DomainError
from miro_host.parts import PartError
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_sim.inputs import TEXT_BYTES, check_regular
from miro_sim.scenario.keys import Scenario

Command = TypeVar("Command", bound=Callable[..., Any])
LONGEST_S = 1e9


class Whole(click.IntRange):
    """A whole number, refused in plain words."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            int(value)
        except ValueError:
            self.fail(f"{value!r} is not a whole number.", param, ctx)
        return super().convert(value, param, ctx)


class Place(click.Path):
    """A path; the empty string is none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "":
            self.fail("the path is empty.", param, ctx)
        return super().convert(value, param, ctx)


class Moment(click.types.FloatParamType):
    """A time in seconds, or with its unit: 1.2, 1.2s, 350ms."""

    name = "time"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        found = re.fullmatch(r"([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*(s|ms|)", f"{value}".strip(), re.ASCII)
        if found is None:
            self.fail(f"{value!r} is not a time, such as 1.2s or 350ms.", param, ctx)
        at_s = float(found[1]) / (1000.0 if found[2] == "ms" else 1.0)
        if at_s > LONGEST_S:
            self.fail(f"{value!r} is later than any run.", param, ctx)
        return at_s


def engine_option(command: Command) -> Command:
    return click.option(
        "--engine",
        type=click.Choice(engines.ENGINES),
        help="How the hot modules run; both give the same bits. Default: compiled if they were built.",
    )(command)


def firmware_option(text: str) -> Callable[[Command], Command]:
    return click.option("--firmware", "firmware", metavar="IMAGE.ihx", type=Place(), help=text)


def set_option(text: str) -> Callable[[Command], Command]:
    return click.option("--set", "settings", metavar="KEY=VALUE", multiple=True, help=text)


def choose_engine(engine: str | None) -> str:
    """Refuses an engine that is not the one of this process (`program.settle_engine`); returns its name."""
    if engine is not None:
        engines.select(engine)
    return engines.active()


def load_image(path: str | Path | None, limit: int = 8192, named: bool = True) -> Image:
    """The firmware image at `path`, or the robot's own. Raises BadInput for what is no image or does not fit.

    `named`: its symbols are needed; the files beside it are read at once, and BadInput is raised for wrong ones.
    """

    if path is not None:
        if not os.path.exists(path):
            raise BadInput(path, "", "there is no such file", "give the path of an .ihx or .hex file")
        check_regular(path)
        if os.path.getsize(path) > TEXT_BYTES:
            raise BadInput(path, "", f"holds more than {TEXT_BYTES >> 20} MiB", "give an .ihx or .hex file")
    image = load_hex(image_path() if path is None else Path(path), limit=limit)
    if named:
        _ = image.symbols.names
    return image


def refuse_steps(scenario: Scenario, origin: str) -> None:
    """For commands that run a scenario without its steps: raises BadInput if it has any."""
    if scenario.step:
        what = f"has {len(scenario.step)} steps, which only `mirotwin run` and `mirotwin test` do"
        raise BadInput(origin, "step", what, "run it, and give the run.mcap that it writes")


@contextmanager
def plain_parameters(label: str, done: str = "run") -> Iterator[None]:
    """Within it, numbers with which nothing can be computed and parts that fail are bad input.

    `label` names the file that they came from.
    """
    try:
        yield
    except DomainError as error:
        what = f"cannot be {done}: {error}; the parameters are far outside those of a real robot"
        raise BadInput(label, "", what) from None
    except PartError as error:
        raise BadInput(label, "", f"cannot be {done}: {error.what}", error.remedy) from None
