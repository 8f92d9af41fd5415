"""One run of a campaign in this process, from a job to its figures.

A process keeps images, and scenarios with their settings, so that a run costs little more than its loop.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from time import perf_counter

from miro_exact.bad_input import BadInput
from miro_sim.periods import Period, RobotId
from miro_sim.scenario.file import ScenarioText, of_text
from miro_sim.world.world import World
from mirotwin.campaign.columns import figures_of
from mirotwin.campaign.worker import RunOutcome, Work
from mirotwin.recording import runner
from mirotwin.recording.recorder import Recorder, source_of
from mirotwin.recording.track import Tracks
from mirotwin.report.summary import summarise
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.program import show_traceback
from mirotwin.shell.verdicts import judge
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.checks.interface import Check
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.expectations import expectation_lines, verdict_of_run
from mirotwin.verify.steps.keys import Step
from mirotwin.verify.steps.player import Player, player_of
from mirotwin.verify.steps.reading import steps_of


@lru_cache(maxsize=64)
def prepared(
    origin: str, text: str, settings: tuple[str, ...]
) -> tuple[ScenarioText, dict[RobotId, list[Check]], list[Step]]:
    """A scenario with its settings made, what it expects, and its steps. Raises BadInput for one that cannot be run."""
    found = of_text(text, origin, settings)
    return found, expectations_of(found.scenario, origin), steps_of(found.scenario, origin)


def run_single(job: Work) -> RunOutcome:
    """Runs it to the end; whatever goes wrong becomes the outcome's error."""
    try:
        return _run(job)
    except BadInput as error:
        show_traceback(error)
        return RunOutcome(job.run, error=f"{error}")
    except ValueError as error:  # numbers with which nothing can be computed, a part that fails
        return RunOutcome(job.run, error=f"cannot be run: {error}")
    except OSError as error:  # no room for its recording
        return RunOutcome(job.run, error=error.strerror or f"{error}")
    except Exception as error:  # a fault of this program costs one run, too
        return RunOutcome(job.run, error=f"internal error: {type(error).__name__}: {error}")


def _run(job: Work) -> RunOutcome:
    image = load_firmware(job.firmware.path)
    text, expected, steps = prepared(job.origin, job.text, job.settings)
    scenario = text.scenario
    world = World(scenario, job.seed, image)
    checks = Checks(world, expected)
    player = player_of(world, steps, job.origin)
    tracks = Tracks(delay_frames=scenario.camera.delay_frames)
    began_s = perf_counter()
    with ExitStack() as files:
        recorder = None
        if job.recording:
            stream = files.enter_context(Path(job.recording).open("wb"))
            recorder = files.enter_context(Recorder(stream, source_of(text, world)))
        _move(world, player, tracks, recorder)
    wall_s = perf_counter() - began_s
    checks.finish()
    summary = summarise(world, tracks, wall_s)
    judges = (checks, *(player.checks if player else ()))
    failures = [one for group in judges for one in group.failures]
    lines = [
        line for group in judges for verdict, line in expectation_lines(group) if verdict == "not judged"
    ]
    failure = f"{min(failures, key=lambda one: one.tick)}" if failures else "; ".join(lines)
    if player is not None and player.failure is not None:
        failure = f"step: {player.failure}"
    return RunOutcome(
        run=job.run,
        verdict=verdict_of_run(checks, player),
        failure=failure,
        digest=tracks.digest,
        figures=figures_of(summary, tracks),
        checks=_verdicts(judges),
        wall_s=wall_s,
    )


def _move(world: World, player: Player | None, tracks: Tracks, recorder: Recorder | None) -> None:
    def keep(period: Period) -> None:
        tracks.add(period)
        if recorder is not None:
            recorder.write_theories(tracks.theories())

    runner.run(world, recorder, on_period=keep, move=None if player is None else player.run)


def _verdicts(judges: Iterable[Checks]) -> dict[str, str]:
    """Those of the run, and of checks that steps began; a name that is there twice has its judge verdict."""
    found: dict[str, str] = {}
    for one in (one for group in judges for one in group.verdicts()):
        found[one.name] = judge([found.get(one.name, one.verdict), one.verdict])
    return found
