"""One campaign of afl-fuzz: its jobs, how far they are, and the inputs that they leave.

The folder, beside what afl-fuzz makes itself (`JOB/queue`, `JOB/crashes`, ..): `JOB.log` is afl-fuzz's output,
`JOB.target` what the target process complained of, `JOB.counts` how many inputs that has run.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.afl.job import AflJob
from mirotwin.fuzz.afl.settings import LONGEST_BYTES, Call, environment, job_name, missing
from mirotwin.fuzz.engine import Engine, EngineInput, EngineProgress

if TYPE_CHECKING:
    from mirotwin.fuzz.target import Target

MAP_BYTES = 8192
RATE_S = 1.0
"""The rate is measured over at least so long."""
_ONE_IF_ANY = bytes([0]) + bytes([1]) * 255


class EdgeUnion:
    """Edges of all inputs that were `add`ed. `count` is how many these are.

    The target counts into this object's map from then on: give it another by `use_map` to use it elsewhere.
    """

    def __init__(self, target: Target) -> None:
        self._target = target
        self._edges = bytearray(target.map_size)
        self._none = bytes(target.map_size)
        self._seen = 0

    @property
    def count(self) -> int:
        """Edges seen."""
        return self._seen.bit_count()

    def add(self, data: bytes) -> int:
        """Runs an input; how many edges no input before has executed. Those of a run with a failure do not count."""
        self._edges[:] = self._none
        self._target.use_map(self._edges)
        if self._target.run(data):
            return 0
        before = self.count
        self._seen |= int.from_bytes(self._edges.translate(_ONE_IF_ANY), "little")
        return self.count - before


def cores_for(jobs: int, proc: Path = Path("/proc")) -> list[int]:
    """A core for each job, those first to which the fewest other processes are bound. Empty where none can be told."""
    if not hasattr(os, "sched_getaffinity"):
        return []
    mine = sorted(os.sched_getaffinity(0))
    taken = bound(proc)
    mine.sort(key=lambda core: taken[core])  # a stable sort: equal ones stay in the order of their numbers
    return [mine[job % len(mine)] for job in range(jobs)]


def shared_cores(jobs: int) -> str | None:
    """What there is to say about more jobs than cores, None where there are enough."""
    if not hasattr(os, "sched_getaffinity"):
        return None
    cores = len(os.sched_getaffinity(0))
    if jobs <= cores:
        return None
    what = f"--jobs {jobs}: this process may use {cores} core{'s' if cores > 1 else ''}, so jobs share them"
    return f"{what}; --jobs {cores} makes as many executions"


def bound(proc: Path) -> Counter[int]:
    """How many processes are bound to each single core. Kernel threads, which have no memory, are left out."""
    found: Counter[int] = Counter()
    for status in proc.glob("[0-9]*/status"):
        try:
            lines = status.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:  # the process has ended
            continue
        values = dict(line.split(":\t", 1) for line in lines if ":\t" in line)
        cores = values.get("Cpus_allowed_list", "")
        if "VmSize" in values and cores.isdecimal():
            found[int(cores)] += 1
    return found


class AflRun(Engine):
    """A campaign: each of the jobs is an afl-fuzz.

    `watch`: a target by which new edges are counted at once: afl-fuzz says them after a minute. `lengths`: the shortest
    and the longest input in bytes that it makes.

    Raises BadInput for AFL++ that is missing and a folder without seeds; `start` for a program that cannot be started.
    """

    def __init__(
        self, given: EngineInput, watch: Target, lengths: tuple[int, int] = (1, LONGEST_BYTES)
    ) -> None:
        given.check("AFL++", missing())
        super().__init__()
        _require_seeds(given.seeds)
        self._call = Call(given, lengths)
        self._environment = environment(os.environ, MAP_BYTES)
        self._out = given.out
        self.jobs = [AflJob(given.out, job_name(job, given.jobs)) for job in range(given.jobs)]
        self._union = EdgeUnion(watch)
        self._counted: dict[Path, None] = {}
        self._rate_s = 0.0
        self._rate_executions = 0
        self._per_s = 0.0

    def notes(self) -> list[str]:
        """What a user should know before it starts: more jobs than cores."""
        note = shared_cores(len(self.jobs))
        return [] if note is None else [note]

    def start(self) -> None:
        """Starts all jobs. An afl-fuzz that ends at once is told by the next call of another method."""
        self._out.mkdir(parents=True, exist_ok=True)
        self._rate_s = time.monotonic()
        self._rate_executions = self._executions()
        cores: list[int | None] = [*cores_for(len(self.jobs))] or [None] * len(self.jobs)
        for number, (job, core) in enumerate(zip(self.jobs, cores, strict=True)):
            job.start(self._call.line(number), self._environment, core)

    def stop(self) -> None:
        for job in self.jobs:
            job.interrupt()
        for job in self.jobs:
            job.wait()

    def progress(self) -> EngineProgress:
        self._require_health()
        return EngineProgress(self._executions(), self._rate(), self._edges())

    # ---- what the jobs leave -------------------------------------------------------------------------------

    def _require_health(self) -> None:
        for job in self.jobs:
            _ = job.running
            job.shorten_log()

    def _inputs(self, kind: str) -> list[Path]:
        names = [job.name for job in self.jobs]
        return [path for job in self.jobs for path in job.inputs(kind, names)]

    def _is_whole(self, path: Path) -> bool:
        return bool(_content(path))

    def _executions(self) -> int:
        return sum(job.executions() for job in self.jobs)

    def _rate(self) -> float:
        now_s, executions = time.monotonic(), self._executions()
        passed_s = now_s - self._rate_s
        if passed_s >= RATE_S:
            self._per_s = (executions - self._rate_executions) / passed_s
            self._rate_s, self._rate_executions = now_s, executions
        return self._per_s

    def _edges(self) -> int:
        for path in self._inputs("queue"):
            if path not in self._counted and (data := _content(path)):
                self._counted[path] = None
                self._union.add(data)
        return self._union.count


def _require_seeds(folder: Path) -> None:
    if not folder.is_dir():
        raise BadInput(folder, "", "is no folder", "give a folder of inputs, one a file")
    if not any(path.is_file() and path.stat().st_size for path in folder.iterdir()):
        raise BadInput(folder, "", "holds no file that is not empty", "put at least one input into it")


def _content(path: Path) -> bytes:
    """The input at `path`; empty while afl-fuzz writes it, or writes a shorter one in its place."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return b""
