"""The folders in which an image's debug files and C files are searched, and the options for them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from pathlib import PureWindowsPath as AnyPath
from typing import Annotated, NamedTuple

from miro_exact.bad_input import BadInput
from miro_robot.firmware import source_folder
from miro_robot.image import Image, ImageError
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.image.keil_map import project_folders
from mirotwin.shell.command import Option
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import IMAGE, NAME

SOURCES = Option(
    "--sources",
    metavar="FOLDER",
    type=NAME,
    help="Folder of the C files; may be repeated. Default: the image's folder.",
    heading=IMAGE,
)
SourceFolders = Annotated[tuple[str, ...], SOURCES]
LinesFrom = Annotated[
    tuple[str, ...],
    Option(
        metavar="IMAGE.ihx",
        type=NAME,
        help="A recorded image as a file, beside which its debug files lie: for its C lines; may be repeated. The"
        " robot's own image needs none.",
        heading=IMAGE,
    ),
]


def with_debug_files(image: Image) -> Image:
    """The image as it has debug files: one out of a recording that is the robot's own has that one's."""
    if image.path.is_file():
        return image
    own = load_firmware(named=False)
    return own if own.sha256 == image.sha256 else image


def is_robots_own(image: Image) -> bool:
    """True if an image is the robot's own firmware, whose C files are installed."""
    return source_folder() is not None and load_firmware(named=False).sha256 == image.sha256


def source_folders(image: Image, given: Sequence[str] = ()) -> Sources:
    """Folders in which C files are searched: those of --sources, the image's own (and the project's above `Objects`),
    and for the robot's firmware its installed one. Raises BadInput for a folder that does not exist.
    """
    folders, own = [*map(Path, checked_sources(given)), *project_folders(image.path)], source_folder()
    if own is not None and is_robots_own(image):
        folders.append(own)
    return Sources(folders)


def checked_sources(given: Sequence[str], option: str = "--sources") -> Sequence[str]:
    """The folders of the option. Raises BadInput for a path that is no folder."""
    for folder in given:
        if not Path(folder).is_dir():
            raise BadInput(folder, option, "there is no such folder", "name the one with the C files")
    return given


def load_images(paths: Sequence[str], *recorded: Image | None) -> list[Image]:
    """The images of --lines-from. Raises BadInput for one that was not recorded."""
    codes = [image.code for image in recorded if image is not None]
    images = [load_firmware(path) for path in paths]
    for path, image in zip(paths, images, strict=True):
        if image.code not in codes:
            raise BadInput(
                path, "--lines-from", "is not a recorded image", "give one that is, or leave it out"
            )
    return images


def debugged_image(image: Image, images: Sequence[Image], sources: Sequence[str]) -> tuple[Image, Sources]:
    """The image with its debug files, those beside one of `images` or the robot's own, and where its C files are.

    Raises BadInput for a folder that is not there.
    """
    known = next((other for other in images if other.code == image.code), with_debug_files(image))
    return known, source_folders(known, sources)


class Place(NamedTuple):
    """A line of a C file: its path from the current folder if it is there or below, else its name; counted from 1."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class Places:
    """The C lines of an image's instructions; none without debug files, or with those of another image."""

    def __init__(self, image: Image) -> None:
        known = with_debug_files(image)
        self._sources = source_folders(known)
        try:
            self._debug = DebugInfo.of(known)
        except ImageError:
            self._debug = DebugInfo()

    def at(self, address: int) -> Place | None:
        line = self._debug.line_at(address)
        return None if line is None else Place(_from_here(self._sources, line.file), line.line)


MOST_FOLDERS = 2000
"""Folders that are searched for a C file."""
_SKIPPED = ("build", "node_modules", "__pycache__", "venv")


def _from_here(sources: Sources, file: str) -> str:
    """The path of a file that one of the folders has; else that of the only file of this name below this one."""
    here, name = Path.cwd(), AnyPath(file).name
    path = sources.path(file)
    if path is not None and path.is_relative_to(here):
        return path.relative_to(here).as_posix()
    paths = []
    for above, folders, names in islice(os.walk(here), MOST_FOLDERS):
        folders[:] = sorted(
            folder for folder in folders if not folder.startswith(".") and folder not in _SKIPPED
        )
        paths += [Path(above, name).relative_to(here).as_posix()] * (name in names)
    return paths[0] if len(paths) == 1 else name
