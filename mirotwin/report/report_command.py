"""`mirotwin report`: a run, a case or a failed test as one page."""

from __future__ import annotations

from pathlib import Path

import click

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.firmware.sources_option import checked_sources, sources_option
from mirotwin.report.page.document import check_size, place_of_page, write_page
from mirotwin.report.page.run_page import run_page
from mirotwin.report.report_subject import Wanted, is_campaign, material_of
from mirotwin.shell.options import Place, engine_option, firmware_option
from mirotwin.shell.times import Time, TimeType

SMALLER = "leave the camera's frames out with --no-frames, or look at a part with --from and --to"


@click.command(short_help="Makes one page of a run, a case or a failed test.")
@click.argument("subject", metavar="RUN|CASE|TEST-FAILURE", type=Place())
@click.option(
    "-o",
    "--out",
    type=Place(path_type=Path),
    help="The page to write. Default: report.html, which replaces an earlier page.",
)
@click.option(
    "--from", "from_tick", type=TimeType(), default="0t", help="Begin there, such as 1.5s, 20ms or 48000t."
)
@click.option("--to", "to_tick", type=TimeType(), help="End there. Default: the end of the run.")
@click.option("--no-frames", is_flag=True, help="Leave out the camera's frames that a run has recorded.")
@firmware_option("Case, recording: image to run instead of its own; what it does otherwise is on the page.")
@sources_option
@click.option("--force", is_flag=True, help="Replace the file at --out.")
@click.option("-q", "--quiet", is_flag=True, help="No progress bar, no last line.")
@engine_option
def report(
    subject: str,
    out: Path | None,
    from_tick: Time,
    to_tick: Time | None,
    no_frames: bool,
    firmware: str | None,
    sources: tuple[str, ...],
    force: bool,
    quiet: bool,
    engine: str | None,
) -> int:
    """Writes one HTML file that needs no network: look at it in any browser, send it, keep it with a build.

    RUN is a folder of `mirotwin run`, or a recording (run.mcap, run.part.mcap); CASE a case (FILE.stream) as `test`,
    `fuzz` and `conform` leave it; TEST-FAILURE the folder that a failed test of pytest or `mirotwin test` leaves.
    `mirotwin campaign page` makes the page of a campaign.

    A run is made again for its page, with the recorded bytes: the profile of the firmware, its coverage, the fate of
    each frame and the verdicts of the checks come from that, and where it differs from the recording is said.
    """
    place = place_of_page(out, force, subject, firmware)
    if is_campaign(subject):
        remedy = f"`mirotwin campaign page {subject}` makes its page"
        raise BadInput(subject, "", "holds the results of a campaign", remedy)
    wanted = Wanted(
        subject=subject,
        from_tick=from_tick.ticks(TICKS_PER_SECOND),
        to_tick=None if to_tick is None else to_tick.ticks(TICKS_PER_SECOND),
        frames=not no_frames,
        firmware=firmware,
        sources=tuple(checked_sources(sources)),
        engine=engine,
        quiet=quiet,
    )
    made = run_page(material_of(wanted))
    check_size(made, subject, SMALLER)
    return write_page(place, made, quiet)
