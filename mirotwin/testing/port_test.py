"""A scenario file as a test of a robot at a port: the steps that a PC can do and see, one after the other.

A step that waits for something inside the robot is passed over. One that switches or disturbs the robot cannot be left
out without changing what follows: the test ends there. Neither passes; they are counted as not observable.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, cast

from miro_exact.bad_input import BadInput
from miro_robot.image import Image
from miro_sim.scenario.keys import Scenario
from mirotwin.desk.options import DeskOptions
from mirotwin.desk.port_world import SEEN, NotObservable, PortWorld
from mirotwin.desk.recorded import PortRecording
from mirotwin.desk.robot_port import RobotPort
from mirotwin.recording.recorder import Recorder
from mirotwin.replay.replay_port import twin_source
from mirotwin.shell.outputs import RECORDING, whole_file
from mirotwin.verify.steps.keys import (
    CheckStep,
    HoldStep,
    NeverStep,
    PauseStep,
    SaveStep,
    SendStep,
    Step,
    StreamStep,
    WaitStep,
)
from mirotwin.verify.steps.player import Player
from mirotwin.verify.steps.reading import steps_of
from mirotwin.verify.steps.running import Outcome, folder_of, load_test

if TYPE_CHECKING:
    from miro_sim.world.world import World

NOTED = "not observable on a port"
_CAN_FAIL = (WaitStep, NeverStep)


def unseen(step: Step) -> str:
    """Why a PC cannot do or see a step, "" if it can."""
    if isinstance(step, SendStep):
        bad = getattr(step.what, "bad_stop", ()) or "!" in getattr(step.what, "hex", "")
        return "no serial port sends a bad stop bit" if bad else ""
    if isinstance(step, WaitStep | NeverStep):
        return "" if isinstance(step.condition, SEEN) else "it is inside the robot"
    if isinstance(step, StreamStep | PauseStep):
        return ""
    if isinstance(step, HoldStep | CheckStep):
        return "it is inside the robot"
    return "only a twin can be saved" if isinstance(step, SaveStep) else "only a twin has such a switch"


def run_port_test(
    path: str, image: Image, desk: DeskOptions, url: str, settings: Sequence[str], artifacts: Path | None
) -> Outcome:
    """Plays a file's steps at the port. `artifacts`: below it the recording is left. Whatever happens is an outcome."""
    folder = None if artifacts is None else folder_of(artifacts, path)
    try:
        return _run(path, image, desk, url, settings, folder)
    except NotObservable as error:
        return Outcome(path, "not observable", notes=(f"{error}",))
    except BadInput as error:
        return Outcome(path, "error", (f"{error}",))


def _run(
    path: str, image: Image, desk: DeskOptions, url: str, settings: Sequence[str], folder: Path | None
) -> Outcome:
    text = load_test(path, settings)
    scenario = text.scenario
    _check(scenario, path)
    steps = steps_of(scenario, path)
    notes = [f"{step}: {NOTED}: {why}" for step in steps if (why := unseen(step))]
    notes += [f"expectation {name}: {NOTED}" for name in scenario.expect]
    playable = list(_playable(steps))
    with ExitStack() as stack:
        port = stack.enter_context(RobotPort(url, desk.limits, path))
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            source = twin_source(scenario, 0, image, scenario.duration_s)
            part = stack.enter_context(whole_file(folder / RECORDING, "--artifacts"))
            recorder = stack.enter_context(Recorder(stack.enter_context(part.open("wb")), source))
            stack.callback(PortRecording(port, recorder).finish)
        world = PortWorld(port, scenario)
        player = Player(cast("World", world), playable, path)  # which asks of it what a PC can see
        player.play()
        tick = world.tick
    lines = () if player.failure is None else (f"step failed: {player.failure}",)
    judged = any(isinstance(step, _CAN_FAIL) for step in player.steps[: player.done])
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
        unseen=len(steps) - len(playable) + len(scenario.expect),
    )


def _check(scenario: Scenario, path: str) -> None:
    if len(scenario.networks) > 1:
        raise NotObservable(f"{path}: {len(scenario.networks)} networks, of which a port is one")
    if scenario.networks[0].host != "silent":
        raise NotObservable(f"{path}: a controller, which needs a camera")


def _playable(steps: Sequence[Step]) -> Iterator[Step]:
    """Those that can be done, up to the first without which the rest means something else."""
    for step in steps:
        if not unseen(step):
            yield step
        elif not isinstance(step, WaitStep | NeverStep | HoldStep | CheckStep | SaveStep):
            return
