"""`mirotwin reproduce`: the paper's figures and claims, run again, as a page with pictures and recordings."""

from __future__ import annotations

import csv
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import msgspec

from miro_exact.bad_input import amount
from mirotwin.campaign.drive import outcomes_of
from mirotwin.campaign.plan import Plan
from mirotwin.campaign.ranges import SEEDS
from mirotwin.campaign.reproduce.page import page
from mirotwin.campaign.reproduce.pictures import draw, track_of
from mirotwin.campaign.reproduce.plan import (
    GROUPS,
    ILLUSTRATIVE,
    LEARNING,
    PAPER,
    RETUNED,
    STARTS,
    RunGroup,
    Start,
    plan_of,
    recorded,
)
from mirotwin.campaign.reproduce.rows import RunRow, by_label, middle_seeds, row_of
from mirotwin.campaign.reproduce.tables import tables_of
from mirotwin.campaign.worker import Work
from mirotwin.campaign.workers import Processes, Workers
from mirotwin.shell.command import Options, command_of
from mirotwin.shell.held_signals import Hold, held_signals
from mirotwin.shell.options import FORCE, JOBS, OUT, QUIET, Engine
from mirotwin.shell.outputs import OutputError, OutputFolder, check_new, told_when_full, whole_file
from mirotwin.shell.program import complain, show_line
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import exit_code

PAGE = "reproduction.md"
FOLDER = "reproduction"
ROWS = "rows.csv"
TABLES = "tables.json"


class ReproduceOptions(Options, frozen=True, kw_only=True):
    COMMAND = "reproduce"
    out: Annotated[Path | None, OUT.saying(f"Folder for {PAGE} and {FOLDER}/. Default: here.")] = None
    seeds: Annotated[range, SEEDS] = range(50)
    jobs: Annotated[int | None, JOBS] = None
    engine: Engine = None
    force: Annotated[bool, FORCE.saying("Replace the files of an earlier reproduction.")] = False
    quiet: Annotated[bool, QUIET] = False


@command_of(ReproduceOptions)
def reproduce(options: ReproduceOptions) -> int:
    """Runs Figs. 6 to 10 of the paper, and the comparison of its controllers, over all seeds.

    Writes reproduction.md (each claim with its verdict), and in the folder reproduction: five pictures, rows.csv with a
    row for each run, tables.json with all tables, and of each controller and start the recording of the run with the
    median error. Running it again gives the same bytes.
    """
    seeds, force, quiet, out = options.seeds, options.force, options.quiet, options.out or Path(".")
    began_s = time.monotonic()
    names = [*(f"{start.name}.svg" for start in STARTS), ROWS, TABLES, *(group.recording for group in GROUPS)]
    folder = OutputFolder(out / FOLDER, force, names)
    if (out / FOLDER).is_dir() or (out / PAGE).exists():
        check_new(out / PAGE, "--out", force)
    plan, workers = plan_of(seeds), Processes(options.jobs)
    with (
        held_signals() as hold,
        folder,
        whole_file(out / PAGE, "--out") as page_path,
        told_when_full(out / FOLDER, "--out"),
    ):
        folder.keep = (ROWS,)
        rows = _run(plan, workers, folder.part(ROWS), hold, quiet)
        shown = middle_seeds(by_label(rows))
        jobs = recorded(plan, shown, lambda name: str(folder.part(name)))
        _record(jobs, workers, folder, hold, quiet)
        for start in STARTS:
            _draw(start, folder, shown)
        tables = tables_of(by_label(rows), f"{seeds[0]} to {seeds[-1]}")
        tables.write(folder.part(TABLES))
        page_path.write_text(page(tables, FOLDER, TABLES), encoding="utf-8")
    if not quiet:
        show_line(f"{amount(len(rows), 'run')} in {time.monotonic() - began_s:.0f} s: {out / PAGE}")
    return _failures(rows)


def _run(plan: Plan, workers: Workers, path: Path, hold: Hold, quiet: bool) -> list[RunRow]:
    """All rows; each is written to the file when it is ready."""
    rows: list[RunRow] = []
    names = [field.name for field in msgspec.structs.fields(RunRow)]
    with (
        path.open("w", newline="", encoding="utf-8") as stream,
        ProgressBar("running", plan.runs, quiet) as bar,
    ):
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        with hold.released():
            for outcome in outcomes_of([plan.work(run) for run in range(plan.runs)], workers):
                rows.append(row_of(plan, outcome))
                writer.writerow(msgspec.structs.astuple(rows[-1]))
                stream.flush()
                bar.to(len(rows))
    return rows


def _record(jobs: Sequence[Work], workers: Workers, folder: OutputFolder, hold: Hold, quiet: bool) -> None:
    """The runs that are shown, once more, with their recordings. Raises OutputError for one that cannot be written."""
    with ProgressBar("recording", len(jobs), quiet) as bar, hold.released():
        for done, outcome in enumerate(outcomes_of(jobs, workers), 1):
            if outcome.verdict == "error":
                raise OutputError(
                    folder.path, outcome.error, "make room, or choose another folder with --out"
                )
            bar.to(done)


def _draw(start: Start, folder: OutputFolder, seeds: Mapping[str, int]) -> None:
    """The figure's own controller, the other one, and the improved chain, each with the seed of its median error."""
    names = {
        PAPER: "the paper's law",
        RETUNED: "epsilon-tracking, retuned",
        ILLUSTRATIVE: "epsilon-tracking, illustrative",
        LEARNING: "body_frame, ekf, self_calibration",
    }
    shown = (PAPER, LEARNING) if start.figure < 9 else (ILLUSTRATIVE, RETUNED, PAPER, LEARNING)
    groups = {controller: RunGroup(start, controller) for controller in shown}
    tracks = {
        f"{names[controller]} (seed {seeds[group.label]})": track_of(folder.part(group.recording), 1)
        for controller, group in groups.items()
        if group.label in seeds
    }
    if not tracks:
        return
    errors = f"{start.x_cm:.2f} cm, {start.y_cm:.2f} cm, {start.theta_rad:.2f} rad"
    title = f"Fig. {start.figure} again: {start.path}, initial errors ({errors})"
    draw(folder.part(f"{start.name}.svg"), title, tracks)


def _failures(rows: Sequence[RunRow]) -> int:
    failed = [row for row in rows if row.error]
    for row in failed[:5]:
        complain(f"{row.label}, seed {row.seed}: {row.error}")
    if failed:
        complain(f"{len(failed)} of {len(rows)} runs failed; {ROWS} says which")
    if faults := sum(row.faults for row in rows):
        complain(f"{faults} firmware faults; rows.csv says in which runs")
    return exit_code("error" if failed else "fault" if faults else "passed")
