"""Lines for a shell that a user copies: words quoted, names of files never read as options."""

from __future__ import annotations

import shlex
from os import PathLike


def operand(path: str | PathLike[str]) -> str:
    """The path as a word of a command: one that begins with a hyphen would be an option."""
    word = f"{path}"
    return f"./{word}" if word.startswith("-") else word


def command_line(*words: str) -> str:
    """`mirotwin` with these words, quoted for a shell."""
    return shlex.join(["mirotwin", *words])


def replay_line(
    stream: str | PathLike[str], firmware: str | PathLike[str] | None = None, check: str = ""
) -> str:
    """The command that plays a stream or a case again, on that image (None: the robot's own).

    `check`: FILE.py:FUNCTION, which a case cannot name.
    """
    image = [] if firmware is None else ["--firmware", operand(firmware)]
    return command_line("replay", operand(stream), *image, *(["--expect", check] if check else []))
