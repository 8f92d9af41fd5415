"""The verdicts of commands that judge: their order, their exit codes, and what people and JUnit are told.

docs/exit-codes.md says when each of them is given.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import msgspec

from mirotwin.shell.program import (
    BAD_INPUT,
    DIVERGENCE,
    DONE,
    EXPECTATION_FAILED,
    FIRMWARE_FAULT,
    NOTHING_JUDGED,
)

Verdict = Literal["error", "differs", "fault", "failed", "not judged", "passed", "not observable"]


class VerdictFormat(msgspec.Struct, frozen=True):
    """`code`: the exit code; `line`: the word before a file's name; `counted`: where files are counted."""

    code: int
    line: str
    counted: str
    junit: Literal["passed", "failure", "error", "skipped"]


VERDICTS: dict[Verdict, VerdictFormat] = {
    "error": VerdictFormat(BAD_INPUT, "ERROR", "cannot be run", "error"),
    "differs": VerdictFormat(DIVERGENCE, "DIFFERS", "not as recorded", "failure"),
    "fault": VerdictFormat(FIRMWARE_FAULT, "FAULT", "with a firmware fault", "failure"),
    "failed": VerdictFormat(EXPECTATION_FAILED, "FAILED", "failed", "failure"),
    "not judged": VerdictFormat(EXPECTATION_FAILED, "NOT JUDGED", "not judged", "failure"),
    "passed": VerdictFormat(DONE, "passed", "passed", "passed"),
    "not observable": VerdictFormat(NOTHING_JUDGED, "not observable", "not observable", "skipped"),
}
"""In the order of precedence: what cannot be observed changes nothing where anything was judged."""


def worst(verdicts: Iterable[str]) -> Verdict:
    """The verdict of all together; that of nothing is that it passed."""
    found = set(verdicts)
    return next((verdict for verdict in VERDICTS if verdict in found), "passed")
