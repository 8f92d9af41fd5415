"""The one table of verdicts: their order, their exit codes, and the words for people, JUnit and pages.

docs/exit-codes.md, written from it by `python -m docs.site.exit_codes`, describes when each is given.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

Verdict = Literal["error", "differs", "fault", "failed", "not judged", "limit", "passed", "not observable"]
Kind = Literal["passed", "failure", "error", "skipped"]
"""A verdict in the words of JUnit."""


class VerdictFormat(NamedTuple):
    """`code`: the exit code; `line`: the word before a file's name; `counted`: where files are counted; `badge`: where
    a page counts runs.
    """

    code: int
    line: str
    counted: str
    badge: str
    junit: Kind


VERDICTS: dict[Verdict, VerdictFormat] = {
    "error": VerdictFormat(2, "ERROR", "cannot be run", "with an error", "error"),
    "differs": VerdictFormat(4, "DIFFERS", "not as recorded", "with a difference", "failure"),
    "fault": VerdictFormat(3, "FAULT", "with a firmware fault", "with a firmware fault", "failure"),
    "failed": VerdictFormat(1, "FAILED", "failed", "failed", "failure"),
    "not judged": VerdictFormat(1, "NOT JUDGED", "not judged", "not judged", "failure"),
    "limit": VerdictFormat(42, "LIMIT", "ended at a limit", "ended at a limit", "failure"),
    "passed": VerdictFormat(0, "passed", "passed", "passed", "passed"),
    "not observable": VerdictFormat(5, "not observable", "not observable", "not observable", "skipped"),
}
"""Sorted by precedence. "not observable" comes last: it changes nothing if anything was judged."""

DONE, BAD_INPUT = VERDICTS["passed"].code, VERDICTS["error"].code
INTERNAL_ERROR = 70
"""EX_SOFTWARE of sysexits.h."""
SIGNALLED = 128
"""Plus the number of the signal: exit code that a shell reports for a program ended by a signal."""
SIGHUP, SIGINT, SIGPIPE, SIGTERM = 1, 2, 13, 15
INTERRUPTED = SIGNALLED + SIGINT


def judge(verdicts: Iterable[str], unnamed: Iterable[str] = ()) -> Verdict:
    """The verdict of all together; "passed" if there is none.

    `unnamed`: of checks that the user did not name; one that never applied counts as not observable.
    """
    reported = {*verdicts, *("not observable" if unseen == "not judged" else unseen for unseen in unnamed)}
    return next((verdict for verdict in VERDICTS if verdict in reported), "passed")


def exit_code(*verdicts: str) -> int:
    """The exit code of all together."""
    return VERDICTS[judge(verdicts)].code
