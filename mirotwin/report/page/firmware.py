"""The lines of the firmware that ran, as rows of a page.

Source files are listed without their folders, so a page reveals no paths of the machine that made it.
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


class SourceFile(msgspec.Struct, frozen=True):
    """`rows`: number and text of each line, and between them how often it ran, None where it is no code."""

    name: str
    lines: Share
    branches: Share
    rows: list[tuple[int, int | None, str]]


class CoverageRows(msgspec.Struct, frozen=True):
    """`listing`: the lines are those of a listing, because the image has no debug files."""

    files: list[SourceFile]
    lines: Share
    branches: Share
    instructions: Share
    listing: bool


def coverage_rows(image: Image, counts: Counts, sources: Sources) -> CoverageRows:
    """Lines with their counts, file by file; of a listing where there are no C lines."""
    debug = DebugInfo.of(image)
    instructions = instruction_share(image, debug, counts)
    if not debug.lines:
        text, record = by_listing(image, counts)
        files = [_file("listing", text.splitlines(), record)]
        executed: Tracefile = {"listing": record}
    else:
        executed = by_line(image, debug, counts)
        files = []
        for name in sorted(executed, key=lambda name: PurePath(name).name):
            path = sources.path(name)
            lines = [] if path is None else read_text(path).splitlines()
            files.append(_file(PurePath(name).name, lines, executed[name]))
    return CoverageRows(files, line_share(executed), branch_share(executed), instructions, not debug.lines)


def _file(name: str, lines: list[str], record: FileRecord) -> SourceFile:
    """Without its text, only the lines that are code."""
    if lines:
        rows = [(number, record.lines.get(number), text) for number, text in enumerate(lines, 1)]
    else:
        rows = [(number, count, "") for number, count in sorted(record.lines.items())]
    tracefile = {name: record}
    return SourceFile(name, line_share(tracefile), branch_share(tracefile), rows)
