"""What a failure leaves in a folder of its own, in one form for pytest, `mirotwin test` and `mirotwin conform`.

report.txt        what failed, and the commands that give it again
case.stream       what was sent and done, with the check that failed: `mirotwin replay` gives its verdict again
sent.stream       the same without a verdict, where no check can judge the failure
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
    """Takes away what an earlier run left there, `others` too, and nothing else."""
    for name in (*FILES, *image_files(folder), *others):
        (folder / name).unlink(missing_ok=True)
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def leave(folder: Path, report: str, files: Mapping[str, bytes]) -> None:
    """Writes the report and these files, by name, into the folder, or nothing. Raises OSError, OutputError."""
    write_files(folder, {REPORT: encodable(report).encode(), **files}, _REMEDY)


def stream_files(case: str | None, sent: str, image: Image) -> dict[str, bytes]:
    """The case, or where there is none what was sent, with the image."""
    name, stream = (SENT, sent) if case is None else (CASE, case)
    return {name: encodable(stream).encode(), **_image_content(image)}


def nothing_left(folder: Path, error: OSError | BadInput) -> str:
    """The line that says why nothing is in the folder: the verdict stands all the same."""
    if isinstance(error, OSError):
        reason = reason_of(error)
    else:
        reason = f"{error.what}; {error.remedy}" if Path(error.path) == folder else f"{error}"
    return f"nothing could be left in {folder}: {reason}"


def image_files(folder: Path) -> list[str]:
    """Names of the image that was left in a folder and of its debug files."""
    return [FIRMWARE, *debug_files(folder / FIRMWARE, Path(FIRMWARE).stem)]


def leave_image(folder: Path, image: Image) -> None:
    """The image's own file, as long as that is what ran. Raises OSError, OutputError."""
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
    """The image that was left beside a stream, if it is the one with this hash."""
    path = Path(stream).with_name(FIRMWARE)
    if sha256 is None or not path.is_file():
        return None
    with open(path, "rb") as file:
        content = file.read(MOST_BYTES + 1)
    return path if hashlib.sha256(content).hexdigest() == sha256 else None


MOST_BYTES = 1 << 20
"""An image of 8 KB is a file of 23 KB."""


def case_lines(folder: str, own: bool, name: str = CASE) -> tuple[str, str]:
    """The commands that give the verdict of the case in `folder` again, and that stand at the check that failed.

    `own`: with the robot's own firmware.
    """
    case, image = f"{folder}/{name}", None if own else f"{folder}/{FIRMWARE}"
    return replay_line(case, image), debug_line(case, image)


def report_line(folder: str) -> str:
    """The command that makes the page of what happened, as a line of a report."""
    return "page: " + command_line("report", operand(folder))
