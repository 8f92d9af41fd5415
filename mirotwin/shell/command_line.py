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
