"""Reads an input file whole; refuses devices, and files larger than any valid one.

What belongs here: the checks before and while a file is read. What does not: what is in it.
"""

import os
import stat
from pathlib import Path

from miro_exact.bad_input import BadInput

TEXT_BYTES = 64 << 20
"""For what is written by hand or by a tool chain: scenarios, images, streams, serial input."""
RECORDING_BYTES = 16 << 30
CHUNK_BYTES = 1 << 20


class InputError(BadInput):
    """A file that is not read: `path`, what, remedy."""

    def __init__(self, path: str, what: str, remedy: str) -> None:
        super().__init__(path, "", what, remedy)


def check_no_folder(path: str | Path, likely: str = "") -> None:
    """Refuses a folder; if it has a file called `likely`, that is what was probably meant."""
    if os.path.isdir(path):
        meant = os.path.join(path, likely)
        hint = f", such as {meant}" if os.path.isfile(meant) else ""
        raise InputError(str(path), "is a folder", f"name a file in it{hint}")


def check_regular(path: str | Path) -> None:
    """Refuses what is there and is no regular file: what is read twice cannot come through a pipe."""
    check_no_folder(path)
    if os.path.exists(path) and not os.path.isfile(path):
        raise InputError(str(path), "is not a regular file", "copy the content to a file first")


def read_input(
    path: str | Path, limit: int = TEXT_BYTES, prefix: bytes = b"", prefix_limit: int = 0
) -> bytes:
    """The content of a file or pipe of at most `limit` bytes, or `prefix_limit` if it begins with `prefix`.

    Raises InputError for folders, devices (but the null device, which is empty) and longer ones, OSError as `open`
    does.
    """
    check_no_folder(path)
    with open(path, "rb") as file:
        mode = os.fstat(file.fileno()).st_mode
        if (stat.S_ISCHR(mode) or stat.S_ISBLK(mode)) and not _is_null(path):
            raise InputError(str(path), "is a device", "name a file or a pipe")
        data = bytearray(file.read(CHUNK_BYTES))
        if prefix and data.startswith(prefix):
            limit = prefix_limit
        while len(data) <= limit and (more := file.read(CHUNK_BYTES)):
            data += more
    if len(data) > limit:
        size = f"{limit >> 20} MiB" if limit >= 1 << 20 else f"{limit >> 10} KiB"
        raise InputError(str(path), f"holds more than {size}", "is this the right file?")
    return bytes(data)


def _is_null(path: str | Path) -> bool:
    return os.path.samefile(path, os.devnull)
