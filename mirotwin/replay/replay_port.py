"""`mirotwin replay --port`: what was sent, sent to a robot, whose answers are then held beside those of its twin."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import msgspec
import tomli_w

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.table import TICKS_PER_MS
from miro_protocol.transmission import Transmission
from miro_robot.image import Image
from miro_sim.radio.params import Radio
from miro_sim.scenario.file import load
from miro_sim.scenario.keys import Scenario
from mirotwin.desk.compare import AnswerTolerance, PortComparison, compare
from mirotwin.desk.guard import Guard
from mirotwin.desk.options import DeskOptions
from mirotwin.desk.recorded import PORT, PortRecording
from mirotwin.desk.robot_port import RobotPort
from mirotwin.desk.session import greet, play
from mirotwin.recording.recorder import Recorder, RunSource
from mirotwin.replay.differences import differences_as_json, print_differences, print_json
from mirotwin.rerun.job import Job, rerun_job
from mirotwin.rerun.script import DEFAULT_SCENARIO, sent_in
from mirotwin.shell.console import show
from mirotwin.shell.outputs import RECORDING, OutputFolder
from mirotwin.shell.program import DIVERGENCE, DONE, complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.verify.cases.case import tables_of

WORDS = ("robot", "twin")
SPARE_S = 60.0
"""A talk may take so much longer than planned: its scenario has to last as long."""


def record_at_port(
    job: Job, image: Image, file: str, desk: DeskOptions, url: str, out: Path | None, force: bool, quiet: bool
) -> Path:
    """Sends all that the job's hosts send to the robots at the port; the recording of it. Raises BadInput."""
    sent = _sendable(job, file, desk)
    robots = job.scenario.networks[0].robots
    folder = OutputFolder(out or _default(file), force, (RECORDING,), ours=out is None)
    recorded = job.firmware if image is job.image else b""
    source = twin_source(job.scenario, job.seed, image, seconds(sent[-1].end_tick), recorded)
    with ExitStack() as files:
        files.enter_context(folder)
        folder.keep = (RECORDING,)
        stream = files.enter_context(folder.part(RECORDING).open("wb", buffering=0))
        recorder = files.enter_context(Recorder(stream, source))
        with RobotPort(url, desk.limits, file) as port:
            recording = PortRecording(port, recorder)
            try:
                _talk(port, recording, sent, robots, quiet)
            finally:
                recording.finish()
        _tell(port, sent)
    return folder.path / RECORDING


