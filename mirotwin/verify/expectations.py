"""What commands that run a scenario say of its checks and steps: `--expect`, one line a failure, and the exit code."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

from miro_exact.bad_input import BadInput, amount
from miro_sim.scenario.settings import EXPECT as EXPECT_KEY
from mirotwin.recording.runner import report_faults
from mirotwin.shell.command import Option
from mirotwin.shell.program import complain
from mirotwin.shell.verdicts import VERDICTS, Verdict, judge
from mirotwin.verify.checks.expect import ALWAYS_ON, CHECKS
from mirotwin.verify.checks.interface import Expectation
from mirotwin.verify.checks.monitors import Checks

if TYPE_CHECKING:
    from miro_sim.world.world import World
    from mirotwin.verify.steps.player import Player

_IN_FILE = re.compile(r"(.+?\.py):(\w+)((?:=.*)?)", re.DOTALL)
LINES = 5
"""Failures of one check that are listed."""


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


def expectation_lines(checks: Checks) -> Iterator[tuple[Verdict, str]]:
    """Which checks failed, had no occasion, or cannot be observed, a line each with that verdict.

    Firmware faults have lines and an exit code of their own.
    """
    for verdict in checks.verdicts():
        if verdict.reason and verdict.name in checks.named:
            yield verdict.verdict, f"expectation {verdict.verdict}: {verdict.name}: {verdict.reason}"
        failures = [one for one in checks.failures if one.check == verdict.name and not one.fault]
        for failure in failures[:LINES]:
            yield "failed", f"expectation failed: {failure}"
        if failures and verdict.failures > LINES:
            yield "failed", f"expectation failed: {verdict.name}: {verdict.failures - LINES} more times"


def report_failures(checks: Checks) -> int:
    """Says on stderr which checks failed and which were not judged; returns the exit code."""
    for _, line in expectation_lines(checks):
        complain(line)
    return VERDICTS[checks.verdict()].code


def expectations_text(expectations: Sequence[Expectation]) -> str:
    """How many checks passed, and the names of those that did not, for people. One that is always on and had no
    occasion is not counted.
    """
    counted = [one for one in expectations if one.verdict != "not judged" or one.name not in ALWAYS_ON]
    others = [f"{one.name} {one.verdict}" for one in counted if one.verdict != "passed"]
    return ", ".join([f"{len(counted) - len(others)} of {amount(len(counted), 'check')} passed", *others])


def report_run(world: World, checks: Checks, player: Player | None = None) -> int:
    """The same of a run that is over, and its steps, the checks that these began, and firmware faults."""
    if player is not None and player.failure is not None:
        complain(f"step failed: {player.failure}")
    for group in (checks, *(player.checks if player else ())):
        report_failures(group)
    return report_faults(world) or VERDICTS[verdict_of_run(checks, player)].code


@contextmanager
def verdict_first(world: World, checks: Checks, player: Player | None = None) -> Iterator[None]:
    """Within it files are written: a run that was judged is reported, although they could not be (a full disk)."""
    try:
        yield
    except BadInput:
        if checks.finished:
            report_run(world, checks, player)
        raise


def verdict_of_run(checks: Checks, player: Player | None) -> Verdict:
    """Of the checks of the whole run, of the steps, and of the checks that steps began."""
    if player is None:
        return checks.verdict()
    step = "passed" if player.failure is None else "failed"
    return judge([checks.verdict(), step, *(group.verdict() for group in player.checks)])
