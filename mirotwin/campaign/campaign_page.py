"""`mirotwin campaign page RESULTS.parquet`: the results of a campaign as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from mirotwin.campaign.page import campaign_page
from mirotwin.report.page.document import check_size, place_of_page, write_page
from mirotwin.shell.command import Argument, Options, command_of
from mirotwin.shell.options import FORCE, NAME, OUT, QUIET

FEWER = "give the results of a campaign with fewer runs"


class PageOptions(Options, frozen=True, kw_only=True):
    COMMAND = "campaign page"
    results: Annotated[str, Argument("RESULTS", NAME)]
    out: Annotated[
        Path | None,
        OUT.saying("The page to write. Default: report.html, which replaces an earlier page."),
    ] = None
    force: Annotated[bool, FORCE] = False
    quiet: Annotated[bool, QUIET.saying("No last line.")] = False


@command_of(PageOptions)
def page(options: PageOptions) -> int:
    """Writes one HTML file that needs no network: the spread of each arm, paired differences, what failed, and the
    command that makes any run again.
    """
    place = place_of_page(options.out, options.force, options.results)
    made = campaign_page(Path(options.results))
    check_size(made, options.results, FEWER)
    return write_page(place, made, options.quiet)
