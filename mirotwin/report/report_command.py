"""`mirotwin report`: a run, a case or a failed test as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from miro_exact.bad_input import BadInput
from mirotwin.report.page.document import check_size, place_of_page, write_page
from mirotwin.report.report_subject import PageSubject, is_campaign, page_of
from mirotwin.shell.command import Argument, Option, Options, command_of
from mirotwin.shell.debug_files import SourceFolders, checked_sources
from mirotwin.shell.options import FIRMWARE, FORCE, FROM, NAME, OUT, QUIET, TO, Engine
from mirotwin.shell.times import Time

SMALLER = "leave the camera's frames out with --no-frames, or look at a part with --from and --to"


class ReportOptions(Options, frozen=True, kw_only=True):
    COMMAND = "report"
    subject: Annotated[str, Argument("RUN|CASE|TEST-FAILURE", NAME)]
    out: Annotated[
        Path | None,
        OUT.saying("The page to write. Default: report.html, which replaces an earlier page."),
    ] = None
    from_time: Annotated[Time | None, FROM] = None
    to_time: Annotated[Time | None, TO.saying("End there. Default: the end of the run.")] = None
    no_frames: Annotated[bool, Option(help="Leave out the camera's frames that a run has recorded.")] = False
    firmware: Annotated[
        str | None,
        FIRMWARE.saying(
            "Case, recording: image to run instead of its own; what it does otherwise is on the page."
        ),
    ] = None
    sources: SourceFolders = ()
    force: Annotated[bool, FORCE] = False
    quiet: Annotated[bool, QUIET] = False
    engine: Engine = None


@command_of(ReportOptions)
def report(options: ReportOptions) -> int:
    """Writes one HTML file that needs no network: look at it in any browser, send it, keep it with a build.

    RUN is a folder of `mirotwin run`, or a recording (run.mcap, run.part.mcap); CASE a case (FILE.stream) as `test`,
    `fuzz` and `conform` leave it; TEST-FAILURE the folder that a failed test of pytest or `mirotwin test` leaves.
    `mirotwin campaign page` makes the page of a campaign.

    A run is made again for its page, with the recorded bytes: the profile of the firmware, its coverage, the fate of
    each frame and the verdicts of the checks come from that, and where it differs from the recording is said.
    """
    subject = options.subject
    place = place_of_page(options.out, options.force, subject, options.firmware)
    if is_campaign(subject):
        remedy = f"`mirotwin campaign page {subject}` makes its page"
        raise BadInput(subject, "", "holds the results of a campaign", remedy)
    wanted = PageSubject(
        subject=subject,
        from_tick=0 if options.from_time is None else options.from_time.ticks(),
        to_tick=None if options.to_time is None else options.to_time.ticks(),
        frames=not options.no_frames,
        firmware=options.firmware,
        sources=tuple(checked_sources(options.sources)),
        quiet=options.quiet,
    )
    made = page_of(wanted)
    check_size(made, subject, SMALLER)
    return write_page(place, made, options.quiet)
