"""Which instructions, branches and C lines ran: from counts by address to counts by line.

A line ran as often as the instruction of it that ran most often. Of a conditional jump both ways are counted. An
image without debug files is covered by the lines of its own listing.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import msgspec

from miro_robot.image import Image
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.inspect.counters import Counters
from miro_robot.inspect.lcov import FileRecord, Tracefile
from miro_robot.inspect.listing import ListingRow, rows, text_lines
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.mcs51.opcodes import is_conditional

Counts = dict[int, tuple[int, int]]
"""Address -> executions of the instruction, and how often it continued elsewhere than behind itself."""


class Share(msgspec.Struct, frozen=True):
    """A number of items out of a total."""

    hit: int
    total: int

    def __str__(self) -> str:
        percent = 100.0 * self.hit / self.total if self.total else 100.0
        return f"{self.hit} of {self.total} ({percent:.1f} %)"


def counts_of(counters: Counters) -> Counts:
    return {at: (counters.executed_at(at), counters.jumped_at(at)) for at in counters.addresses()}


def merged(many: Iterable[Counts]) -> Counts:
    """The sum of several runs of one image."""
    total: Counts = {}
    for counts in many:
        for address, (executed, jumped) in counts.items():
            before = total.get(address, (0, 0))
            total[address] = (before[0] + executed, before[1] + jumped)
    return total


def instructions(image: Image, debug: DebugInfo, counts: Counts) -> list[ListingRow]:
    """The rows of the image's listing that are instructions."""
    return [row for row in rows(image, debug, SymbolNames(image), counts) if row.cycles]


def instruction_share(image: Image, debug: DebugInfo, counts: Counts) -> Share:
    """Instructions that ran, of all that the listing shows."""
    listed = instructions(image, debug, counts)
    return Share(len([row for row in listed if row.address in counts]), len(listed))


def by_line(image: Image, debug: DebugInfo, counts: Counts) -> Tracefile:
    """Coverage of the C lines, by the file names that the compiler was given."""
    tracefile: Tracefile = {}
    for row in instructions(image, debug, counts):
        line = debug.line_at(row.address)
        if line is not None:
            _count(tracefile.setdefault(line.file, FileRecord()), line.line, row, counts)
    for function in debug.functions:
        line = function.line or debug.line_at(function.first)
        if line is not None:
            executed = counts.get(function.first, (0, 0))[0]
            tracefile.setdefault(line.file, FileRecord()).functions[function.name] = (line.line, executed)
    return tracefile


def by_listing(image: Image, counts: Counts) -> tuple[str, FileRecord]:
    """The listing as text, and coverage of its lines, for an image without debug files."""
    debug, names = DebugInfo(), SymbolNames(image)
    listing = list(text_lines(image, debug, names, Sources(()), counts))
    number_of = {int(text[:4], 16): number for number, text in enumerate(listing, 1) if text[4:6] == "  "}
    record = FileRecord()
    for row in instructions(image, debug, counts):
        _count(record, number_of[row.address], row, counts)
    for first, name in names.functions:
        if first in number_of:
            record.functions[name] = (number_of[first], counts.get(first, (0, 0))[0])
    return "\n".join(listing) + "\n", record


def _count(record: FileRecord, line: int, row: ListingRow, counts: Counts) -> None:
    """Adds one instruction to a line's record."""
    executed, jumped = counts.get(row.address, (0, 0))
    record.lines[line] = max(record.lines.get(line, 0), executed)
    if is_conditional(row.data[0]) and row.data[-1]:  # SDCC compares by a CJNE that jumps nowhere
        block = len([branch for branch in record.branches if branch[0] == line]) // 2
        record.branches[line, block, 0] = jumped if executed else None
        record.branches[line, block, 1] = executed - jumped if executed else None


def at_paths(tracefile: Tracefile, sources: Sources, here: Path) -> Tracefile:
    """A copy with the paths where the files are: relative to `here` if they are below it."""
    return {_shown(file, sources, here): record for file, record in tracefile.items()}


def _shown(file: str, sources: Sources, here: Path) -> str:
    path = sources.path(file)
    if path is None:
        return file
    path = path.resolve()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


def line_share(tracefile: Tracefile) -> Share:
    records = tracefile.values()
    return Share(sum(record.lines_hit for record in records), sum(len(record.lines) for record in records))


def branch_share(tracefile: Tracefile) -> Share:
    records = tracefile.values()
    return Share(
        sum(record.branches_hit for record in records), sum(len(record.branches) for record in records)
    )


def missed(record: FileRecord) -> str:
    """The lines that never ran, as ranges: `12-14, 20`. Lines without code do not part a range."""
    ranges: list[list[int]] = []
    after_a_hit = True
    for line, count in sorted(record.lines.items()):
        if not count and after_a_hit:
            ranges.append([line, line])
        elif not count:
            ranges[-1][1] = line
        after_a_hit = bool(count)
    return ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in ranges)