def _talk(
    port: RobotPort, recording: PortRecording, sent: Sequence[Transmission], robots: int, quiet: bool
) -> None:
    greeting = greet(port, robots, _first_seq(sent, robots))
    shortest, longest = (ticks / TICKS_PER_MS for ticks in greeting.delay_ticks)
    slots = ", ".join(map(str, greeting.slots))
    complain(
        f"{port.url}: robot {slots} of {robots} answers, {shortest:.1f} to {longest:.1f} ms after a question"
    )
    offset = -(-port.tick // CONTROL_PERIOD_TICKS) * CONTROL_PERIOD_TICKS + CONTROL_PERIOD_TICKS
    offset = max(offset - sent[0].tick, 0)
    complain(f"all times are {seconds(offset):.3f} s later than in the file, which begins after the greeting")
    with ProgressBar("sending", sent[-1].end_tick, quiet) as bar:

        def went(one: Transmission) -> None:
            recording.keep()
            bar.to(one.end_tick)

        play(port, sent, offset, went)


def _sendable(job: Job, file: str, desk: DeskOptions) -> list[Transmission]:
    """What is to be sent. Raises BadInput for what no port can send, or the guard does not allow."""
    sent = sent_in(job.script)
    if not sent:
        raise BadInput(file, "", "no line from host to robot", "nothing can be sent")
    for one in sent:
        if one.network:
            what = f"speaks to network {one.network}, too; a port is the radio of one"
            raise BadInput(file, f"tick {one.tick}", what, "split the stream")
        if one.bad_stop:
            what = "has a character with a bad stop bit, which no serial port sends"
            raise BadInput(file, f"tick {one.tick}", what, "leave the line out")
    if len(sent) < len(job.script):
        count = len(job.script) - len(sent)
        complain(f"{file}: {count} actions on robots and radios are not observable on a port, and left out")
    guard = Guard(desk.limits, file)
    for one in sent:
        guard.check(one.data, f"tick {one.tick}")
    return sent


def _first_seq(sent: Sequence[Transmission], robots: int) -> int:
    """The number of the first frame."""
    decoder = Decoder(robots)
    return next(
        (event.seq for one in sent for event in decoder.feed(one.data) if isinstance(event, Received)), 0
    )


def _default(file: str) -> Path:
    name = Path(file).name
    stem = Path(file).absolute().parent.name if name.startswith("run.") else name.partition(".")[0]
    return Path("runs") / f"{stem or 'stream'}-port"


def twin_source(
    scenario: Scenario, seed: int, image: Image, duration_s: float, firmware: bytes = b""
) -> RunSource:
    """What the twin of robots at a port is made from; `firmware`: the file of an image that is not on the disk."""
    twin = _twin(scenario, duration_s + SPARE_S)
    return RunSource(
        scenario_name=twin.name,
        scenario_text=tomli_w.dumps(tables_of(twin)),
        seed=seed,
        firmware=firmware or image.path.read_bytes(),
        firmware_sha256=image.sha256,
        symbols={name: (at.address, at.space) for name, at in image.symbols.names.items()},
        origin=PORT,
    )


def _twin(scenario: Scenario, duration_s: float) -> Scenario:
    """The scenario with an ideal radio and a silent host; nobody steers by a camera, and references stand."""
    network = scenario.networks[0]
    robots = []
    for robot in network.robot:
        reference = robot.reference
        if isinstance(reference, msgspec.Struct) and hasattr(reference, "drive_s"):
            reference = msgspec.structs.replace(reference, drive_s=0.0)
        robots.append(msgspec.structs.replace(robot, reference=reference))
    network = msgspec.structs.replace(
        network,
        host="silent",
        radio=Radio(bit_error_rate=0.0, carrier="on", squelch=True),
        robot=tuple(robots),
    )
    camera = load(DEFAULT_SCENARIO, ["camera={kind = 'gaussian'}", "expect={}"]).scenario.camera
    return msgspec.structs.replace(
        scenario, duration_s=duration_s, networks=(network,), camera=camera, expect={}, step=()
    )


def _tell(port: RobotPort, sent: Sequence[Transmission]) -> None:
    """How well the schedule was kept."""
    late = sorted(port.late_ticks) or [0]
    most = late[-1] / TICKS_PER_MS
    of_99 = late[min(len(late) - 1, len(late) * 99 // 100)] / TICKS_PER_MS
    complain(
        f"{len(sent)} transmissions sent, 99 % less than {of_99:.2f} ms late, all less than {most:.2f} ms;"
        f" {len(port.answers)} answers"
    )


def compare_with_twin(
    job: Job,
    image: Image,
    file: str,
    tolerance: AnswerTolerance,
    everything: bool,
    quiet: bool,
    as_json: bool,
) -> int:
    """Runs the twin with what was sent at the port, and compares its answers; the exit code."""
    comparison = compared(job, image, file, tolerance, quiet or as_json)
    found = comparison.differences
    code = DIVERGENCE if found else DONE
    if as_json:
        document = {"file": file, "seed": job.seed, "source": PORT, "silent": comparison.silent}
        result = differences_as_json(found, everything, WORDS)
        print_json(document | {"not_judged": comparison.not_judged, **result, "exit_code": code})
    elif found and not quiet:
        print_differences(found, everything, WORDS)
    for slot in comparison.silent:
        complain(f"robot {slot} of the twin is not at the port: not compared")
    if comparison.not_judged:
        complain(f"{comparison.not_judged} values are not judged: they depend on times too near to a limit")
    if found:
        complain(
            f"the robot differs from its twin in control period {found[0].period}, {found[0].said(WORDS)}"
        )
    elif not as_json:
        count = sum(len(one.pairs) for one in comparison.robots)
        unsure_ms = max((one.unsure_ticks for one in comparison.robots), default=0) / TICKS_PER_MS
        show(f"the robot answers as its twin does, {count} times; times are known to {unsure_ms:.1f} ms")
    return code


def compared(job: Job, image: Image, file: str, tolerance: AnswerTolerance, quiet: bool) -> PortComparison:
    """The recorded answers beside those of the twin."""
    end_tick = len(job.recorded) * CONTROL_PERIOD_TICKS
    with ProgressBar("running the twin", end_tick, quiet) as bar:
        again = rerun_job(job, image, file, end_tick, bar.to)
    return compare(job.recorded, again.periods, job.scenario.networks[0].robots, tolerance)
