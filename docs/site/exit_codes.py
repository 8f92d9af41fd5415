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
    "error": "a file, a key or an option is unusable, or the disk is full: one line names place and remedy",
    "differs": "a replay or a recording differs; a case is not reproduced",
    "fault": "the firmware did [what it must not](../robot_fw/README.md#faults-what-firmware-must-not-do)",
    "failed": "a check, step, rule or test failed; the fuzzer found something; a campaign got worse",
    "not judged": "a named check had no occasion to judge",
    "limit": "time or cycles ran out first",
    "passed": "all was done, and nothing failed",
    "not observable": "nothing requested can be seen, as at a port; pytest found no test",
}
OTHERS = {
    INTERNAL_ERROR: "a bug in Mirotwin: report the line; `MIROTWIN_TRACEBACK=1` adds the traceback",
    SIGNALLED + SIGHUP: "SIGHUP",
    INTERRUPTED: "Ctrl-C",
    SIGNALLED + SIGPIPE: "the reader closed the output, as `head` does",
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
