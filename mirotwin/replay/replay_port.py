"""`mirotwin replay --port`: what was sent, sent to a robot, whose answers are then held beside those of its twin."""

from __future__ import annotations

from pathlib import Path

import msgspec
import tomli_w

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_protocol.table import TICKS_PER_MS
from miro_protocol.transmission import Transmission
from miro_robot.image import Image
from miro_sim.scenario.file import changed, live_settings
from miro_sim.scenario.keys import Scenario
from mirotwin.desk.guard import DeskOptions, Guard
from mirotwin.desk.robot_port import PORT, RobotPort
from mirotwin.recording.compare import CompareRule
from mirotwin.recording.recorder import RunSource
from mirotwin.replay.difference import RunDifference
from mirotwin.replay.text import difference_tables
from mirotwin.report.page.port_page import beside_twin
from mirotwin.runs.job import Job, sent_in
from mirotwin.shell.console import show
from mirotwin.shell.json_text import print_json
from mirotwin.shell.outputs import RECORDING, OutputFolder
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import exit_code
from mirotwin.verify.cases.case import tables_of

WORDS = ("robot", "twin")
LATE_MS = 2.0
_TWIN = (
    "network.0.radio={bit_error_rate=0.0, carrier='on', squelch=true}",
    "camera={kind='gaussian'}",
    "expect={}",
    "step=[]",
)
"""Settings of the twin: an ideal radio, and a camera that no controller uses."""


def record_at_port(job: Job, desk: DeskOptions, out: Path | None, force: bool, quiet: bool) -> Path:
    """Sends all that the job's hosts send to the robots at the port; the recording of it. Raises BadInput."""
    sent = _sendable(job, desk)
    folder = OutputFolder(out or _default(job.spec.origin), force, (RECORDING,), ours=out is None)
    firmware = job.source.firmware if job.source and job.spec.image is job.image else b""
    source = twin_source(job.spec.scenario, job.spec.seed, job.spec.image, firmware)
    robots = job.spec.scenario.networks[0].robots
    with (
        folder,
        folder.part(RECORDING).open("wb") as stream,
        RobotPort(desk, job.spec.scenario, job.spec.origin, complain) as port,
    ):
        port.record(stream, source)
        port.greet(sent=sent)
        folder.keep = (RECORDING,)  # of a talk that was broken off
        shortest, longest = min(port.delays) / TICKS_PER_MS, max(port.delays) / TICKS_PER_MS
        slots = f"{', '.join(map(str, port.slots))} of {robots}"
        complain(f"{port.url}: robot {slots} answers, {shortest:.1f} to {longest:.1f} ms after a question")
        later = CONTROL_PERIOD_TICKS - sent[0].tick
        when = f"{seconds(port.began_tick + later):.3f} s later than in the file"
        complain(f"all times are {when}, which begins after the greeting")
        due = [msgspec.structs.replace(one, tick=one.tick + later) for one in sent]
        with ProgressBar("sending", due[-1].end_tick, quiet) as bar:
            port.play(due, bar.to)
    late = [ticks / TICKS_PER_MS for ticks in sorted(port.late_ticks)]
    of_99, hint = late[len(late) * 99 // 100], ""
    if of_99 > LATE_MS and not port.prompt:
        hint = "; this process may not ask for real-time priority, which would help"
    told = f"99 % less than {of_99:.2f} ms late, all less than {late[-1]:.2f} ms"
    complain(f"{amount(len(sent), 'transmission')} sent, {told}{hint}")
    return folder.path / RECORDING


def _sendable(job: Job, desk: DeskOptions) -> list[Transmission]:
    """What is to be sent. Raises BadInput for what no port can send, or the guard does not allow."""
    file = job.spec.origin
    sent, guard = sent_in(job.spec.script or ()), Guard(desk, file)
    if not sent:
        raise BadInput(file, "", "no line from host to robot", "nothing can be sent")
    for one in sent:
        if one.network:
            what = f"speaks to network {one.network}, too; a port is the radio of one"
            raise BadInput(file, f"tick {one.tick}", what, "split the stream")
        if one.bad_stop:
            what = "has a character with a bad stop bit, which no serial port sends"
            raise BadInput(file, f"tick {one.tick}", what, "leave the line out")
        guard.check(one.data, f"tick {one.tick}")
    if count := len(job.spec.script or ()) - len(sent):
        actions = amount(count, "action on robots and radios is", "actions on robots and radios are")
        complain(f"{file}: {actions} not observable on a port, and left out")
    return sent


def _default(file: str) -> Path:
    name = Path(file).name
    stem = Path(file).absolute().parent.name if name.startswith("run.") else name.partition(".")[0]
    return Path("runs") / f"{stem or 'stream'}-port"


def twin_source(scenario: Scenario, seed: int, image: Image, firmware: bytes = b"") -> RunSource:
    """What the twin of robots at a port is made from; `firmware`: the file of an image that is not on the disk."""
    twin = changed(scenario, scenario.name, [*live_settings(scenario), *_TWIN])
    return RunSource(
        scenario_name=twin.name,
        scenario_text=tomli_w.dumps(tables_of(twin)),
        seed=seed,
        firmware=firmware or image.path.read_bytes(),
        firmware_sha256=image.sha256,
        symbols={name: (at.address, at.space) for name, at in image.symbols.names.items()},
        origin=PORT,
    )


def compare_with_twin(job: Job, rule: CompareRule, everything: bool, quiet: bool, as_json: bool) -> int:
    """Runs the twin with what was sent at the port, and compares its answers; the exit code."""
    comparison = beside_twin(job, quiet or as_json, rule)
    found = comparison.differences
    difference = RunDifference(WORDS, found)
    count = sum(map(len, comparison.robots.values()))
    code = exit_code("differs" if found else "passed" if count else "not observable")
    if as_json:
        head = {"file": job.spec.origin, "seed": job.spec.seed, "source": PORT, "silent": comparison.silent}
        head["not_judged"] = comparison.not_judged
        print_json(head | difference.as_json(everything) | {"exit_code": code})
    elif found and not quiet:
        for table in difference_tables(difference, everything):
            show(table)
    for slot in comparison.silent:
        complain(f"robot {slot} of the twin is not at the port: not compared")
    if comparison.not_judged:
        complain(f"{comparison.not_judged} values are not judged: they depend on times too near to a limit")
    if found:
        first = f"in control period {found[0].period}, {found[0].said(WORDS)}"
        complain(f"the robot differs from its twin {first}")
    elif not count:
        complain("no robot was asked, or none answered: nothing could be compared")
    elif not as_json:
        known = f"times are known to {comparison.unsure_ms:.1f} ms"
        show(f"the robot answers as its twin does, {amount(count, 'time')}; {known}")
    return code
