"""The lcov tracefile: which lines, functions and branches ran, in the form that genhtml and CI services read.

What belongs here: the format, reading and writing, and adding up runs. What does not: where the numbers come from
(`coverage.py`). Form: geninfo(1), section FILES.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import msgspec

Branch = tuple[int, int, int]
"""(line, block, branch): a block is one conditional jump of the line, branch 0 jumps, branch 1 goes on."""

_NUMBER = r"\d{1,18}"
_RECORDS = {
    "FN": re.compile(rf"({_NUMBER})(?:,{_NUMBER})?,(.+)"),
    "FNDA": re.compile(rf"({_NUMBER}),(.+)"),
    "BRDA": re.compile(rf"({_NUMBER}),({_NUMBER}),({_NUMBER}),({_NUMBER}|-)"),
    "DA": re.compile(rf"({_NUMBER}),({_NUMBER})(?:,.*)?"),
}
_DERIVED = ("TN", "FNF", "FNH", "BRF", "BRH", "LF", "LH")  # totals are counted again when it is written


class TracefileError(ValueError):
    """A text that is no tracefile: file, line, what, remedy."""

    def __init__(self, path: str, line: int, what: str) -> None:
        super().__init__(f"{path}:{line}: {what}; give a file that was written as lcov tracefile")


class FileRecord(msgspec.Struct):
    """One source file. Counts by line; functions as name -> (line, count); a branch that was never come to is None."""

    lines: dict[int, int] = msgspec.field(default_factory=dict)
    functions: dict[str, tuple[int, int]] = msgspec.field(default_factory=dict)
    branches: dict[Branch, int | None] = msgspec.field(default_factory=dict)

    def add(self, other: FileRecord) -> None:
        """Adds the counts of another run."""
        for line, count in other.lines.items():
            self.lines[line] = self.lines.get(line, 0) + count
        for name, (line, count) in other.functions.items():
            self.functions[name] = (line, self.functions.get(name, (line, 0))[1] + count)
        for branch, times in other.branches.items():
            before = self.branches.get(branch)
            self.branches[branch] = before if times is None else times + (before or 0)

    @property
    def lines_hit(self) -> int:
        return len([count for count in self.lines.values() if count])

    @property
    def branches_hit(self) -> int:
        return len([count for count in self.branches.values() if count])


Tracefile = dict[str, FileRecord]
"""By path of the source file."""


def add(total: Tracefile, other: Mapping[str, FileRecord]) -> None:
    """Adds another run to `total`."""
    for path, record in other.items():
        total.setdefault(path, FileRecord()).add(record)


def encode(tracefile: Mapping[str, FileRecord]) -> str:
    """The same counts give the same text."""
    lines = ["TN:"]
    for path in sorted(tracefile):
        lines += _encode_file(path, tracefile[path])
    return "\n".join(lines) + "\n"


def _encode_file(path: str, record: FileRecord) -> Iterable[str]:
    by_line = sorted(record.functions.items(), key=lambda item: (item[1][0], item[0]))
    yield f"SF:{path}"
    yield from (f"FN:{line},{name}" for name, (line, _) in by_line)
    yield from (f"FNDA:{count},{name}" for name, (_, count) in by_line)
    yield f"FNF:{len(by_line)}"
    yield f"FNH:{len([name for name, (_, count) in by_line if count])}"
    for (line, block, branch), times in sorted(record.branches.items()):
        yield f"BRDA:{line},{block},{branch},{'-' if times is None else times}"
    yield f"BRF:{len(record.branches)}"
    yield f"BRH:{record.branches_hit}"
    yield from (f"DA:{line},{count}" for line, count in sorted(record.lines.items()))
    yield f"LF:{len(record.lines)}"
    yield f"LH:{record.lines_hit}"
    yield "end_of_record"


def decode(text: str, path: str) -> Tracefile:
    """A tracefile, also another program's. Raises TracefileError naming `path` and the line."""
    found: Tracefile = {}
    parts: list[
        tuple[str, FileRecord]
    ] = []  # a file may come several times, as when tracefiles are put together
    record: FileRecord | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        kind, colon, value = line.strip().partition(":")
        if kind == "SF" and value:
            record = FileRecord()
            add(found, {value: FileRecord()})
            parts.append((value, record))
        elif kind == "end_of_record":
            record = None
        elif kind in _RECORDS:
            match = _RECORDS[kind].fullmatch(value)
            if match is None or record is None:
                what = "belongs to no source file" if match else f"cannot be read as {kind} record"
                raise TracefileError(path, number, what)
            _take(record, kind, match.groups())
        elif kind and (not colon or not (kind in _DERIVED or kind.isupper())):
            raise TracefileError(path, number, "is no record of a tracefile")
    for name, part in parts:
        add(found, {name: part})
    return found


def _take(record: FileRecord, kind: str, values: tuple[str, ...]) -> None:
    if kind == "FN":
        record.functions[values[1]] = (int(values[0]), record.functions.get(values[1], (0, 0))[1])
    elif kind == "FNDA":
        record.functions[values[1]] = (record.functions.get(values[1], (0, 0))[0], int(values[0]))
    elif kind == "DA":
        record.lines[int(values[0])] = int(values[1])
    else:
        branch = (int(values[0]), int(values[1]), int(values[2]))
        record.branches[branch] = None if values[3] == "-" else int(values[3])
