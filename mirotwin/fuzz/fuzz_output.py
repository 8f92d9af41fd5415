"""What `mirotwin fuzz` says while it is under way, a line that is drawn again or plain lines, and at its end: counts,
coverage, crashes with the line that repeats each, and summary.json.

This is one of the few places that know the wall clock.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Self

import msgspec

from miro_exact.bad_input import amount
from miro_robot.inspect.coverage import branch_share, line_share
from miro_robot.inspect.lcov import Tracefile
from mirotwin.firmware.coverage_files import table, write
from mirotwin.fuzz.campaign import Campaign
from mirotwin.fuzz.triage import Crash
from mirotwin.shell.console import show
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.program import DONE, EXPECTATION_FAILED, complain, show_line
from mirotwin.shell.progress import ProgressBar
from mirotwin.verify.cases.replay_line import debug_line, foreign_path, replay_line

if TYPE_CHECKING:
    from rich.progress import ProgressColumn


LINE_S = 10.0
"""Wall time between two plain lines, where stderr is no terminal."""


class FuzzProgress(ProgressBar):
    """A context manager; `show(campaign)` may be called as often as one likes."""

    PATIENCE_S = 0.0

    def __init__(self, what: str, time_s: float, quiet: bool) -> None:
        super().__init__(f"fuzzing {what}", time_s, quiet)
        self._time_s = time_s
        self._quiet = quiet
        self._line_s = time.monotonic()

    def __enter__(self) -> Self:
        self.to(0.0, said="starting")
        return self

    def show(self, campaign: Campaign) -> None:
        """Draws the line again, or writes one if the last is some time ago."""
        run_s = campaign.run_s
        if self._shown:
            self.to(min(run_s, self._time_s), said=said(campaign))
        elif not self._quiet and time.monotonic() - self._line_s >= LINE_S:
            self._line_s = time.monotonic()
            left = clock(max(0.0, self._time_s - run_s))
            complain(f"{self.what}: {clock(run_s)}: {said(campaign)}, {left} left")

    def _columns(self) -> list[ProgressColumn]:
        from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

        words = [TextColumn(f"{{task.{one}}}", markup=False) for one in ("description", "fields[said]")]
        return [*words, BarColumn(bar_width=16), TimeRemainingColumn()]


def said(campaign: Campaign) -> str:
    """Rates and counts of a campaign, in short."""
    edges, triage = campaign.progress().edges, campaign.triage
    parts = [f"{campaign.rate:.0f}/s"]
    if edges is not None:  # else the engine has not said yet
        parts.append(amount(edges, "edge"))
    parts.append(amount(len(triage.confirmed) or "no", "crash", "crashes"))
    if triage.unconfirmed:
        parts.append(f"{len(triage.unconfirmed)} unconfirmed")
    return ", ".join(parts)


def clock(time_s: float) -> str:
    """A duration as minutes and seconds, `1:05`, or `2:00:00` with hours."""
    minutes, seconds = divmod(int(time_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"


COVERAGE = "coverage.info"
SUMMARY = "summary.json"


def report(campaign: Campaign, left: int, complete: bool, check: str | None, quiet: bool) -> int:
    """Writes the files of the campaign and shows the results; the exit code.

    `left`: inputs that were not looked at; `complete`: whether it came to the end of its time. `check`:
    FILE.py:FUNCTION of --check.
    """
    triage, out, progress = campaign.triage, campaign.triage.folder.path, campaign.progress()
    coverage = triage.coverage(out / COVERAGE, triage.reached.total)
    tracefile = coverage.tracefile
    never = never_reached(tracefile)
    if not quiet:
        edges = "" if progress.edges is None else f", {amount(progress.edges, 'edge')}"
        made = (
            f"{amount(progress.executions, 'execution')} in {clock(campaign.run_s)} ({campaign.rate:.0f}/s)"
        )
        new = f"{amount(campaign.inputs or 'no', 'input')} that found something new"
        show_line(f"{triage.target.image.path.name}: {made}{edges}, {new}")
        show(table(tracefile))
        if never:
            show_line(f"never reached: {', '.join(never)}")
    if left:
        inputs = amount(left, "input of the engine was", "inputs of the engine were")
        complain(f"{inputs} not looked at; a longer --time does")
    if campaign.expected and not quiet:
        show_line(f"{', '.join(campaign.expected)}: judged {amount(campaign.judged or 'no', 'input')}")
    if triage.unrepeated:
        complain(f"{amount(triage.unrepeated, 'input')} that the engine saw failing did not fail again")
    _print_crashes(campaign, check)
    missed = campaign.covering is not None and _print_covering(campaign, campaign.covering.name)
    unjudged = _print_unjudged(campaign)
    write(
        tracefile, coverage, out / COVERAGE, "--out"
    )  # what was found is told, whatever becomes of the files
    _write_summary(campaign, tracefile, never, left, complete)
    if not quiet:
        show_line(f"written to {out}")
    return EXPECTATION_FAILED if triage.confirmed or missed or unjudged else DONE


def _print_unjudged(campaign: Campaign) -> bool:
    """Names the checks of --expect that judged no input; True if one of them had no occasion."""
    open_ = {name: found for name, found in campaign.verdicts.items() if not found & {"passed", "failed"}}
    unseen = [name for name, found in open_.items() if "not observable" in found]
    for name in open_:
        verdict = "not observable" if name in unseen else "not judged"
        complain(f"expectation {verdict}: {name}: no input that was looked at lets it judge")
    return len(open_) > len(unseen)


def never_reached(tracefile: Tracefile) -> list[str]:
    """Names of functions of which no instruction ran first."""
    return sorted(
        name for record in tracefile.values() for name, (_, count) in record.functions.items() if not count
    )


def _print_crashes(campaign: Campaign, check: str | None) -> None:
    triage = campaign.triage
    show_line(amount(len(triage.confirmed) or "no", "crash", "crashes"))
    for crash in triage.confirmed:
        _print_crash(crash, campaign, check)
    if triage.unconfirmed:
        where = campaign.triage.folder.path / "unconfirmed"
        what = "not confirmed: wrong on the target, right in a World"
        show_line(f"{len(triage.unconfirmed)} {what}; kept in {where}")
        for crash in triage.unconfirmed:
            _print_crash(crash, campaign, check)


def _print_crash(crash: Crash, campaign: Campaign, check: str | None) -> None:
    where = f" in {crash.function}" if crash.function else ""
    where += f", which {crash.cause}" if crash.cause else ""
    more = campaign.triage.more[crash.name]
    again = f"; {amount(more, 'more input')}" if more else ""
    before, after = crash.sizes
    show_line(f"  {crash.name}{where}: {crash.verdict} ({amount(after, 'byte')}, found with {before}{again})")
    in_file = check if check is not None and crash.check == check.rpartition(":")[2] else None
    stream = campaign.triage.folder.path / crash.folder / f"{crash.name}.stream"
    image = foreign_path(campaign.triage.target.image)
    show_line(f"    {replay_line(stream, image, in_file)}")
    show_line(f"    {debug_line(stream, image, check=in_file)}")


def _print_covering(campaign: Campaign, symbol: str) -> bool:
    """Says whether the function was reached; True if not."""
    if campaign.reached_by is None:
        inputs = amount(campaign.inputs or "no", "input")
        complain(f"--covering {symbol}: not reached by {inputs}; give it more --time, or a --corpus")
        return True
    show_line(f"--covering {symbol}: reached by {campaign.reached_by}")
    show_line(f"    {replay_line(campaign.reached_by, foreign_path(campaign.triage.target.image))}")
    return False


def _write_summary(
    campaign: Campaign, tracefile: Tracefile, never: list[str], left: int, complete: bool
) -> None:
    progress = campaign.progress()
    lines, branches = line_share(tracefile), branch_share(tracefile)
    document = {
        "firmware_sha256": campaign.triage.target.image.sha256,
        "complete": complete,
        "run_s": campaign.run_s,
        "executions": progress.executions,
        "edges": progress.edges,
        "inputs": campaign.inputs,
        "inputs_left": left,
        "inputs_judged": campaign.judged,
        "unrepeated": campaign.triage.unrepeated,
        "lines": msgspec.to_builtins(lines),
        "branches": msgspec.to_builtins(branches),
        "functions_never_reached": never,
        "reached_by": None if campaign.reached_by is None else str(campaign.reached_by),
        "crashes": [
            {
                **msgspec.to_builtins(crash),
                "confirmed": crash.confirmed,
                "more": campaign.triage.more[crash.name],
            }
            for crash in campaign.triage.found
        ],
    }
    campaign.triage.folder.write("", SUMMARY, json_bytes(document, indent=2) + b"\n")
