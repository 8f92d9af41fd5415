"""`mirotwin fw coverage`: which of the firmware's lines, branches and instructions ran."""

from __future__ import annotations

from pathlib import Path

import click

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
from mirotwin.firmware.sources_option import sources_of, sources_option
from mirotwin.firmware.subject import Request, look, open_run, subject_options
from mirotwin.shell.console import show
from mirotwin.shell.options import Place
from mirotwin.shell.outputs import check_new, check_not_input


@click.command(short_help="Shows which lines of the firmware ran.")
@subject_options
@click.option(
    "--out",
    type=Place(path_type=Path),
    metavar="FILE.info",
    help="Write an lcov tracefile (genhtml, CI services).",
)
@click.option("--append", is_flag=True, help="Add the counts to the file at --out.")
@click.option("--force", is_flag=True, help="Replace the file at --out, and its listing.")
@sources_option
def coverage(request: Request, out: Path | None, append: bool, force: bool, sources: tuple[str, ...]) -> int:
    """Shows which C lines, branches and instructions ran in SUBJECT, and writes them as an lcov tracefile.

    For an image without debug files the lines are those of its listing, written beside FILE.info as FILE.info.lst.
    """
    if append and force:
        raise BadInput("", "", "--append adds to the file, --force replaces it", "give one of the two")
    total: Tracefile = {}
    if out is not None:
        _check(out, request, append or force)
        total = read_tracefile(out) if append else {}
    run = open_run(request)

    image = with_debug_files(run.image)
    if out is not None and has_listing(image):
        _check(listing_path(out), request, append or force)
    counters = Counters()
    folders = sources_of(image, sources)
    code = look(run, request, counters)
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


def _check(path: Path, request: Request, may_be_there: bool) -> None:
    check_not_input(path, "--out", *request.files)
    check_new(path, "--out", may_be_there, more="add to it with --append, ")
