"""Runs a campaign from its plan to the results file, and resumes one that an earlier process left unfinished."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import closing
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from mirotwin.campaign import results as tables
from mirotwin.campaign.drive import Drive
from mirotwin.campaign.journal import Journal, journal_path
from mirotwin.campaign.plan import Plan
from mirotwin.campaign.worker import RunOutcome
from mirotwin.campaign.workers import Processes, Workers, refuse_in_import
from mirotwin.shell.outputs import check_file, make_folder

MANY_RUNS = 100_000
"""More runs need the user's consent: they take most of a day."""


class Tally(msgspec.Struct):
    """Progress: how many of `runs` have an outcome (`done`), and how many of these this process computed (`new`)."""

    done: int = 0
    runs: int = 0
    new: int = 0


def refuse_many(plan: Plan, agreed: bool) -> None:
    """Raises BadInput for more than `MANY_RUNS` runs, unless the user `agreed`."""
    if plan.runs > MANY_RUNS and not agreed:
        reason = f"has {plan.runs} runs, more than {MANY_RUNS}"
        raise BadInput(plan.path, "", reason, "take fewer seeds or levels, or say --yes")


def run(
    plan: Plan,
    results: str | Path,
    executor: Executor | Workers | None = None,
    *,
    force: bool = False,
    many: bool = False,
    on_outcome: Callable[[Tally, RunOutcome], object] = lambda tally, outcome: None,
) -> Tally:
    """Runs everything that `results` lacks, and writes the file.

    `executor`: any of `concurrent.futures`, which stays open; without one, a process for each core. Complete results of
    the same campaign are left unchanged; results of another one raise BadInput; `force` runs them again. `many`: allow
    more than 100 000 runs. After an interruption, call it again to resume. A script calls it below `if __name__ ==
    "__main__":`: the processes import the script, and BadInput is raised otherwise.
    """
    refuse_in_import()
    path = Path(results)
    tables.require_arrow()
    refuse_many(plan, many)
    make_folder(path.parent, "--out")
    if not force and _complete(path, plan):
        journal_path(path).unlink(missing_ok=True)  # left by a process that ended before it was taken away
        return Tally(plan.runs, plan.runs)
    workers = executor if isinstance(executor, Workers) else Workers(executor) if executor else Processes()
    check_file(path, "--out")
    with Journal(journal_path(path), plan.head, discard=force) as journal:
        tally = Tally(journal.count, plan.runs)
        with closing(Drive(plan.work, workers).outcomes(journal.missing())) as outcomes:
            for outcome in outcomes:
                journal.add(outcome)
                tally.done, tally.new = journal.count, tally.new + 1
                on_outcome(tally, outcome)
        tables.write(plan, journal.path, path)
    journal.path.unlink()
    return tally


def _complete(results: Path, plan: Plan) -> bool:
    """True if the results are there. Raises BadInput for a file of another campaign, and where none can be written."""
    if results.suffix != ".parquet":
        raise BadInput(results, "", "results are a .parquet file", f"write --out {results.stem}.parquet")
    if not results.exists():
        return False
    difference = plan.head.difference(tables.read_about(results).head)
    if difference:
        reason = f"holds the results of another campaign: {difference}"
        raise BadInput(results, "", reason, "choose another file with --out, or replace it with --force")
    return True
