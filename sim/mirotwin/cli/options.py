"""Options that several commands share, and what is loaded because of them.

What belongs here: the options' words, the choice of engine, loading a firmware image. What does not: single
commands.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from miro_exact import engine as engines
from miro_sim.inputs import TEXT_BYTES, check_regular
from mirotwin.cli.program import UserError

if TYPE_CHECKING:
    from miro_robot.image import Image

Command = TypeVar("Command", bound=Callable[..., Any])


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
            self.fail("the empty string names no place.", param, ctx)
        return super().convert(value, param, ctx)


def engine_option(command: Command) -> Command:
    return click.option(
        "--engine",
        type=click.Choice(engines.ENGINES),
        help="How the hot modules run; both give the same bits. Default: compiled where it was built.",
    )(command)


def firmware_option(text: str) -> Callable[[Command], Command]:
    return click.option("--firmware", "firmware", metavar="IMAGE.ihx", type=Place(), help=text)


def choose_engine(engine: str | None) -> str:
    """Fixes the engine of this process and returns its name. Before any simulation code is imported."""
    if engine is not None:
        engines.select(engine)
    return engines.active()


def load_image(path: str | Path | None, limit: int = 8192) -> Image:
    """The firmware image at `path`, or the robot's own. Raises UserError for what is no image or does not
    fit.
    """
    from miro_robot.firmware import image_path
    from miro_robot.image import ImageError, load_hex

    if path is not None:
        if not os.path.exists(path):
            raise UserError(f"{path}: there is no such file; give the path of an .ihx or .hex file")
        check_regular(path)
        if os.path.getsize(path) > TEXT_BYTES:
            raise UserError(f"{path}: holds more than {TEXT_BYTES >> 20} MiB; give an .ihx or .hex file")
    try:
        return load_hex(image_path() if path is None else Path(path), limit=limit)
    except ImageError as error:
        raise UserError(str(error)) from None
