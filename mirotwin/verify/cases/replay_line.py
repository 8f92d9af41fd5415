"""The commands that replay a stream or a case, and that open the debugger at its failure."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Annotated

from miro_robot.firmware import image_path
from miro_robot.image import Image
from mirotwin.shell.command import Argument, Option, Options
from mirotwin.shell.options import FIRMWARE, NAME, NETWORK, SEED, SET, SLOT
from mirotwin.shell.plugin_files import NO_FILES, PluginFiles
from mirotwin.verify.expectations import Expected


class CaseOptions(Options, frozen=True, kw_only=True):
    """Options of `mirotwin replay` for a case; the command has more."""

    COMMAND = "replay"
    file: Annotated[str, Argument("FILE", NAME)]
    firmware: Annotated[
        str | None,
        FIRMWARE.saying("Image to run instead of the recorded one (of the robot's own, for a text stream)."),
    ] = None
    expected: Expected = ()
    plugins: PluginFiles = PluginFiles()


class DebugLineOptions(CaseOptions, frozen=True, kw_only=True):
    """Options of `mirotwin debug` for a case, a recording or a scenario with steps; the command has more."""

    COMMAND = "debug"
    seed: Annotated[int | None, SEED] = None
    settings: Annotated[tuple[str, ...], SET] = ()
    network: Annotated[int | None, NETWORK] = None
    slot: Annotated[int | None, SLOT] = None
    at: Annotated[str, Option(help="Where to stand first.")] = ""


def debug_line(
    file: str | PathLike[str],
    firmware: str | PathLike[str] | None = None,
    at_tick: int | None = None,
    expected: tuple[str, ...] = (),
    plugins: PluginFiles = NO_FILES,
) -> str:
    """The command that opens the debugger at the failed check of a case, or at a tick of a recording."""
    image, place = None if firmware is None else f"{firmware}", "" if at_tick is None else f"{at_tick}t"
    return DebugLineOptions(
        file=f"{file}", firmware=image, at=place, expected=expected, plugins=plugins
    ).command_line()


def replay_line(
    stream: str | PathLike[str],
    firmware: str | PathLike[str] | None = None,
    expected: tuple[str, ...] = (),
    plugins: PluginFiles = NO_FILES,
) -> str:
    """The command that plays a stream or a case again, on that image (None: the robot's own).

    `expected`, `plugins`: checks and others in files, FILE.py:CLASS, which a case cannot name.
    """
    image = None if firmware is None else f"{firmware}"
    return CaseOptions(file=f"{stream}", firmware=image, expected=expected, plugins=plugins).command_line()


def foreign_path(image: Image) -> Path | None:
    """The path that names `image` to a command; None for the robot's own, which needs no name."""
    return None if image.path.resolve() == image_path().resolve() else image.path
