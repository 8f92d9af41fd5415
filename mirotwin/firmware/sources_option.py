"""Sources of an image, as the `mirotwin fw` commands are told of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from miro_exact.bad_input import BadInput
from miro_robot.image import Image
from miro_robot.image.debug_info import Sources
from mirotwin.firmware.coverage_files import source_folders
from mirotwin.shell.command import Option
from mirotwin.shell.options import IMAGE, NAME

SOURCES = Option(
    "--sources",
    metavar="FOLDER",
    type=NAME,
    help="Folder of the C files; may be repeated. Default: the image's folder.",
    heading=IMAGE,
)
SourceFolders = Annotated[tuple[str, ...], SOURCES]


def sources_of(image: Image, given: Sequence[str]) -> Sources:
    """The folders to look in: those given, the image's own, and the robot's firmware's."""

    return source_folders(image, checked_sources(given))


def checked_sources(given: Sequence[str]) -> Sequence[str]:
    """The folders of --sources. Raises BadInput for what is not one."""
    for folder in given:
        if not Path(folder).is_dir():
            raise BadInput(folder, "--sources", "there is no such folder", "name the one with the C files")
    return given
