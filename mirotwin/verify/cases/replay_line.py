"""The command that plays a stream or a case again."""

from __future__ import annotations

from os import PathLike
from typing import Annotated

from mirotwin.shell.command import Argument, Options
from mirotwin.shell.options import FIRMWARE, NAME
from mirotwin.verify.expectations import EXPECT


class CaseOptions(Options, frozen=True, kw_only=True):
    """What `mirotwin replay` is told of a case; the command has more options."""

    COMMAND = "replay"
    file: Annotated[str, Argument("FILE", NAME)]
    firmware: Annotated[
        str | None,
        FIRMWARE.saying("Image to run instead of the recorded one (of the robot's own, for a text stream)."),
    ] = None
    expected: Annotated[
        tuple[str, ...],
        EXPECT.saying(
            f"{EXPECT.help} For a case of a bare processor: FILE.py:FUNCTION, if its check is in a file."
        ),
    ] = ()


def replay_line(
    stream: str | PathLike[str], firmware: str | PathLike[str] | None = None, check: str = ""
) -> str:
    """The command that plays a stream or a case again, on that image (None: the robot's own).

    `check`: FILE.py:FUNCTION, which a case cannot name.
    """
    image = None if firmware is None else f"{firmware}"
    return CaseOptions(file=f"{stream}", firmware=image, expected=(check,) if check else ()).command_line()
