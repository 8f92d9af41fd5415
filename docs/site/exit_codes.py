"""Writes the tables of docs/exit-codes.md from the table of verdicts: `python -m docs.site.exit_codes`."""

from __future__ import annotations

import sys

from mirotwin.shell.verdicts import (
    INTERNAL_ERROR,
    INTERRUPTED,
    SIGHUP,
    SIGNALLED,
    SIGPIPE,
    SIGTERM,
    VERDICTS,
    Verdict,
)

WHEN: dict[Verdict, str] = {
    "error": "a file, a key or an option cannot be used: one line names file, place, what is wrong and the remedy."
    " Also a disk that is full",
    "differs": "a replay, or one of two recordings, differs; a case is not reproduced",
    "fault": "the firmware did [what it must not](../robot_fw/README.md#faults-what-firmware-must-not-do)",
    "failed": "a check, a step, a rule or a test failed; the fuzzer found something; a campaign got worse",
    "not judged": "a check that is named had no occasion to judge",
    "limit": "the limit of virtual time or of cycles was reached before what was waited for",
    "passed": "what was asked for was done, and nothing expected failed",
    "not observable": "nothing of what was asked for can be seen: `test`, `conform` and `replay` at a port,"
    " a case of a check that needs symbols on an image without them; pytest ends so where it finds no test",
}
OTHERS = {
    INTERNAL_ERROR: "a mistake of this program: one line to report; `MIROTWIN_TRACEBACK=1` adds the traceback",
    SIGNALLED + SIGHUP: "SIGHUP",
    INTERRUPTED: "Ctrl-C",
    SIGNALLED + SIGPIPE: "the reader of the output has closed it, as `head` does",
    SIGNALLED + SIGTERM: "SIGTERM",
}
"""Exit codes without a verdict, and when they are given."""


def render() -> str:
    """Verdicts in the order of precedence, then the codes without a verdict."""
    lines = ["| verdict | code | in JUnit | when |", "|---|---|---|---|"]
    lines += [f"| {name} | {row.code} | {row.junit} | {WHEN[name]} |" for name, row in VERDICTS.items()]
    lines += ["", "| other codes | when |", "|---|---|"]
    lines += [f"| {code} | {when} |" for code, when in OTHERS.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(render())
