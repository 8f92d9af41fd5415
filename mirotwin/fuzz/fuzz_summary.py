"""What `mirotwin fuzz` says at the end: counts, coverage, finds with the line that repeats each, and summary.json."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from miro_robot.firmware import image_path
from miro_robot.image import Image
from miro_robot.inspect.coverage import branch_share, line_share
from miro_robot.inspect.lcov import Tracefile
from mirotwin.firmware.coverage_files import table
from mirotwin.fuzz.campaign import Campaign
from mirotwin.fuzz.fuzz_progress import clock, counted
from mirotwin.fuzz.triage import Find
from mirotwin.shell.console import show
from mirotwin.shell.program import DONE, EXPECTATION_FAILED, complain, show_line
from mirotwin.verify.cases import replay_line as line
from mirotwin.verify.expectations import is_in_file

COVERAGE = "coverage.info"
SUMMARY = "summary.json"


class Ended(msgspec.Struct, frozen=True):
    """`left`: inputs that were not looked at; `complete`: whether it came to the end of its time.

    `checks`: those of --expect.
    """

    left: int
    complete: bool
    checks: tuple[str, ...] = ()


def report(
    campaign: Campaign, image: Image, out: Path, covering: str | None, ended: Ended, quiet: bool
) -> int:
    """Writes the files of the campaign and says what came of it; the exit code."""
    finds = campaign.finds
    tracefile = finds.write_coverage(out / COVERAGE, finds.reached.total)
    never = never_reached(tracefile)
    _write_summary(campaign, out, tracefile, never, ended)
    status = campaign.status()
    if not quiet:
        edges = "" if status.edges is None else f", {status.edges} edges"
        rate = status.executions / status.run_s if status.run_s else 0.0
        show_line(
            f"{image.path.name}: {status.executions} executions in {clock(status.run_s)} ({rate:.0f}/s){edges},"
            f" {counted(campaign.inputs, 'input')} that found something new"
        )
        show(table(tracefile))
        if never:
            show_line(f"never reached: {', '.join(never)}")
    if ended.left:
        complain(f"{counted(ended.left, 'input')} of the engine were not looked at; a longer --time does")
    if campaign.expected and not quiet:
        show_line(f"{', '.join(campaign.expected)}: judged {counted(campaign.judged, 'input')}")
    if finds.unrepeated:
        complain(f"{counted(finds.unrepeated, 'input')} that the engine saw failing did not fail again")
    _print_finds(campaign, out, image, ended.checks)
    if not quiet:
        show_line(f"written to {out}")
    missed = covering is not None and _print_covering(campaign, covering, image)
    return EXPECTATION_FAILED if finds.confirmed or missed else DONE


def never_reached(tracefile: Tracefile) -> list[str]:
    """Names of functions of which no instruction ran first."""
    return sorted(
        name for record in tracefile.values() for name, (_, count) in record.functions.items() if not count
    )


def _print_finds(campaign: Campaign, out: Path, image: Image, checks: Sequence[str]) -> None:
    finds = campaign.finds
    show_line(counted(len(finds.confirmed), "find"))
    for find in finds.confirmed:
        _print_find(find, finds.more[find.name], out, image, checks)
    if finds.unconfirmed:
        show_line(
            f"{len(finds.unconfirmed)} not confirmed: wrong on the target, right in a World; kept in"
            f" {out / 'unconfirmed'}"
        )
        for find in finds.unconfirmed:
            _print_find(find, finds.more[find.name], out, image, checks)


def _print_find(find: Find, more: int, out: Path, image: Image, checks: Sequence[str]) -> None:
    where = f" in {find.function}" if find.function else ""
    again = f"; {counted(more, 'more input')}" if more else ""
    before, after = find.sizes
    show_line(f"  {find.name}{where}: {find.verdict} ({after} bytes, found with {before}{again})")
    in_file = next(
        (text for text in checks if is_in_file(text) and text.rpartition(":")[2] == find.check), ""
    )
    show_line(f"    {replay_line(out / find.folder / f'{find.name}.stream', image, in_file)}")


def replay_line(stream: Path, image: Image, in_file: str = "") -> str:
    """The command that plays it again. `in_file`: the check of a case that is in a file, which no case names."""
    own = image.path.resolve() == image_path().resolve()
    return line.replay_line(stream, None if own else image.path, in_file)


def _print_covering(campaign: Campaign, symbol: str, image: Image) -> bool:
    """Says whether the function was reached; True if not."""
    if campaign.reached_by is None:
        inputs = counted(campaign.inputs, "input")
        complain(f"--covering {symbol}: not reached by {inputs}; give it more --time, or a --corpus")
        return True
    show_line(f"--covering {symbol}: reached by {campaign.reached_by}")
    show_line(f"    {replay_line(campaign.reached_by, image)}")
    return False


def _write_summary(
    campaign: Campaign, out: Path, tracefile: Tracefile, never: list[str], ended: Ended
) -> None:
    status = campaign.status()
    lines, branches = line_share(tracefile), branch_share(tracefile)
    document = {
        "firmware_sha256": campaign.finds.target.image.sha256,
        "complete": ended.complete,
        "run_s": status.run_s,
        "executions": status.executions,
        "edges": status.edges,
        "inputs": campaign.inputs,
        "inputs_left": ended.left,
        "inputs_judged": campaign.judged,
        "unrepeated": campaign.finds.unrepeated,
        "lines": msgspec.to_builtins(lines),
        "branches": msgspec.to_builtins(branches),
        "functions_never_reached": never,
        "reached_by": None if campaign.reached_by is None else str(campaign.reached_by),
        "finds": [_as_json(find, campaign) for find in campaign.finds.found],
    }
    campaign.folder.write("", SUMMARY, msgspec.json.format(msgspec.json.encode(document)) + b"\n")


def _as_json(find: Find, campaign: Campaign) -> dict[str, object]:
    return {**msgspec.to_builtins(find), "confirmed": find.confirmed, "more": campaign.finds.more[find.name]}
