"""What commands that run a scenario say of its checks: `--expect`, one line a failure, and the exit code.

What belongs here: words and exit codes. What does not: the checks (`mirotwin.checks`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import click

from miro_sim.scenario.settings import EXPECT
from mirotwin.checks.watching import Checks
from mirotwin.cli.program import DONE, EXPECTATION_FAILED, complain

Command = TypeVar("Command", bound=Callable[..., Any])
LINES = 5
"""Failures of one check that are listed."""


def _as_settings(ctx: click.Context, param: click.Parameter, given: Sequence[str]) -> tuple[str, ...]:
    return tuple(EXPECT + text for text in given)


def expect_option(command: Command) -> Command:
    """Gives the command the expectations as settings."""
    return click.option(
        "--expect",
        "expected",
        metavar="KEY=VALUE",
        multiple=True,
        callback=_as_settings,
        help="A check of the run: a key of the scenario's [expect], such as tracks_within_cm=3; may be repeated. Exit"
        " code 1 when one fails.",
    )(command)


def report_failures(checks: Checks) -> int:
    """Says on stderr which checks failed and which had nothing to judge; returns the exit code.

    Firmware faults have lines and an exit code of their own.
    """
    code = DONE
    for verdict in checks.verdicts():
        if verdict.verdict == "not judged":
            complain(f"expectation not judged: {verdict.name}: the run had no occasion for it")
        failures = [one for one in checks.failures if one.check == verdict.name and not one.fault]
        for failure in failures[:LINES]:
            complain(f"expectation failed: {failure}")
        if failures:
            code = EXPECTATION_FAILED
            more = verdict.failures - min(len(failures), LINES)
            if more:
                complain(f"expectation failed: {verdict.name}: {more} more times")
    return code
