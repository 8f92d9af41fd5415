"""The lcov tracefile: which lines, functions and branches ran, in the form that genhtml and CI services read.

Form: geninfo(1), section FILES, in lcov 2 TRACEFILE FORMAT. Functions are read in the form of lcov 2.2 as well (FNL,
FNA) and written in the older one (FN, FNDA), which all versions read; their last lines are dropped.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import msgspec

from miro_exact.bad_input import BadInput

Branch = tuple[int, int, int]
"""(line, block, branch): a block is one conditional jump of the line; branch 0 is taken, branch 1 is not."""

_NUMBER = r"[0-9]{1,18}"
_RECORDS = {
    "FN": re.compile(rf"({_NUMBER})(?:,{_NUMBER})?,(.+)"),
    "FNDA": re.compile(rf"({_NUMBER}),(.+)"),
    "FNL": re.compile(rf"({_NUMBER}),({_NUMBER})(?:,{_NUMBER})?"),
    "FNA": re.compile(rf"({_NUMBER}),({_NUMBER}),(.+)"),
    "BRDA": re.compile(rf"({_NUMBER}),({_NUMBER}),({_NUMBER}),({_NUMBER}|-)"),
    "DA": re.compile(rf"({_NUMBER}),({_NUMBER})(?:,.*)?"),
}
_LIKE_A_LINE = re.compile(rf"{_NUMBER},")
# lcov 2: marked, or named by a text
_OTHER_BRANCH = re.compile(rf"{_NUMBER},[efU]*{_NUMBER},.+,(?:{_NUMBER}|-)")
_TOTALS = ("FNF", "FNH", "BRF", "BRH", "LF", "LH", "MCF", "MCH")  # counted again when it is written
_DROPPED = (*_TOTALS, "TN", "VER")
_LINE_ENDS = "\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029"  # where str.splitlines cuts
_NAME_ANOTHER = "give a file that was written as lcov tracefile"
_USE_LCOV = "add the files up with `lcov --add-tracefile`"


class FileRecord(msgspec.Struct):
    """One source file. Counts by line; functions as name -> (line, count); a branch that was never reached is None."""

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
    """The text of a tracefile. Equal counts give equal text."""
    lines = ["TN:"]
    for path in sorted(tracefile):
        lines += _encode_file(path, tracefile[path])
    return "\n".join(lines) + "\n"


def _encode_file(path: str, record: FileRecord) -> Iterable[str]:
    by_line = sorted(record.functions.items(), key=lambda item: (item[1][0], item[0]))
    yield f"SF:{_in_one_line(path)}"
    yield from (f"FN:{_begin(line, name)},{_in_one_line(name)}" for name, (line, _) in by_line)
    yield from (f"FNDA:{count},{_in_one_line(name)}" for name, (_, count) in by_line)
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


def _begin(line: int, name: str) -> str:
    """A function's first line; the last one too if the name begins like a line, which would be taken for that."""
    return f"{line},{line}" if _LIKE_A_LINE.match(name) else f"{line}"


def _in_one_line(name: str) -> str:
    """A name with its line ends escaped, `\\n`: the format has no way to write them, and they would make records."""
    return "".join(repr(char)[1:-1] if char in _LINE_ENDS else char for char in name)


def decode(text: str, path: str) -> Tracefile:
    """A tracefile, also another program's. Raises BadInput with `path` and the line."""
    reader = _LineReader(path)
    for line in text.splitlines():
        reader.take(line.strip())
    tracefile: Tracefile = {}
    for name, part in reader.parts:
        add(tracefile, {name: part})
    return tracefile


class _LineReader:
    """Takes line by line. `parts`: (source file, counts), several of one file when tracefiles are put together."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.number = 0  # of lines taken
        self.parts: list[tuple[str, FileRecord]] = []
        self._record: FileRecord | None = None
        self._leaders: dict[int, int] = {}  # first line by index: FNL, for the FNA that follow

    def _wrong(self, problem: str, remedy: str = _NAME_ANOTHER) -> BadInput:
        return BadInput(self.path, self.number, problem, remedy)

    def take(self, line: str) -> None:
        self.number += 1
        kind, colon, value = line.partition(":")
        if kind == "SF" and value:
            self._record, self._leaders = FileRecord(), {}
            self.parts.append((value, self._record))
        elif kind == "end_of_record":
            self._record = None
        elif kind in _RECORDS:
            self._count(kind, value)
        elif (kind in _DROPPED and colon) or not line or line.startswith("#"):
            pass
        elif colon and kind.isupper() and kind.isalpha() and len(kind) <= 8 and kind != "SF":
            raise self._wrong(f"{kind} records are not kept", _USE_LCOV)
        else:
            raise self._wrong("is no record of a tracefile")

    def _count(self, kind: str, value: str) -> None:
        match = _RECORDS[kind].fullmatch(value)
        if match is None and kind == "BRDA" and _OTHER_BRANCH.fullmatch(value):
            raise self._wrong("branches that are marked or named are not kept", _USE_LCOV)
        if match is None:
            raise self._wrong(f"cannot be read as {kind} record")
        if self._record is None:
            raise self._wrong("belongs to no source file")
        self._take(self._record, kind, match.groups())

    def _take(self, record: FileRecord, kind: str, values: tuple[str, ...]) -> None:
        if kind == "FN":
            record.functions[values[1]] = (int(values[0]), record.functions.get(values[1], (0, 0))[1])
        elif kind == "FNDA":
            record.functions[values[1]] = (record.functions.get(values[1], (0, 0))[0], int(values[0]))
        elif kind == "FNL":
            self._leaders[int(values[0])] = int(values[1])
        elif kind == "FNA":
            if int(values[0]) not in self._leaders:
                raise self._wrong(f"names function {values[0]}, which no FNL record before it has")
            record.functions[values[2]] = (self._leaders[int(values[0])], int(values[1]))
        elif kind == "DA":
            record.lines[int(values[0])] = int(values[1])
        else:
            branch = (int(values[0]), int(values[1]), int(values[2]))
            record.branches[branch] = None if values[3] == "-" else int(values[3])
