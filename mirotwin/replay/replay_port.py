"""`mirotwin replay --port`: what was sent, sent to a robot, whose answers are then held beside those of its twin."""

from __future__ import annotations

from pathlib import Path

from miro_exact.bad_input import amount
from miro_exact.clock import CONTROL_PERIOD_TICKS
from mirotwin.desk.guard import DeskOptions
from mirotwin.desk.robot_port import PORT
from mirotwin.recording.compare import CompareRule
from mirotwin.replay.difference import RunDifference
from mirotwin.replay.text import difference_tables
from mirotwin.runs.at_port import beside_twin, send, sendable
from mirotwin.runs.job import Job
from mirotwin.shell.console import show
from mirotwin.shell.json_text import print_json
from mirotwin.shell.outputs import RECORDING, OutputFolder
from mirotwin.shell.program import complain
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.verdicts import exit_code

WORDS = ("robot", "twin")


def record_at_port(job: Job, desk: DeskOptions, out: Path | None, force: bool, quiet: bool) -> Path:
    """Sends all that the job's hosts send to the robots at the port; the recording of it. Raises BadInput."""
    sent = sendable(job, desk, complain)
    folder = OutputFolder(out or _default(job.spec.origin), force, (RECORDING,), ours=out is None)
    with ProgressBar("sending", sent[-1].end_tick - sent[0].tick, quiet) as bar:
        send(sent, job, desk, folder, complain, bar.to)
    return folder.path / RECORDING


def _default(file: str) -> Path:
    name = Path(file).name
    stem = Path(file).absolute().parent.name if name.startswith("run.") else name.partition(".")[0]
    return Path("runs") / f"{stem or 'stream'}-port"


def compare_with_twin(job: Job, rule: CompareRule, everything: bool, quiet: bool, as_json: bool) -> int:
    """Runs the twin with what was sent at the port, and compares its answers; the exit code."""
    total_ticks = len(job.recorded) * CONTROL_PERIOD_TICKS
    with ProgressBar("running the twin", total_ticks, quiet or as_json) as bar:
        comparison = beside_twin(job, rule, bar.to)
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
