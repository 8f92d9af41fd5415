"""Options that several commands share, and what is loaded because of them.

What belongs here: the options' words, the choice of engine, loading a firmware image. What does not: single
commands.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from miro_protocol import engine as engines

from miro_sim.cli.program import UserError

if TYPE_CHECKING:
    from miro_robot.image import Image

Command = TypeVar("Command", bound=Callable[..., Any])


def engine_option(command: Command) -> Command:
    return click.option(
        "--engine",
        type=click.Choice(engines.ENGINES),
        help="How the hot modules run; both give the same bits. Default: compiled where it was built.",
    )(command)


def firmware_option(text: str) -> Callable[[Command], Command]:
    return click.option("--firmware", "firmware", metavar="IMAGE.ihx", type=click.Path(), help=text)


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

    try:
        return load_hex(image_path() if path is None else Path(path), limit=limit)
    except ImageError as error:
        raise UserError(str(error)) from None
