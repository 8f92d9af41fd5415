"""`mirotwin campaign page RESULTS.parquet`: the results of a campaign as one page."""

from __future__ import annotations

from pathlib import Path

import click

from mirotwin.campaign.page import campaign_page
from mirotwin.report.page.document import check_size, place_of_page, write_page
from mirotwin.shell.options import Place

FEWER = "give the results of a campaign with fewer runs"


@click.command(short_help="Makes one page of RESULTS.parquet.")
@click.argument("results", type=Place())
@click.option(
    "-o",
    "--out",
    type=Place(path_type=Path),
    help="The page to write. Default: report.html, which replaces an earlier page.",
)
@click.option("--force", is_flag=True, help="Replace the file at --out.")
@click.option("-q", "--quiet", is_flag=True, help="No last line.")
def page(results: str, out: Path | None, force: bool, quiet: bool) -> int:
    """Writes one HTML file that needs no network: the spread of each arm, paired differences, what failed, and the
    command that makes any run again.
    """
    place = place_of_page(out, force, results)
    made = campaign_page(Path(results))
    check_size(made, results, FEWER)
    return write_page(place, made, quiet)
