"""Firmware coverage reports, for the command line and the pytest plugin."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import msgspec
from rich.table import Table

from miro_exact.bad_input import one_line
from miro_exact.inputs import read_input
from miro_robot.image import Image
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.inspect.coverage import (
    Counts,
    Share,
    at_paths,
    branch_share,
    by_line,
    by_listing,
    instruction_share,
    line_share,
    missed,
)
from miro_robot.inspect.lcov import Tracefile, decode, encode
from mirotwin.shell.console import plain_table
from mirotwin.shell.outputs import whole_file


class Report(msgspec.Struct, frozen=True):
    """`listing`: text of the listing whose lines were counted, None when C lines were."""

    tracefile: Tracefile
    instructions: Share
    listing: str | None


def has_listing(image: Image) -> bool:
    """True if the lines that are counted are those of a listing: no debug file names C lines."""
    return not DebugInfo.of(image).lines


def listing_path(out: Path) -> Path:
    """Path of the listing that belongs to the tracefile at `out`."""
    return out.with_name(f"{out.name}.lst")


def collect(image: Image, counts: Counts, sources: Sources, out: Path | None) -> Report:
    """Coverage of `image` with paths relative to the current folder."""
    debug = DebugInfo.of(image)
    share = instruction_share(image, debug, counts)
    if debug.lines:
        tracefile = at_paths(by_line(image, debug, counts), sources, Path.cwd())
        return Report(tracefile, share, None)
    listing, record = by_listing(image, counts)
    return Report({str(listing_path(out or image.path)): record}, share, listing)


def is_of_another_image(report: Report, out: Path) -> bool:
    """True if the listing beside `out` is not the one whose lines `report` counts: its line numbers do not fit."""
    beside = listing_path(out)
    if report.listing is None or not beside.exists():
        return False
    return read_input(beside) != report.listing.encode("utf-8")


def write(total: Tracefile, report: Report, out: Path, option: str) -> None:
    """Writes `total`, and the listing of `report` if it has one. Raises OutputError; then neither is written."""
    with ExitStack() as files:
        for path, text in ((listing_path(out), report.listing), (out, encode(total))):
            if text is not None:
                files.enter_context(whole_file(path, option)).write_bytes(
                    text.encode("utf-8", "surrogateescape")
                )


def read_tracefile(path: Path) -> Tracefile:
    """The content of a tracefile; empty if the file does not exist. Raises BadInput."""
    if not path.exists():
        return {}
    return decode(read_input(path).decode("utf-8-sig", "surrogateescape"), str(path))


def table(tracefile: Tracefile) -> Table:
    """A row a file and a total: lines, branches, and the lines that never ran."""
    result = plain_table("file", "lines", "branches", "never ran")
    for path in sorted(tracefile):
        single = {path: tracefile[path]}
        result.add_row(
            one_line(path), str(line_share(single)), str(branch_share(single)), missed(tracefile[path])
        )
    result.add_row("all", str(line_share(tracefile)), str(branch_share(tracefile)), "")
    return result
