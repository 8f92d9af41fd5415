"""Debug files and sources of an image, as the `mirotwin fw` commands find them.

What belongs here: where they are looked for. What does not: reading them (`miro_robot.image.debug_info`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from miro_exact.bad_input import BadInput
from miro_robot.firmware import image_path, source_folder
from miro_robot.image import Image, load_hex
from miro_robot.image.debug_info import Sources
from mirotwin.cli.options import Place


def sources_option(command: Callable[..., Any]) -> Callable[..., Any]:
    return click.option(
        "--sources",
        multiple=True,
        metavar="FOLDER",
        type=Place(),
        help="Folder of the C files; may be repeated. Default: the image's folder.",
    )(command)


def sources_of(image: Image, given: Sequence[str]) -> Sources:
    """The folders to look in: those given, the image's own, and the robot's firmware's."""

    own = source_folder()
    return Sources([*map(Path, checked_sources(given)), image.path.parent, *([own] if own else [])])


def checked_sources(given: Sequence[str]) -> Sequence[str]:
    """The folders of --sources. Raises BadInput for what is none."""
    for folder in given:
        if not Path(folder).is_dir():
            raise BadInput(folder, "--sources", "there is no such folder", "name the one with the C files")
    return given


def with_debug_files(image: Image) -> Image:
    """The image as it has debug files: one out of a recording that is the robot's own has that one's."""

    if image.path.is_file():
        return image
    own = load_hex(image_path())
    return own if own.sha256 == image.sha256 else image
