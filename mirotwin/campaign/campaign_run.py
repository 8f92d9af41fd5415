"""`mirotwin campaign FILE.toml`: all runs of a campaign into one Parquet file."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import click
from msgspec.structs import replace

from miro_exact.bad_input import amount
from mirotwin.campaign import running
from mirotwin.campaign.chances import clean_line
from mirotwin.campaign.file import MOST_RUNS, load
from mirotwin.campaign.flips import flipped
from mirotwin.campaign.journal import journal_path
from mirotwin.campaign.plan import Plan
from mirotwin.campaign.ranges import SEEDS, seed_range
from mirotwin.campaign.results import counted, require_arrow
from mirotwin.campaign.running import Tally
from mirotwin.campaign.worker import RunOutcome
from mirotwin.campaign.workers import Processes
from mirotwin.shell.command import Argument, Option, Options, Word, command_of
from mirotwin.shell.options import FORCE, JOBS, OUT, PATH, QUIET, SET, Engine, Whole
from mirotwin.shell.outputs import told_when_full
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.shell.program import complain, show_line, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import DONE, exit_code
from mirotwin.verify.expectations import Expected, as_settings

LINES = 5
"""Largest number of failed runs named on the console."""


def _share(text: str) -> tuple[int, int]:
    failed, _, seeds = text.partition("/")
    if not (failed.isdecimal() and seeds.isdecimal() and 0 < int(failed) <= int(seeds)):
        raise ValueError(f"{text[:40]!r} is not FAILED/SEEDS, such as 2/50")
    return int(failed), int(seeds)


_WAS = Word("share", _share, lambda share: f"{share[0]}/{share[1]}")


class CampaignOptions(Options, frozen=True, kw_only=True):
    COMMAND = "campaign run"
    file: Annotated[Path, Argument("FILE.toml", PATH)]
    out: Annotated[Path | None, OUT.saying("Results. Default: runs/FILE.parquet.")] = None
    seeds: Annotated[
        range | None,
        SEEDS.saying("First and last seed, instead of those of the file.", type=seed_range(MOST_RUNS)),
    ] = None
    settings: Annotated[
        tuple[str, ...],
        SET.saying("A key of the scenario, for all runs, as `mirotwin run` has it; may be repeated."),
    ] = ()
    flips: Annotated[
        int | None,
        Option(
            metavar="N",
            type=Whole(1, 100_000),
            help="So many bits of RAM that turn over, a run each, beside runs without. `show` says what came of"
            " them, by variable.",
        ),
    ] = None
    expected: Expected = ()
    plugins: PluginFiles = PluginFiles()
    was: Annotated[
        tuple[int, int] | None,
        Option(
            type=_WAS,
            metavar="FAILED/SEEDS",
            help="Before a fix so many seeds failed: say whether enough of them are clean to believe in it.",
        ),
    ] = None
    jobs: Annotated[int | None, JOBS] = None
    engine: Engine = None
    force: Annotated[bool, FORCE.saying("Replace results that are there, or parts of them.")] = False
    yes: Annotated[bool, Option(help=f"More than {running.MANY_RUNS} runs are meant.")] = False
    quiet: Annotated[bool, QUIET] = False


@command_of(CampaignOptions)
def run(options: CampaignOptions) -> int:
    """Runs the campaign in FILE.toml, or the built-in campaign `bench2`, and writes a row for each run to a Parquet
    file.

    To resume an interrupted campaign, give the same command again; only the runs under way are lost (FILE.part.jsonl).
    The file is the same byte for byte on every machine and with any number of jobs; wall times are in
    FILE.wall.parquet.

    If no run fails, a line gives the highest failure rate that is still possible at 95 %.

    Exit code 2: a run has an error; 3: a firmware fault; 1: more runs than allowed_failed_share failed a check, or
    could not be judged by it. The rows name the runs.
    """
    require_arrow()
    options.plugins.bring()
    settings = (*options.settings, *as_settings(options.expected, files=False))
    plan = load(options.file, settings, options.plugins)
    if options.flips is not None:
        plan = flipped(plan, options.flips)
    tell_notes(plan.notes)
    if options.seeds is not None:
        first, count = options.seeds[0], len(options.seeds)
        design = replace(plan.design, first_seed=first, seed_count=count)
        plan = replace(plan, design=design)
    results = options.out or Path("runs") / f"{options.file.stem}.parquet"
    began_s = time.monotonic()
    tally = _run(plan, results, options)
    wall_s = time.monotonic() - began_s
    if tally.new and not options.quiet:
        now = f"{tally.new} of them now, in {wall_s:.1f} s, {tally.new / wall_s:.1f} runs/s"
        show_line(f"{amount(tally.runs, 'run')} ({now}): {results}")
    elif not options.quiet:
        show_line(f"{results} has all {amount(plan.runs, 'run')} already")
    code = _judge(plan, results, options.flips is not None)
    if not options.quiet and set(counted(results, 0)) == {"passed"}:
        show_line(clean_line(plan.design.seed_count, options.was))
    return code


def _run(plan: Plan, results: Path, options: CampaignOptions) -> Tally:
    last: Tally | None = None

    def show(tally: Tally, outcome: RunOutcome) -> None:
        nonlocal last
        last = tally
        click.echo(outcome.traceback, err=True, nl=False)
        bar.begun = tally.done - tally.new
        bar.to(tally.done)

    journal, workers = journal_path(results), Processes(options.jobs)
    try:
        with (
            told_when_full(journal, "--out", "file"),
            ProgressBar(plan.path, plan.runs, options.quiet, "runs") as bar,
        ):
            return running.run(plan, results, workers, force=options.force, many=options.yes, on_outcome=show)
    except BaseException:
        if last is not None:
            complain(f"{last.done} of {plan.runs} runs are in {journal}; the same command goes on from there")
        raise


def _judge(plan: Plan, results: Path, has_flips: bool) -> int:
    """Reports the failed runs; returns the exit code. A flip that changed nothing is a result, no failure."""
    counts = counted(results, LINES)
    for verdict, (count, first) in counts.items():
        if verdict != "passed" and not (has_flips and verdict == "not judged"):
            _list(verdict, first)
            if count > len(first):
                complain(f"{verdict}: {count - len(first)} more of {count}")
    errors, faults, failed, unjudged = (
        counts.get(name, (0, []))[0] for name in ("error", "fault", "failed", "not judged")
    )
    if has_flips:
        unjudged = 0
    if errors:
        complain(f"{errors} of {plan.runs} runs have an error; {results} says which")
        return exit_code("error")
    if faults:
        complain(f"{faults} of {plan.runs} runs had firmware faults")
        return exit_code("fault")
    if failed + unjudged > plan.allowed_failed_share * plan.runs:
        allowed = f"{100 * plan.allowed_failed_share:g} % may"
        if failed:
            complain(f"expectation failed: {failed} of {plan.runs} runs failed a check; {allowed}")
        if unjudged:
            complain(
                f"expectation not judged: {unjudged} of {plan.runs} runs had no occasion for a check; {allowed}"
            )
        return exit_code("failed")
    return DONE


def _list(verdict: str, first: Sequence[tuple[int, str]]) -> None:
    """Prints one line for each distinct text; runs that repeat a text are listed by number only."""
    runs: dict[str, list[int]] = {}
    for run, text in first:
        runs.setdefault(text, []).append(run)
    for text, numbers in runs.items():
        which = f"run{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}"
        complain(f"{verdict}: {which}: {text}" if text else f"{verdict}: {which}")
