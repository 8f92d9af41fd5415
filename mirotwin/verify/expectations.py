"""`--expect`, the option by which commands are given checks: by their names, or in files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any

from miro_exact.bad_input import BadInput
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.settings import EXPECT as EXPECT_KEY
from miro_sim.scenario.settings import blamed, make
from mirotwin.shell.command import Option
from mirotwin.verify.checks.expect import CHECKS, checks_of_table, expectations_of
from mirotwin.verify.checks.interface import Check

_IN_FILE = re.compile(r"(.+?\.py):(\w+)((?:=.*)?)", re.DOTALL)
EXPECT = Option(
    "--expect",
    metavar="KEY[=VALUE]",
    help="A check of the run: a key of the scenario's [expect], such as tracks_within_cm=3, or FILE.py:CLASS[=VALUE],"
    " one of your own; may be repeated. Exit code 1 when one fails.",
)
Expected = Annotated[tuple[str, ...], EXPECT]


def as_settings(expected: Sequence[str], files: bool = True) -> tuple[str, ...]:
    """The values of --expect as settings of the scenario; a KEY alone is a check with its defaults.

    `FILE.py:CLASS` runs the file, and registers its check by its name until --expect is read again. Raises BadInput for
    a value that is no check, and for a file if not `files`.
    """
    named = [_IN_FILE.fullmatch(text) or text for text in expected]
    if not files and any(not isinstance(item, str) for item in named):
        remedy = "`mirotwin examples checks` writes a check of your own to pip install"
        raise BadInput("", EXPECT.names[0], "runs of other processes name checks that are installed", remedy)
    CHECKS.in_files.clear()
    keys = [item if isinstance(item, str) else f"{_brought(item[1], item[2])}{item[3]}" for item in named]
    return tuple(f"{EXPECT_KEY}{key}" if "=" in key else f"{EXPECT_KEY}{key}=true" for key in keys)


def table_alone(expected: Sequence[str], origin: str) -> dict[str, Any]:
    """The values of --expect for a board alone, as its table `[expect]`. Raises BadInput."""
    raw: dict[str, Any] = {}
    settings = make(raw, as_settings(expected), origin)
    table: dict[str, Any] = raw.get("expect", {})
    try:
        expectations_of(BoardScenario(expect=table), origin)
    except ScenarioError as error:
        raise blamed(error, settings, raw) from None
    return table


def checks_alone(expected: Sequence[str]) -> list[Check]:
    """The checks that --expect names and that can judge a board alone. Raises BadInput."""
    if not expected:  # which would forget the checks of files
        return []
    checks = checks_of_table(BoardScenario(), "", "expect", table_alone(expected, "fuzz")).values()
    return [check for check in checks if check is not None and "board" in check.SUBJECTS]


def in_files(expected: Sequence[str]) -> dict[str, str]:
    """Name of each check that --expect brought from a file -> the option's value."""
    given = {match[2]: text for text in expected if (match := _IN_FILE.fullmatch(text))}
    return {
        name: given[struct.__name__] for name, struct in CHECKS.in_files.items() if struct.__name__ in given
    }


def _brought(path: str, name: str) -> str:
    """Registers a check in a file and returns its name."""
    struct = CHECKS.of_file(path, name, EXPECT.names[0])
    tag = str(struct.__struct_config__.tag)  # type: ignore[attr-defined]
    CHECKS.in_files[tag] = struct
    return tag
