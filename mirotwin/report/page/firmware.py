"""What the firmware did, as rows of a page: cycles by function, interrupts, and the lines that ran.

Source files go by their names alone: a page says nothing of the folders of the machine that made it.
"""

from __future__ import annotations

from pathlib import PurePath

import msgspec

from miro_robot.image import Image
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.image.symbol_files import read_text
from miro_robot.inspect.coverage import (
    Counts,
    Share,
    branch_share,
    by_line,
    by_listing,
    instruction_share,
    line_share,
)
from miro_robot.inspect.lcov import FileRecord, Tracefile
from miro_robot.inspect.profile import Profile

SHOWN = 12
"""Functions that stand in the open; the rest is folded."""


class FunctionRow(msgspec.Struct, frozen=True):
    """`share`: of the cycles awake, `width`: of the longest bar; both in per cent."""

    name: str
    calls: int
    cycles: int
    share: float
    width: float


class SourceRow(msgspec.Struct, frozen=True):
    """A line of a source file. `count`: how often it ran, None where it is no code."""

    number: int
    count: int | None
    text: str


class SourceFile(msgspec.Struct, frozen=True):
    name: str
    lines: Share
    branches: Share
    rows: list[SourceRow]

    @property
    def percent(self) -> float:
        return 100.0 * self.lines.hit / self.lines.total if self.lines.total else 100.0


class CoverageRows(msgspec.Struct, frozen=True):
    """`listing`: the lines are those of a listing, because the image has no debug files."""

    files: list[SourceFile]
    lines: Share
    branches: Share
    instructions: Share
    listing: bool


def function_rows(profile: Profile) -> list[FunctionRow]:
    awake = profile.cycles - profile.asleep_cycles
    most = max((one.cycles for one in profile.functions), default=0)
    return [
        FunctionRow(one.name, one.calls, one.cycles, _percent(one.cycles, awake), _percent(one.cycles, most))
        for one in profile.functions
    ]


def coverage_rows(image: Image, counts: Counts, sources: Sources) -> CoverageRows:
    """Lines with their counts, file by file; of a listing where there are no C lines."""
    debug = DebugInfo.of(image)
    instructions = instruction_share(image, debug, counts)
    if not debug.lines:
        text, record = by_listing(image, counts)
        files = [_file("listing", text.splitlines(), record)]
        found: Tracefile = {"listing": record}
    else:
        found = by_line(image, debug, counts)
        files = []
        for name in sorted(found, key=_base):
            path = sources.path(name)
            files.append(
                _file(_base(name), [] if path is None else read_text(path).splitlines(), found[name])
            )
    return CoverageRows(files, line_share(found), branch_share(found), instructions, not debug.lines)


def _file(name: str, lines: list[str], record: FileRecord) -> SourceFile:
    """Without its text, only the lines that are code."""
    if lines:
        rows = [SourceRow(number, record.lines.get(number), text) for number, text in enumerate(lines, 1)]
    else:
        rows = [SourceRow(number, count, "") for number, count in sorted(record.lines.items())]
    one = {name: record}
    return SourceFile(name, line_share(one), branch_share(one), rows)


def _base(name: str) -> str:
    return PurePath(name).name


def _percent(part: int, whole: int) -> float:
    return 100.0 * part / whole if whole else 0.0
