"""A scenario file as a test of a robot at a port: the steps that a PC can do and see, one after the other.

A step that waits for something inside the robot is passed over. One that switches or disturbs the robot cannot be left
out without changing what follows: the test ends there. Neither passes; they are counted as not observable.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, cast

from miro_exact.bad_input import BadInput
from miro_robot.image import Image
from miro_sim.scenario.file import load
from mirotwin.desk.guard import DeskOptions
from mirotwin.desk.robot_port import SEEN, NotObservable, RobotPort, check_observable
from mirotwin.recording.recorder import Recorder, RunSource
from mirotwin.replay.replay_port import twin_source
from mirotwin.shell.outputs import RECORDING, whole_file
from mirotwin.verify.cases.artifacts import nothing_left
from mirotwin.verify.steps.keys import CheckStep, ConditionStep, PauseStep, SaveStep, Send, Step, StreamStep
from mirotwin.verify.steps.player import Player
from mirotwin.verify.steps.reading import everything, steps_of
from mirotwin.verify.steps.running import Outcome, outcome_of

if TYPE_CHECKING:
    from miro_sim.world.world import World

NOTED = "not observable on a port"
_PASSED_OVER = (ConditionStep, CheckStep, SaveStep)


def unseen(step: Step) -> str:
    """Why a PC cannot do or see a step, "" if it can."""
    if isinstance(step, Send):
        bad = getattr(step, "bad_stop", ()) or "!" in getattr(step, "hex", "")
        return "no serial port sends a bad stop bit" if bad else ""
    if isinstance(step, StreamStep | PauseStep):
        return ""
    if isinstance(step, SaveStep):
        return "only a twin can be saved"
    if isinstance(step, _PASSED_OVER):
        return "" if isinstance(getattr(step, "condition", None), SEEN) else "it is inside the robot"
    return "only a twin has such a switch"


def run_port_test(
    path: str, image: Image, desk: DeskOptions, settings: Sequence[str], artifacts: Path | None
) -> Outcome:
    """Plays a file's steps at the port. `artifacts`: below it the recording is left. Whatever happens is an outcome."""
    try:
        return outcome_of(path, artifacts, lambda folder: _run(path, image, desk, settings, folder))
    except NotObservable as error:
        return Outcome(path, "not observable", notes=(f"{error}",))


def _run(path: str, image: Image, desk: DeskOptions, settings: Sequence[str], folder: Path | None) -> Outcome:
    text = load(path, settings, everything)
    check_observable(text.scenario)
    steps = steps_of(text.scenario, path)
    notes = [f"{step}: {NOTED}: {why}" for step in steps if (why := unseen(step))]
    notes += [f"expectation {name}: {NOTED}" for name in text.scenario.expect]
    before_switch = takewhile(lambda step: isinstance(step, _PASSED_OVER) or not unseen(step), steps)
    playable = [step for step in before_switch if not unseen(step)]
    with ExitStack() as files:
        with RobotPort(desk, text.scenario, path) as port:
            port.greet()
            if folder is not None:
                try:
                    port.recorder = files.enter_context(
                        _recorder(folder, twin_source(text.scenario, 0, image))
                    )
                except (OSError, BadInput) as error:
                    notes.append(nothing_left(folder, error))
                    folder = None
            player = Player(cast("World", port), playable, path)  # which asks of it what a PC can see
            player.play()
            tick = port.tick
        try:
            files.close()
        except (OSError, BadInput) as error:
            notes.append(nothing_left(folder or Path(), error))
            folder = None
    lines = () if player.failure is None else (f"step failed: {player.failure}",)
    judged = any(isinstance(step, ConditionStep) for step in player.steps[: player.done])
    return Outcome(
        path=path,
        verdict="failed" if lines else "passed" if judged else "not observable",
        lines=lines,
        notes=tuple(notes),
        done=player.done,
        steps=len(steps),
        tick=tick,
        left=str(folder) if folder is not None and lines else "",
        left_out=text.notes,
        unseen=len(steps) - len(playable) + len(text.scenario.expect),
    )


@contextmanager
def _recorder(folder: Path, source: RunSource) -> Iterator[Recorder]:
    """The recording below a folder of artifacts, whole or not there. Raises OSError, OutputError."""
    folder.mkdir(parents=True, exist_ok=True)
    with (
        whole_file(folder / RECORDING, "--artifacts") as part,
        part.open("wb") as stream,
        Recorder(stream, source) as recorder,
    ):
        yield recorder
