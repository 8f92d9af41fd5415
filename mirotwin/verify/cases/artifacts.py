"""The folder of files for a failure, in one form for pytest, `mirotwin test` and `mirotwin conform`.

report.txt        the failure, and the commands that repeat it
case.stream       the input with the failed check: `mirotwin replay` repeats its verdict
sent.stream       the input without a verdict, if no check can judge the failure
firmware.ihx      the image, with its .map, .cdb and .rst files: `replay` and `report` find it beside the stream; not
                  where it is the robot's own, which every installation has
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from miro_exact.bad_input import BadInput, encodable
from miro_robot.image import Image
from miro_robot.image.debug_info import debug_files
from mirotwin.shell.command import command_line, operand
from mirotwin.shell.outputs import reason_of, write_files
from mirotwin.verify.cases.replay_line import debug_line, foreign_path, replay_line

REPORT, CASE, SENT = "report.txt", "case.stream", "sent.stream"
CASES = (CASE, SENT)
PAGE = "report.html"
FIRMWARE = "firmware.ihx"
FILES = (REPORT, CASE, SENT, PAGE)
_REMEDY = "choose another folder"


def clear(folder: Path, *others: str) -> None:
    """Removes files that an earlier run left there, including `others`, and nothing else."""
    for name in (*FILES, *image_files(folder), *others):
        (folder / name).unlink(missing_ok=True)
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def leave(folder: Path, report: str, files: Mapping[str, bytes]) -> None:
    """Writes the report and these files (name -> content) into the folder, all or none. Raises OSError, OutputError."""
    write_files(folder, {REPORT: encodable(report).encode(), **files}, _REMEDY)


def stream_files(case: str | None, sent: str, image: Image) -> dict[str, bytes]:
    """The case, or without a case the input as a stream, with the image."""
    name, stream = (SENT, sent) if case is None else (CASE, case)
    return {name: encodable(stream).encode(), **_image_content(image)}


def nothing_left(folder: Path, error: OSError | BadInput) -> str:
    """A line with the reason why the folder is empty; the verdict is still valid."""
    if isinstance(error, OSError):
        reason = reason_of(error)
    else:
        reason = f"{error.what}; {error.remedy}" if Path(error.path) == folder else f"{error}"
    return f"nothing could be left in {folder}: {reason}"


def image_files(folder: Path) -> list[str]:
    """Names of the image and its debug files in such a folder."""
    return [FIRMWARE, *debug_files(folder / FIRMWARE, Path(FIRMWARE).stem)]


def leave_image(folder: Path, image: Image) -> None:
    """Copies the image's own file, if it still is the image that ran. Raises OSError, OutputError."""
    if files := _image_content(image):
        write_files(folder, files, _REMEDY)


def _image_content(image: Image) -> dict[str, bytes]:
    if foreign_path(image) is None or not image.path.is_file():
        return {}
    content = image.path.read_bytes()
    if hashlib.sha256(content).hexdigest() != image.sha256:
        return {}
    beside = debug_files(image.path, Path(FIRMWARE).stem)
    return {FIRMWARE: content, **{name: path.read_bytes() for name, path in beside.items()}}


def image_beside(stream: str | Path, sha256: str | None) -> Path | None:
    """Path of the image beside a stream, if it has this hash."""
    path = Path(stream).with_name(FIRMWARE)
    if sha256 is None or not path.is_file():
        return None
    with open(path, "rb") as file:
        content = file.read(MOST_BYTES + 1)
    return path if hashlib.sha256(content).hexdigest() == sha256 else None


MOST_BYTES = 1 << 20
"""An image of 8 KB is a file of 23 KB."""


def case_lines(folder: str, own: bool, name: str = CASE) -> tuple[str, str]:
    """The commands that repeat the verdict of the case in `folder`, and that open the debugger at the failed check.

    `own`: with the robot's own firmware.
    """
    case, image = f"{folder}/{name}", None if own else f"{folder}/{FIRMWARE}"
    return replay_line(case, image), debug_line(case, image)


def report_line(folder: str) -> str:
    """The command that makes the failure's page, as a line of a report."""
    return "page: " + command_line("report", operand(folder))
