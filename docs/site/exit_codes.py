"""Writes the tables of docs/exit-codes.md from the table of verdicts: `python -m docs.site.exit_codes`."""

from __future__ import annotations

import sys

from mirotwin.shell.verdicts import OTHERS, VERDICTS


def render() -> str:
    """Verdicts in the order of precedence, then the codes without a verdict."""
    lines = ["| verdict | code | in JUnit | when |", "|---|---|---|---|"]
    lines += [f"| {verdict} | {one.code} | {one.junit} | {one.when} |" for verdict, one in VERDICTS.items()]
    lines += ["", "| other codes | when |", "|---|---|"]
    lines += [f"| {code} | {when} |" for code, when in OTHERS.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(render())
