"""`mirotwin why RUN`: when the failure of a run became inevitable."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

from msgspec.structs import replace
from rich.table import Table

from miro_exact.bad_input import BadInput, encodable
from miro_exact.domain import MAX_SEED
from miro_sim.scenario.board_scenario import load_any
from mirotwin.campaign.branches import (
    FROM_START,
    STEP,
    Point,
    branch,
    branched,
    failure_of,
    has_failed,
    search,
)
from mirotwin.campaign.why_page import COLUMNS, Curve, cells, page
from mirotwin.runs.failure_place import place_at
from mirotwin.runs.job import load_job
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.runs.test_file import stem_of
from mirotwin.shell.command import Argument, Option, command_of
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.firmware_image import image_for
from mirotwin.shell.options import FORCE, JOBS, NAME, OUT, QUIET, SEED, SET, Engine, Whole, plain_parameters
from mirotwin.shell.outputs import RECORDINGS, OutputFolder, file_in
from mirotwin.shell.processes import cores
from mirotwin.shell.program import show_line, tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import DONE
from mirotwin.verify.cases.artifacts import CASES
from mirotwin.verify.cases.case import expect_of_failure
from mirotwin.verify.cases.replay_line import CaseOptions, DebugLineOptions, foreign_path, replay_line
from mirotwin.verify.checks.expect import expectations_in
from mirotwin.verify.expectations import as_settings, in_files
from mirotwin.verify.steps.reading import steps_in

COARSE = 8
"""Intervals into which the run up to the failure is first divided."""
MOST_POINTS = COARSE + 24
PAGE, FAILS, PASSES = "why.html", "fails.stream", "passes.stream"


class WhyOptions(CaseOptions, frozen=True, kw_only=True):
    COMMAND = "why"
    file: Annotated[str, Argument("RUN", NAME)]
    seed: Annotated[int | None, SEED.saying("Master seed of the run. Default 0, or the recorded one.")] = None
    settings: Annotated[tuple[str, ...], SET] = ()
    branches: Annotated[
        int, Option(type=Whole(8, 10_000), help="Branches at each moment, each with a seed of its own.")
    ] = 60
    jobs: Annotated[int | None, JOBS] = None
    engine: Engine = None
    out: Annotated[
        Path | None, OUT.saying("Folder for the page and two branches. Default: runs/RUN-SEED-why.")
    ] = None
    force: Annotated[bool, FORCE.saying("Replace these files in the folder.")] = False
    quiet: Annotated[bool, QUIET.saying("No progress bar and no table.")] = False


@command_of(WhyOptions)
def why(options: WhyOptions) -> int:
    """Finds the control period in which a run's failure became inevitable.

    RUN is a scenario with --seed, a recording or a case that fails a check (its own, or one of --expect) or a step. At
    several moments of the run the noise is replaced by the noise of other seeds, and the failed branches are counted;
    wheels and calibration stay the same. The search halves the interval in which their share passes one half, down to
    one control period. That period decided the failure; `mirotwin debug` opens at its begin.

    The folder gets a page with the curve, and a branch that fails and one that does not, as stream files.

    Exit code 0: done, with any result; 2: the run does not fail.
    """
    options.plugins.bring()
    spec = _spec(options)
    with plain_parameters(options.file), ProgressBar("the run", None, options.quiet):
        run = Run.traced(spec).play()
    name, tick = _failed(run, options)
    folder = OutputFolder(
        options.out or Path("runs") / f"{stem_of(options.file) or 'run'}-{spec.seed}-why",
        options.force,
        (PAGE, FAILS, PASSES),
        ours=options.out is None,
    )
    period = run.world.period_ticks
    end = min(-(-(tick + 1) // period), run.world.periods)
    seeds = [(spec.seed + 1 + number) % (MAX_SEED + 1) for number in range(options.branches)]
    at = partial(branched, spec, name, seeds=seeds, jobs=options.jobs or cores())
    with folder, ProgressBar("branches", MOST_POINTS, options.quiet, "points") as bar:
        looked: list[Point] = []

        def done(point: Point) -> None:
            looked.append(point)
            bar.to(len(looked))

        points, low = search(lambda index: at(index * period), end, min(COARSE, end), done)
        curve = Curve(
            run=f"{run.world.scenario.name}, seed {spec.seed}",
            what=name if name == STEP else f"{failure_of(run, name)}",
            clock=run.world.clock,
            period=period,
            points=points,
            low=low,
            others=at(FROM_START),
        )
        two = _two_branches(spec, name, curve, seeds)
        for stream, text in two.items():
            folder.part(stream).write_bytes(encodable(text).encode())
        place = place_at(run.as_sent({}), curve.jump_tick)
        c_line = f"{Path(place.file).name}:{place.line}" if place else ""  # the same bytes in any folder
        lines = _lines(options, curve, spec, [folder.path / stream for stream in two], c_line)
        folder.part(PAGE).write_bytes(page(curve, lines))
    if not options.quiet:
        show(_table(curve))
    for line in (*curve.lines(), *lines, f"{folder.path / PAGE} has the curve"):
        show_line(line)
    return DONE


def _spec(options: WhyOptions) -> RunSpec:
    file = file_in(options.file, (*RECORDINGS, *CASES))
    settings = (
        *options.plugins.settings(options.settings),
        *options.settings,
        *as_settings(options.expected),
    )
    if not Path(file).is_file() or file.endswith(".toml"):
        text = load_any(file, settings)
        tell_notes(text.notes)
        spec = RunSpec.of(text, image_for(text, options.firmware), options.seed or 0)
        return replace(spec, expected=expectations_in(text), steps=steps_in(text))
    job = load_job(file, options.firmware, settings, options.seed)
    tell_notes(job.notes)
    spec = replace(job.spec, until_tick=job.case.end_tick or None, origin=file)
    networks = getattr(spec.scenario, "networks", ())
    if not job.recorded or all(network.host != "controller" for network in networks):
        return spec
    # what a controller sends depends on the noise, too: it computes again, and has to come to what was recorded
    spec = replace(spec, computed=True)
    if not options.given("seed", "settings", "firmware"):
        again, last = Run(spec).play().periods, job.recorded[-1]
        if last.digest not in (period.digest for period in again):
            reason = "something was sent in it that its scenario does not say, so that no branch can be made"
            raise BadInput(file, "", reason, "give a scenario with its --seed")
    return spec


def _failed(run: Run, options: WhyOptions) -> tuple[str, int]:
    """Name and tick of the first failure. Raises BadInput if there is none."""
    failure, player = failure_of(run), run.player
    if player is not None and player.failure is not None:
        return STEP, player.failure.tick
    if failure is None:
        reason = f"does not fail with seed {run.spec.seed}"
        raise BadInput(
            options.file, "", reason, "give a run that fails, or what it has to keep with --expect"
        )
    return failure.check, failure.tick


def _two_branches(spec: RunSpec, name: str, curve: Curve, seeds: list[int]) -> dict[str, str]:
    """A branch that fails and one that does not, of the last moment at which there were both, as stream files."""
    before = [point for point in curve.points if point.tick <= curve.jump_tick]
    both = [point for point in before if 0 < point.count < len(seeds)] or curve.points
    streams: dict[str, str] = {}
    expect: dict[str, object] = {}
    for file, fails in ((FAILS, True), (PASSES, False)):
        point = next((each for each in reversed(both) if fails in each.failed), None)
        if point is None:
            continue
        run = Run.traced(branch(spec, point.tick, seeds[point.failed.index(fails)])).play()
        assert has_failed(run, name) == fails, "a branch is not what its copy was"
        failure = failure_of(run, name) if fails and name != STEP else None
        expect = expect if failure is None else expect_of_failure(run.checks, failure)
        streams[file] = run.stream(expect, f"{failure}" if failure else "")
    return streams


def _lines(options: WhyOptions, curve: Curve, spec: RunSpec, streams: list[Path], place: str) -> list[str]:
    """The commands that replay the branches and open the debugger at the jump."""
    checks, image = tuple(in_files(options.expected).values()), foreign_path(spec.image)
    lines = [replay_line(path, image, checks, options.plugins) for path in streams]
    same = {name: getattr(options, name) for name in ("file", "seed", "settings", "firmware", "plugins")}
    line = DebugLineOptions(**same, at=f"{curve.jump_tick}t").command_line()
    return [*lines, f"{line}  # {place}" if place else line]


def _table(curve: Curve) -> Table:
    table = plain_table(COLUMNS[0], right=COLUMNS[1:])
    for row in cells(curve):
        table.add_row(*row)
    return table
