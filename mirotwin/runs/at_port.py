"""Runs at a port: frames sent to robots and their answers are recorded, and compared with their twin's answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path

import msgspec
import tomli_w

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_protocol.table import TICKS_PER_MS
from miro_protocol.transmission import Transmission
from miro_robot.image import Image
from miro_sim.scenario.file import ScenarioText, changed, live_settings
from miro_sim.scenario.keys import Scenario
from miro_sim.world.machine import why_not
from mirotwin.desk.compare import ANSWERS, PortComparison, compare
from mirotwin.desk.guard import DeskOptions, Guard
from mirotwin.desk.robot_port import PORT, Note, RobotPort, port_for_test
from mirotwin.recording.compare import CompareRule
from mirotwin.recording.recorder import RunSource
from mirotwin.runs.job import Job, sent_in
from mirotwin.runs.result import Line, Result
from mirotwin.shell.outputs import RECORDING, OutputFolder, write_files
from mirotwin.shell.verdicts import judge
from mirotwin.verify.cases.artifacts import nothing_left
from mirotwin.verify.cases.case import tables_of
from mirotwin.verify.steps.keys import ConditionStep, Step
from mirotwin.verify.steps.player import Player

LATE_MS = 2.0
_TWIN = (
    "network.0.radio={bit_error_rate=0.0, carrier='on', squelch=true}",
    "camera={kind='gaussian'}",
    "expect={}",
    "step=[]",
)
"""Settings of the twin: an ideal radio, and a camera that no controller uses."""


def twin_source(scenario: Scenario, seed: int, image: Image) -> RunSource:
    """The sources of the twin of robots at a port."""
    twin = changed(scenario, scenario.name, [*live_settings(scenario), *_TWIN]).scenario
    return RunSource(
        scenario_name=twin.name,
        scenario_text=tomli_w.dumps(tables_of(twin)),
        seed=seed,
        firmware=image.content,
        firmware_sha256=image.sha256,
        symbols={name: (at.address, at.space) for name, at in image.symbols.names.items()},
        origin=PORT,
    )


def sendable(job: Job, desk: DeskOptions, note: Note) -> list[Transmission]:
    """All transmissions of the job's hosts. Raises BadInput if a port cannot send them, or the guard refuses them."""
    file = job.spec.origin
    sent, guard = sent_in(job.spec.script or ()), Guard(desk, file)
    if not sent:
        raise BadInput(file, "", "no line from host to robot", "nothing can be sent")
    for transmission in sent:
        if transmission.network:
            reason = f"speaks to network {transmission.network}, too; a port is the radio of one"
            raise BadInput(file, f"tick {transmission.tick}", reason, "split the stream")
        if transmission.bad_stop:
            reason = "has a character with a bad stop bit, which no serial port sends"
            raise BadInput(file, f"tick {transmission.tick}", reason, "leave the line out")
        guard.check(transmission.data, f"tick {transmission.tick}")
    if count := len(job.spec.script or ()) - len(sent):
        actions = amount(count, "action on robots and radios is", "actions on robots and radios are")
        note(f"{file}: {actions} not observable on a port, and left out")
    return sent


def send(
    sent: Sequence[Transmission],
    job: Job,
    desk: DeskOptions,
    folder: OutputFolder,
    note: Note,
    progress: Callable[[int], object],
) -> None:
    """Sends these to the robots at the port, and records that into the folder. Raises BadInput.

    `progress` gets the number of ticks that are over.
    """
    spec = job.spec
    with (
        folder,
        folder.part(RECORDING).open("wb") as stream,
        RobotPort(desk, spec.robot_scenario, spec.origin, note) as port,
    ):
        port.record(stream, twin_source(spec.robot_scenario, spec.seed, spec.image))
        port.greet(sent=sent)
        folder.keep = (RECORDING,)  # of a talk that was broken off
        shortest, longest = min(port.delays) / TICKS_PER_MS, max(port.delays) / TICKS_PER_MS
        slots = f"{', '.join(map(str, port.slots))} of {port.networks[0].spec.robots}"
        note(f"{port.url}: robot {slots} answers, {shortest:.1f} to {longest:.1f} ms after a question")
        later = CONTROL_PERIOD_TICKS - sent[0].tick
        when = f"{seconds(port.began_tick + later):.3f} s later than in the file"
        note(f"all times are {when}, which begins after the greeting")
        due = [msgspec.structs.replace(transmission, tick=transmission.tick + later) for transmission in sent]
        port.play(due, lambda tick: progress(tick - due[0].tick))
    late = [ticks / TICKS_PER_MS for ticks in sorted(port.late_ticks)]
    of_99, hint = late[len(late) * 99 // 100], ""
    if of_99 > LATE_MS and not port.prompt:
        hint = "; this process may not ask for real-time priority, which would help"
    lateness = f"99 % less than {of_99:.2f} ms late, all less than {late[-1]:.2f} ms"
    note(f"{amount(len(sent), 'transmission')} sent, {lateness}{hint}")


def beside_twin(
    job: Job, rule: CompareRule = ANSWERS, progress: Callable[[int], object] = lambda tick: None
) -> PortComparison:
    """Runs the twin with the characters sent at the port; compares the recorded answers with the twin's."""
    again = job.run(len(job.recorded) * CONTROL_PERIOD_TICKS, progress)
    return compare(job.recorded, again.periods, job.spec.robot_scenario.networks[0].robots, rule)


def play_at_port(
    text: ScenarioText, steps: Sequence[Step], image: Image, desk: DeskOptions, folder: Path | None
) -> Result:
    """Runs a scenario file as a test of a robot at a port: the steps that a PC can execute and observe, in order.

    A step that waits for something inside the robot is skipped. A step that switches or disturbs the robot ends the
    test, because the following steps depend on it. Neither counts as passed; both are counted as not observable.
    `folder`: for the recording. Raises NotObservable.
    """
    path, recording, notes, written = text.origin, BytesIO(), list[str](), False
    with port_for_test(desk, text.scenario, path, notes.append) as port:
        port.record(recording, twin_source(text.scenario, 0, image))
        player = Player(port, steps, path)
        player.play()
        tick = port.tick
    expected = [why_not(port, f"expectation {name}", "inside") for name in text.scenario.expect]
    reported: list[Line] = []
    if player.failure is not None:
        reported.append(("failed", f"step failed: {player.failure}"))
    judged = any(isinstance(step, ConditionStep) for step in player.steps[: player.done])
    parts = [*(verdict for verdict, _ in reported), "passed" if judged else "not observable"]
    if folder is not None:
        try:
            write_files(folder, {RECORDING: recording.getvalue()}, "choose another folder")
            written = player.failure is not None
        except (OSError, BadInput) as error:
            notes.append(nothing_left(folder, error))
    return Result(
        path=path,
        verdict=judge(parts),
        verdict_lines=[
            *reported,
            *(("not observable", line) for line in (*player.unseen, *expected, *notes)),
        ],
        done=player.done,
        steps=player.count,
        tick=tick,
        folder=str(folder) if written else "",
        left_out=text.notes,
        unseen=player.count - len(player.steps) + len(expected),
    )
