"""`mirotwin fw coverage`: which of the firmware's lines, branches and instructions ran."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from miro_exact.bad_input import BadInput
from miro_robot.inspect.counters import Counters
from miro_robot.inspect.coverage import counts_of
from miro_robot.inspect.lcov import Tracefile, add
from mirotwin.firmware.coverage_files import (
    collect,
    has_listing,
    is_of_another_image,
    listing_path,
    read_tracefile,
    table,
    with_debug_files,
    write,
)
from mirotwin.firmware.sources_option import SourceFolders, sources_of
from mirotwin.firmware.subject import WindowOptions, look, open_window
from mirotwin.shell.command import Option, command_of
from mirotwin.shell.console import show
from mirotwin.shell.options import FORCE, OUT
from mirotwin.shell.outputs import check_new, check_not_input


class CoverageOptions(WindowOptions, frozen=True, kw_only=True):
    COMMAND = "fw coverage"
    out: Annotated[
        Path | None,
        OUT.saying("Write an lcov tracefile (genhtml, CI services).", metavar="FILE.info"),
    ] = None
    append: Annotated[bool, Option(help="Add the counts to the file at --out.", apart="force")] = False
    force: Annotated[bool, FORCE.saying("Replace the file at --out, and its listing.")] = False
    sources: SourceFolders = ()


@command_of(CoverageOptions)
def coverage(options: CoverageOptions) -> int:
    """Shows which C lines, branches and instructions ran in SUBJECT, and writes them as an lcov tracefile.

    For an image without debug files the lines are those of its listing, written beside FILE.info as FILE.info.lst.
    """
    out, append = options.out, options.append
    total: Tracefile = {}
    if out is not None:
        _check(out, options, append or options.force)
        total = read_tracefile(out) if append else {}
    run = open_window(options)

    image = with_debug_files(run.image)
    if out is not None and has_listing(image):
        _check(listing_path(out), options, append or options.force)
    counters = Counters()
    folders = sources_of(image, options.sources)
    code = look(run, options, counters)
    report = collect(image, counts_of(counters), folders, out)
    if append and out is not None and is_of_another_image(report, out):
        raise BadInput(
            listing_path(out),
            "",
            "is the listing of another image",
            "name another file with --out, or use --force",
        )
    add(total, report.tracefile)
    if out is not None:
        write(total, report, out, "--out")
    show(table(total))
    show(f"instructions of this run: {report.instructions}")
    return code


def _check(path: Path, options: WindowOptions, may_be_there: bool) -> None:
    check_not_input(path, "--out", *options.files)
    check_new(path, "--out", may_be_there, more="add to it with --append, ")
