"""What commands that run a scenario say of its checks and steps: `--expect`, one line a failure, and the exit code."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

import click

from miro_exact.bad_input import amount
from miro_sim.scenario.settings import EXPECT as EXPECT_KEY
from mirotwin.shell.command import Option
from mirotwin.shell.program import DONE, EXPECTATION_FAILED, complain
from mirotwin.verify.checks.expect import ALWAYS_ON
from mirotwin.verify.checks.interface import Expectation
from mirotwin.verify.checks.monitors import Checks

if TYPE_CHECKING:
    from mirotwin.verify.steps.player import Player

LINES = 5
"""Failures of one check that are listed."""


EXPECT = Option(
    "--expect",
    metavar="KEY[=VALUE]",
    help="A check of the run: a key of the scenario's [expect], such as tracks_within_cm=3; may be repeated. Exit"
    " code 1 when one fails.",
)
Expected = Annotated[tuple[str, ...], EXPECT]
CHECK = Option(
    "--check",
    metavar="NAME",
    help="For a bare processor: a check in Python by its name, or FILE.py:FUNCTION.",
)


def as_settings(expected: Sequence[str]) -> tuple[str, ...]:
    """What --expect was given, as settings of the scenario; a KEY alone is a check with its defaults.

    Raises UsageError for a check in a file, FILE.py:FUNCTION: only firmware on a bare processor is judged by one.
    """
    for text in expected:
        path, _, function = text.rpartition(":")
        if path.endswith(".py") and function.isidentifier():
            what = "a check in a file is for firmware on a bare processor, and given by --check"
            remedy = (
                "a check of a run is in an installed distribution, and named by its key:"
                " `mirotwin examples checks` writes one of your own; pip install it"
            )
            raise click.UsageError(f"--expect {text}: {what}; {remedy}.")
    return tuple(f"{EXPECT_KEY}{text}" if "=" in text else f"{EXPECT_KEY}{text}=true" for text in expected)


def failure_lines(checks: Checks) -> Iterator[tuple[bool, str]]:
    """Which checks failed and which had nothing to judge, a line each, and whether it failed.

    Firmware faults have lines and an exit code of their own.
    """
    for verdict in checks.verdicts():
        if verdict.verdict == "not judged" and verdict.name not in ALWAYS_ON:
            yield False, f"expectation not judged: {verdict.name}: the run had no occasion for it"
        failures = [one for one in checks.failures if one.check == verdict.name and not one.fault]
        for failure in failures[:LINES]:
            yield True, f"expectation failed: {failure}"
        if failures and verdict.failures > LINES:
            yield True, f"expectation failed: {verdict.name}: {verdict.failures - LINES} more times"


def report_failures(checks: Checks) -> int:
    """Says on stderr which checks failed and which had nothing to judge; returns the exit code."""
    code = DONE
    for failed, line in failure_lines(checks):
        complain(line)
        code = EXPECTATION_FAILED if failed else code
    return code


def expectations_text(expectations: Sequence[Expectation]) -> str:
    """How many checks passed, and the names of those that did not, for people. One that is always on and had no
    occasion is not counted.
    """
    counted = [one for one in expectations if one.verdict != "not judged" or one.name not in ALWAYS_ON]
    others = [f"{one.name} {one.verdict}" for one in counted if one.verdict != "passed"]
    return ", ".join([f"{len(counted) - len(others)} of {amount(len(counted), 'check')} passed", *others])


def report_steps(player: Player, checks: Checks) -> int:
    """The same where steps were done: the step that failed, and the checks that steps began, too."""
    if player.failure is not None:
        complain(f"step failed: {player.failure}")
    codes = [report_failures(one) for one in (checks, *player.checks)]
    return EXPECTATION_FAILED if player.failure is not None else max(codes)
