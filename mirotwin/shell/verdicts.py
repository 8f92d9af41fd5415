"""The one table of verdicts: their order, their exit codes, and what people, JUnit and pages are told.

The tables of docs/exit-codes.md are written from this one (`python -m docs.site.exit_codes`).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

Verdict = Literal["error", "differs", "fault", "failed", "not judged", "limit", "passed", "not observable"]


class VerdictFormat(NamedTuple):
    """`code`: the exit code; `line`: the word before a file's name; `counted`: where files are counted; `badge`: where
    a page counts runs; `when`: for the document.
    """

    code: int
    line: str
    counted: str
    badge: str
    junit: Literal["passed", "failure", "error", "skipped"]
    when: str


VERDICTS: dict[Verdict, VerdictFormat] = {
    "error": VerdictFormat(
        2,
        "ERROR",
        "cannot be run",
        "with an error",
        "error",
        "a file, a key or an option cannot be used: one line names file, place, what is wrong and the remedy. Also a"
        " disk that is full",
    ),
    "differs": VerdictFormat(
        4,
        "DIFFERS",
        "not as recorded",
        "with a difference",
        "failure",
        "a replay, or one of two recordings, differs; a case is not reproduced",
    ),
    "fault": VerdictFormat(
        3,
        "FAULT",
        "with a firmware fault",
        "with a firmware fault",
        "failure",
        "the firmware did [what it must not](../robot_fw/README.md#faults-what-firmware-must-not-do)",
    ),
    "failed": VerdictFormat(
        1,
        "FAILED",
        "failed",
        "failed",
        "failure",
        "a check, a step, a rule or a test failed; the fuzzer found something; a campaign got worse",
    ),
    "not judged": VerdictFormat(
        1,
        "NOT JUDGED",
        "not judged",
        "not judged",
        "failure",
        "a check that is named had no occasion to judge",
    ),
    "limit": VerdictFormat(
        42,
        "LIMIT",
        "ended at a limit",
        "ended at a limit",
        "failure",
        "the limit of virtual time or of cycles was reached before what was waited for",
    ),
    "passed": VerdictFormat(
        0,
        "passed",
        "passed",
        "passed",
        "passed",
        "what was asked for was done, and nothing expected failed",
    ),
    "not observable": VerdictFormat(
        5,
        "not observable",
        "not observable",
        "not observable",
        "skipped",
        "nothing of what was asked for can be seen: `test`, `conform` and `replay` at a port, a case of a check that"
        " needs symbols on an image without them; pytest ends so where it finds no test",
    ),
}
"""In the order of precedence: what cannot be observed changes nothing where anything was judged."""

DONE, BAD_INPUT = VERDICTS["passed"].code, VERDICTS["error"].code
INTERNAL_ERROR = 70
"""EX_SOFTWARE of sysexits.h."""
SIGNALLED = 128
"""Plus the number of the signal: what a shell reports for a program that a signal ended."""
SIGHUP, SIGINT, SIGPIPE, SIGTERM = 1, 2, 13, 15
INTERRUPTED = SIGNALLED + SIGINT
OTHERS: dict[int, str] = {
    INTERNAL_ERROR: "a mistake of this program: one line to report; `MIROTWIN_TRACEBACK=1` adds the traceback",
    SIGNALLED + SIGHUP: "SIGHUP",
    INTERRUPTED: "Ctrl-C",
    SIGNALLED + SIGPIPE: "the reader of the output has closed it, as `head` does",
    SIGNALLED + SIGTERM: "SIGTERM",
}
"""Exit codes without a verdict, and when they are given."""


def judge(verdicts: Iterable[str], unnamed: Iterable[str] = ()) -> Verdict:
    """The verdict of all together; that of nothing is that it passed.

    `unnamed`: of checks that nobody asked for. One that had no occasion counts as one that cannot be observed.
    """
    found = {*verdicts, *("not observable" if one == "not judged" else one for one in unnamed)}
    return next((verdict for verdict in VERDICTS if verdict in found), "passed")


def exit_code(*verdicts: str) -> int:
    """The exit code of all together."""
    return VERDICTS[judge(verdicts)].code
