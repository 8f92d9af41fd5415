"""One campaign of afl-fuzz: the cores of its jobs, and the reason why one of them ended."""

from __future__ import annotations

import os
import re
import signal
from collections import Counter
from functools import partial
from pathlib import Path

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.afl.settings import environment, job_name, line
from mirotwin.fuzz.engine import Engine, Job
from mirotwin.shell.processes import end_with_parent


def cores_for(jobs: int, proc: Path = Path("/proc")) -> list[int]:
    """A core for each job, those first to which the fewest other processes are bound."""
    mine = sorted(os.sched_getaffinity(0))
    taken = bound(proc)
    mine.sort(key=lambda core: taken[core])  # a stable sort: equal ones stay in the order of their numbers
    return [mine[job % len(mine)] for job in range(jobs)]


def shared_cores(jobs: int) -> list[str]:
    """A note if there are more jobs than cores; else empty."""
    cores = len(os.sched_getaffinity(0))
    if jobs <= cores:
        return []
    note = f"--jobs {jobs}: this process may use {cores} core{'s' if cores > 1 else ''}, so jobs share them"
    return [f"{note}; --jobs {cores} makes as many executions"]


def bound(proc: Path) -> Counter[int]:
    """Core -> number of processes bound to it alone. Kernel threads, which have no memory, are left out."""
    processes: Counter[int] = Counter()
    for status in proc.glob("[0-9]*/status"):
        try:
            lines = status.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:  # the process has ended
            continue
        values = dict(line.split(":\t", 1) for line in lines if ":\t" in line)
        cores = values.get("Cpus_allowed_list", "")
        if "VmSize" in values and cores.isdecimal():
            processes[int(cores)] += 1
    return processes


class AflRun(Engine):
    """A campaign: each of the jobs is an afl-fuzz that is bound to a core."""

    def start(self) -> None:
        given = self.given
        given.out.mkdir(parents=True, exist_ok=True)

        def prepare(core: int) -> None:
            end_with_parent(signal.SIGINT)
            os.sched_setaffinity(0, {core})

        for number, core in enumerate(cores_for(given.jobs)):
            name = job_name(number, given.jobs)
            begin = partial(prepare, core)
            job = Job(given.out, name, line(given, number), environment(os.environ), preexec_fn=begin)
            self.jobs.append(job)

    def _interrupt(self, job: Job) -> None:
        job.process.send_signal(signal.SIGINT)

    def _why_ended(self, job: Job) -> BadInput:
        return why_ended(job.log, job.complaint)


_COLOUR = re.compile(r"\x1b(\[[0-9;?]*[a-zA-Z]|[()].)")
_ABORT = re.compile(r"\[-\]\s+(?:PROGRAM ABORT|SYSTEM ERROR) : (.*)")
_REASON = re.compile(r"OS message : (.*)")

REMEDIES = (
    (
        "valid input seed that does not crash",
        "each seed fails by itself: these are crashes; give one that does not",
    ),
    ("' is in use", "another campaign runs in this folder: end it, or choose another one"),
    ("shmget", "segments of killed programs may fill the limit: see `ipcs -m`, remove them with `ipcrm`"),
    ("initializing fork server", "the target took too long to start: give fewer --jobs"),
    ("cleanup failed", "something in it is not afl-fuzz's: choose another folder"),
    ("Unable to create", "choose a folder that can be written to"),
    ("Unable to open", "choose a folder that can be read"),
)
"""A part of afl-fuzz's error line -> remedy. The first match counts."""

_ELSE = "its whole output is in the file named first"


def why_ended(log: Path, target: Path) -> BadInput:
    """The error to report for an afl-fuzz job that ended with one. `log`: its output.

    `target`: messages of the target process; if there are any, they are the cause.
    """
    own = _read(target).strip().splitlines()
    if own:
        return BadInput(target, len(own), own[-1], "" if len(own) == 1 else f"whole text: {target}")
    text = _COLOUR.sub("", _read(log))
    aborts = list(_ABORT.finditer(text))
    if not aborts:
        last = next((line for line in reversed(text.splitlines()) if line.strip()), "it said nothing")
        return BadInput(log, "", f"afl-fuzz ended: {last.strip()}", _ELSE)
    line = aborts[-1][1].strip()
    reason = _REASON.search(text, aborts[-1].end())
    message = f"{line} ({reason[1].strip()})" if reason else line
    remedy = next((advice for part, advice in REMEDIES if part in message), _ELSE)
    return BadInput(log, "", f"afl-fuzz ended: {message}", remedy)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return ""
