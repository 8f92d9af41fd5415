"""The files of the sample project, and writing them into a folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from miro_exact.bad_input import BadInput
from miro_robot.firmware import source_folder
from mirotwin.testing.starter import examples
from mirotwin.testing.starter.writing import all_files, write

FIRMWARE = "firmware"
OF_FIRMWARE = "tests/test_firmware.py"
"""What only this firmware passes, because it names a function of it."""


def files(firmware: bool = True) -> Iterator[tuple[str, Path]]:
    """(name in the project, file) of all, in the order of names; with the C sources if `firmware`."""
    folder = examples.folder() / examples.PROJECT
    sources = source_folder()
    if sources is None:
        what = "the sample project is not part of this installation"
        raise BadInput("", "mirotwin init", what, "install mirotwin from a wheel or a checkout")
    found = [(path.relative_to(folder).as_posix(), path) for path in all_files(folder)]
    if not firmware:
        yield from (one for one in found if one[0] != OF_FIRMWARE)
        return
    found += [(f"{FIRMWARE}/{path.relative_to(sources).as_posix()}", path) for path in all_files(sources)]
    yield from sorted(found)


def begin(target: Path, firmware: bool = True) -> list[str]:
    """Writes the project into `target`, which is made, and returns the names. Raises BadInput if one is there."""
    return write(target, files(firmware), "name a folder that is new or empty")
