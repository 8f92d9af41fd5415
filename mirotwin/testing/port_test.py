"""A scenario file as a test of a robot at a port: the steps that a PC can do and see, one after the other.

A step that waits for something inside the robot is passed over. One that switches or disturbs the robot cannot be left
out without changing what follows: the test ends there. Neither passes; they are counted as not observable.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from miro_exact.bad_input import BadInput
from miro_robot.image import Image
from miro_sim.scenario.file import load
from miro_sim.world.machine import NotObservable, why_not
from mirotwin.desk.guard import DeskOptions
from mirotwin.desk.robot_port import port_for_test
from mirotwin.replay.replay_port import twin_source
from mirotwin.runs.result import Line, Result
from mirotwin.runs.test_file import result_of
from mirotwin.shell.outputs import RECORDING, write_files
from mirotwin.shell.verdicts import judge
from mirotwin.verify.cases.artifacts import nothing_left
from mirotwin.verify.steps.keys import ConditionStep
from mirotwin.verify.steps.player import Player
from mirotwin.verify.steps.reading import everything, steps_of


def run_port_test(
    path: str, image: Image, desk: DeskOptions, settings: Sequence[str], artifacts: Path | None
) -> Result:
    """Plays a file's steps at the port. `artifacts`: below it the recording is left. Whatever happens is a result."""
    try:
        return result_of(path, artifacts, lambda folder: _run(path, image, desk, settings, folder))
    except NotObservable as error:
        return Result(path=path, verdict="not observable", said=[("not observable", f"{error}")])


def _run(path: str, image: Image, desk: DeskOptions, settings: Sequence[str], folder: Path | None) -> Result:
    text = load(path, settings, everything)
    recording, notes, left = BytesIO(), list[str](), False
    with port_for_test(desk, text.scenario, path, notes.append) as port:
        port.record(recording, twin_source(text.scenario, 0, image))
        player = Player(port, steps_of(text.scenario, path), path)
        player.play()
        tick = port.tick
    expected = [why_not(port, f"expectation {name}", "inside") for name in text.scenario.expect]
    notes = [*player.unseen, *expected, *notes]
    said: list[Line] = []
    if player.failure is not None:
        said.append(("failed", f"step failed: {player.failure}"))
    judged = any(isinstance(step, ConditionStep) for step in player.steps[: player.done])
    parts = [*(verdict for verdict, _ in said), "passed" if judged else "not observable"]
    if folder is not None:
        try:
            write_files(folder, {RECORDING: recording.getvalue()}, "choose another folder")
            left = player.failure is not None
        except (OSError, BadInput) as error:
            notes.append(nothing_left(folder, error))
    return Result(
        path=path,
        verdict=judge(parts),
        said=[*said, *(("not observable", note) for note in notes)],
        done=player.done,
        steps=player.count,
        tick=tick,
        left=str(folder) if left else "",
        left_out=text.notes,
        unseen=player.count - len(player.steps) + len(expected),
    )
