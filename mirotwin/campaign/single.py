"""One run of a campaign in this process, from a job to its figures.

A process keeps images, and scenarios with their settings, so that a run costs little more than its loop.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from time import perf_counter

import msgspec
from msgspec.structs import replace

from miro_exact import installed
from miro_exact.bad_input import BadInput
from miro_robot.image import SPACE_BYTES, Image, parse_hex
from miro_sim.periods import Period, RobotId
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import AnyText, any_of_text
from mirotwin.campaign.columns import figures_of, step_column
from mirotwin.campaign.worker import ImageCopy, RunOutcome, Work
from mirotwin.recording.recorder import source_of
from mirotwin.recording.track import Tracks
from mirotwin.runs.board_summary import SerialCounts, summarise_board
from mirotwin.runs.result import Result
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.runs.summary import summarise
from mirotwin.shell.program import traceback_text
from mirotwin.shell.verdicts import judge
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.interface import Check, Expectation
from mirotwin.verify.steps.keys import Step, WaitStep
from mirotwin.verify.steps.reading import steps_of

Prepared = tuple[AnyText, dict[RobotId, list[Check]], list[Step]]


def prepared(origin: str, text: str, settings: tuple[str, ...]) -> Prepared:
    """A scenario with its settings applied, its checks, and its steps. Raises BadInput if it cannot be run."""
    return _prepared(origin, text, settings, tuple(installed.in_files.items()))


@lru_cache(maxsize=64)
def _prepared(origin: str, text: str, settings: tuple[str, ...], _brought: object) -> Prepared:
    """`_brought`: plug-in files, part of the cache key: with other plug-ins the same text is another scenario."""
    spec = any_of_text(text, origin, settings)
    return spec, expectations_of(spec.scenario, origin), steps_of(spec.scenario, origin)


@lru_cache(maxsize=64)
def image_of(firmware: ImageCopy) -> Image:
    """The image with its names, as where the plan was made."""
    names = msgspec.json.decode(firmware.names, type=dict[str, tuple[int, str]])
    return parse_hex(firmware.content, Path(firmware.path), SPACE_BYTES, names)


def run_single(job: Work) -> RunOutcome:
    """Runs a job to its end; any exception becomes the outcome's error."""
    try:
        return _run(job)
    except BadInput as error:
        return RunOutcome(job.run, error=f"{error}", traceback=traceback_text(error))
    except ValueError as error:  # numbers with which nothing can be computed, a part that fails
        return RunOutcome(job.run, error=f"cannot be run: {error}")
    except OSError as error:  # no room for its recording
        return RunOutcome(job.run, error=error.strerror or f"{error}")
    except Exception as error:  # a fault of this program costs one run, too
        return RunOutcome(job.run, error=f"internal error: {type(error).__name__}: {error}")


def _run(job: Work) -> RunOutcome:
    image = image_of(job.firmware)
    text, expected, steps = prepared(job.origin, job.text, job.settings)
    spec = replace(RunSpec.of(text, image, job.seed), expected=expected, steps=steps)
    run, serial, scenario = Run(spec), SerialCounts(), text.scenario
    tracks = Tracks(
        delay_frames=None if isinstance(scenario, BoardScenario) else scenario.camera.delay_frames
    )

    def keep(period: Period) -> None:
        tracks.add(period)
        serial.add(period)

    began_s = perf_counter()
    if job.recording:
        with Path(job.recording).open("wb") as stream:
            run.record(stream, source_of(text, run.world), tracks, on_period=serial.add)
    else:
        run.drive(on_period=keep)
    wall_s = perf_counter() - began_s
    run.finish()
    result = run.result()
    if isinstance(scenario, BoardScenario):
        summary = summarise_board(run.world, serial, wall_s)
        figures = figures_of(summary, tracks, job.values) | step_times(run)
    else:
        figures = figures_of(summarise(run.world, tracks, wall_s), tracks)
    return RunOutcome(
        run=job.run,
        verdict=result.verdict,
        failure=_failure(run, result),
        digest=tracks.digest,
        figures=figures,
        checks=_verdicts(result.expectations),
        wall_s=wall_s,
    )


def step_times(run: Run) -> dict[str, float]:
    """Column -> duration of each wait that was fulfilled."""
    player = run.player
    took = zip(player.steps, player.took_ticks, strict=False) if player else ()
    return {
        step_column(step.number): 1000.0 * ticks / run.world.clock
        for step, ticks in took
        if isinstance(step, WaitStep)
    }


def _failure(run: Run, result: Result) -> str:
    """The failed step or first failed check, else the check that was not judged."""
    if run.player is not None and run.player.failure is not None:
        return f"step: {run.player.failure}"
    if result.failures:
        return f"{min(result.failures, key=lambda failure: failure.tick)}"
    return "; ".join(text for verdict, text in result.verdict_lines if verdict == "not judged")


def _verdicts(expectations: Iterable[Expectation]) -> dict[str, str]:
    """Verdicts of the run and of checks that steps began; a name that is there twice has its worst verdict."""
    verdicts: dict[str, str] = {}
    for expectation in expectations:
        verdicts[expectation.name] = judge(
            [verdicts.get(expectation.name, expectation.verdict), expectation.verdict]
        )
    return verdicts
