"""The options by which commands are given checks: `--expect` of a run, and `--check` of a bare processor."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

from miro_exact.bad_input import BadInput
from miro_sim.scenario.settings import EXPECT as EXPECT_KEY
from mirotwin.shell.command import Option
from mirotwin.verify.checks.expect import CHECKS

_IN_FILE = re.compile(r"(.+?\.py):(\w+)((?:=.*)?)", re.DOTALL)
EXPECT = Option(
    "--expect",
    metavar="KEY[=VALUE]",
    help="A check of the run: a key of the scenario's [expect], such as tracks_within_cm=3, or FILE.py:CLASS[=VALUE],"
    " one of your own; may be repeated. Exit code 1 when one fails.",
)
Expected = Annotated[tuple[str, ...], EXPECT]
CHECK = Option(
    "--check",
    metavar="NAME",
    help="For a bare processor: a check in Python by its name, or FILE.py:FUNCTION.",
)


def as_settings(expected: Sequence[str], files: bool = True) -> tuple[str, ...]:
    """What --expect was given, as settings of the scenario; a KEY alone is a check with its defaults.

    `FILE.py:CLASS` runs the file, and makes its check known by its own name until --expect is read again. Raises
    BadInput for what is no check, and where `files` are of no use.
    """
    named = [_IN_FILE.fullmatch(text) or text for text in expected]
    if not files and any(not isinstance(one, str) for one in named):
        remedy = "`mirotwin examples checks` writes a check of your own to pip install"
        raise BadInput("", EXPECT.names[0], "runs of other processes name checks that are installed", remedy)
    CHECKS.in_files.clear()
    keys = [one if isinstance(one, str) else f"{_brought(one[1], one[2])}{one[3]}" for one in named]
    return tuple(f"{EXPECT_KEY}{key}" if "=" in key else f"{EXPECT_KEY}{key}=true" for key in keys)


def _brought(path: str, name: str) -> str:
    """The name of a check in a file, which is known now."""
    struct = CHECKS.of_file(path, name, EXPECT.names[0])
    tag = str(struct.__struct_config__.tag)  # type: ignore[attr-defined]
    CHECKS.in_files[tag] = struct
    return tag
