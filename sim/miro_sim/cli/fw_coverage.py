"""`mirotwin fw coverage`: which of the firmware's lines, branches and instructions ran."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from miro_sim.cli.debug import sources_of, sources_option, with_debug_files
from miro_sim.cli.options import Place
from miro_sim.cli.program import show
from miro_sim.cli.subject import Request, look, open_run, subject_options
from miro_sim.firmware_coverage import collect, read_tracefile, table
from miro_sim.outdir import check_file, check_not_input, whole_file

if TYPE_CHECKING:
    from miro_robot.inspect.lcov import Tracefile


@click.command(short_help="Shows which lines of the firmware ran.")
@subject_options
@click.option(
    "--out", type=Place(), metavar="FILE.info", help="Write an lcov tracefile (genhtml, CI services)."
)
@click.option("--append", is_flag=True, help="Add to what --out holds already.")
@sources_option
def coverage(request: Request, out: str | None, append: bool, sources: tuple[str, ...]) -> int:
    """Shows which C lines, branches and instructions ran in SUBJECT, and writes them as an lcov tracefile.

    For an image without debug files the lines are those of its listing, written beside FILE.info as FILE.info.lst.
    """
    before: Tracefile = {}
    if out is not None:
        check_file(Path(out), "--out")
        check_not_input(Path(out), "--out", request.subject, request.firmware, request.stdin)
        before = read_tracefile(Path(out)) if append else {}
    run = open_run(request)
    from miro_robot.inspect.counters import Counters
    from miro_robot.inspect.coverage import counts_of
    from miro_robot.inspect.lcov import add, encode

    image = with_debug_files(run.image)
    counters = Counters()
    folders = sources_of(image, sources)
    code = look(run, request, counters)
    report = collect(image, counts_of(counters), folders, None if out is None else Path(out))
    total = before
    add(total, report.tracefile)
    if out is not None:
        if report.listing is not None:
            with whole_file(report.listing_path, "--out") as staging:
                staging.write_text(report.listing, encoding="utf-8")
        with whole_file(Path(out), "--out") as staging:
            staging.write_text(encode(total), encoding="utf-8")
    show(table(total))
    show(f"instructions of this run: {report.instructions}")
    return code
