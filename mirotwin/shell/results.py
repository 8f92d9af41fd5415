"""The results of a command, for programs: one record, as JUnit XML and as JSON (docs/formats/results.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from mirotwin.shell.json_text import print_json
from mirotwin.shell.junit import TestCase, junit_xml
from mirotwin.shell.outputs import whole_file
from mirotwin.shell.verdicts import VERDICTS, Verdict

FORMAT, VERSION = "mirotwin results", 1
"""VERSION rises when a field goes or changes its meaning; new fields may come at any time."""


class Results(msgspec.Struct, frozen=True, kw_only=True):
    """`verdict`: of all together, and perhaps of no case. `facts`: of the whole; `summary`: more, in JSON only."""

    command: str
    cases: Sequence[TestCase]
    verdict: Verdict
    facts: Mapping[str, str | int | float] = {}
    summary: Any = None

    def write_junit(self, path: Path | None) -> None:
        """If there is a path. Raises OutputError."""
        if path is not None:
            with whole_file(path, "--junit") as part:
                part.write_bytes(junit_xml(f"mirotwin {self.command}", self.cases, self.facts))

    def print_json(self) -> None:
        document = {
            "format": FORMAT,
            "version": VERSION,
            "command": self.command,
            "verdict": self.verdict,
            "exit_code": VERDICTS[self.verdict].code,
            **self.facts,
            "cases": [_case(case) for case in self.cases],
        }
        print_json(document | ({} if self.summary is None else {"summary": self.summary}))


def _case(case: TestCase) -> dict[str, Any]:
    head = {"name": case.name, "group": case.classname, "verdict": case.verdict, "counts": case.counts}
    time = {} if case.time_s is None else {"time_s": round(case.time_s, 3)}
    return {**head, "lines": [*case.lines], **time, **case.facts}
