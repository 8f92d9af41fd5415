"""The base of input generators. Each runs in processes of its own, with its own target, and hands inputs over as files.

This module imports no hot module: a process with a target first chooses its engine by the specification.
"""

from __future__ import annotations

import os
import struct
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import msgspec

from miro_exact.bad_input import BadInput

if TYPE_CHECKING:
    from mirotwin.fuzz.target import Target

PATIENCE_S = 10.0
"""Time for a job to write its last files after it is ordered to end, in seconds."""
LOG_BYTES = 1 << 20
"""A log is emptied when it is longer: afl-fuzz writes a line for each input that it takes up."""
LONGEST_BYTES = 1024
"""AFL++ makes no longer inputs: a thousand characters are a second on the air, and a hundred frames."""
_COUNT = struct.Struct("<Q")


class EngineInput(msgspec.Struct, frozen=True):
    """Parameters of an engine. `target`: the JSON of a `TargetSpec`. `seeds`: a folder of inputs.

    `out`: the campaign's folder, created if missing. `dictionary`: a file of words for AFL++. `jobs`: number of
    processes, each with its own target. `seed`: of the random numbers; None: from the system. `lengths`: shortest and
    longest input made by AFL++, in bytes.
    """

    target: str
    seeds: Path
    out: Path
    dictionary: Path | None = None
    jobs: int = 1
    seed: int | None = None
    lengths: tuple[int, int] = (1, LONGEST_BYTES)


NOTHING = EngineInput("", Path(), Path(), jobs=0)


class EngineProgress(msgspec.Struct, frozen=True):
    """A campaign's progress; `edges` is None until it is known."""

    executions: int = 0
    edges: int | None = None


def counter(path: Path) -> Callable[[int], None]:
    """Writes to `path` how many inputs a process has run, counted on from those of processes before it."""
    before = read_executions(path)
    file = path.open("wb", buffering=0)

    def keep(executions: int) -> None:
        file.seek(0)
        file.write(_COUNT.pack(before + executions))

    keep(0)
    return keep


def read_executions(path: Path) -> int:
    """The number at `path`; 0 where there is no such file, or none that is whole."""
    content = _content(path)
    return int(_COUNT.unpack(content)[0]) if len(content) == _COUNT.size else 0


class Explorer:
    """Runs inputs and calls `keep(kind, data)` for new ones: "queue" for new edges, "crashes" for a new failure.

    How often an edge was executed counts by AFL++'s classes: 1, 2, 3, 4 to 7, 8 to 15, .. times. Failures are new by
    check and place.
    """

    def __init__(
        self, target: Target, keep: Callable[[str, bytes], object] = lambda kind, data: None
    ) -> None:
        self.target = target
        self.keep = keep
        self.covered = 0
        self.failures: dict[tuple[str, int], None] = {}
        self._edges = bytearray(target.map_size)
        self._none = bytes(target.map_size)
        target.use_map(self._edges)

    def run(self, data: bytes) -> int:
        """Returns how many edges it executed."""
        self._edges[:] = self._none
        failed = self.target.run(data)
        classes = int.from_bytes(self._edges.translate(_CLASSES), "little")
        failure = self.target.failure if failed else None
        if failure is not None:
            if (failure.check, failure.pc) not in self.failures:
                self.failures[failure.check, failure.pc] = None
                self.keep("crashes", data)
        elif classes & ~self.covered:
            self.covered |= classes
            self.keep("queue", data)
        return len(self._edges) - self._edges.count(0)

    @property
    def edges(self) -> int:
        """Seen, in runs without a failure."""
        counts = self.covered.to_bytes(len(self._edges), "little")
        return len(counts) - counts.count(0)


def _class_of(count: int) -> int:
    """A bit for each class of counts."""
    bit = count - 1 if count < 4 else min(count.bit_length(), 7)
    return 1 << bit if count else 0


_CLASSES = bytes(_class_of(count) for count in range(256))


class Job:
    """A process of an engine. It starts at once and gets no Ctrl-C of a terminal. It writes into `out`: the folder NAME
    with `queue` and `crashes`, its output NAME.log, the number of inputs run NAME.counts, and the target's error
    messages NAME.target.
    """

    def __init__(
        self,
        out: Path,
        name: str,
        line: Sequence[str],
        environment: Mapping[str, str] | None = None,
        **how: Any,
    ) -> None:
        self.name = name
        self.folder = out / name
        self.log = out / f"{name}.log"
        self.counts = out / f"{name}.counts"
        self.complaint = out / f"{name}.target"
        self.log.unlink(missing_ok=True)
        self.complaint.unlink(missing_ok=True)
        with self.log.open("ab") as log:  # the next line is the first of a log that was emptied
            self.process = subprocess.Popen(
                line,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env=environment,
                start_new_session=True,
                **how,
            )

    @property
    def running(self) -> bool:
        return self.process.poll() is None

    def wait(self) -> None:
        """Waits until the process has ended; kills it and its target after `PATIENCE_S`."""
        try:
            self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Engine:
    """One campaign of an engine, which yields paths of input files. This base class generates no inputs; it is used if
    no seed is usable. Derived classes start the jobs of `given`. `watch`: a target that counts the edges of their
    inputs.
    """

    def __init__(self, given: EngineInput = NOTHING, watch: Target | None = None) -> None:
        self.given = given
        self.jobs: list[Job] = []
        self._handed_out: dict[Path, None] = {}
        self._explorer = None if watch is None else Explorer(watch)
        self._counted: dict[Path, None] = {}
        self._stopped = False

    def start(self) -> None:
        """Starts all jobs."""

    def stop(self) -> None:
        """Ends all jobs. A second call does nothing."""
        self._stopped = True
        for job in self.jobs:
            self._interrupt(job)
        for job in self.jobs:
            job.wait()

    def progress(self) -> EngineProgress:
        """The present progress. Raises BadInput, with the job's own error line, if a job ended with an error."""
        self._require_health()
        if self._explorer is None or not self.jobs:
            return EngineProgress()
        for path in self._inputs("queue"):
            if path not in self._counted and (data := _content(path)):
                self._counted[path] = None
                self._explorer.run(data)
        return EngineProgress(sum(read_executions(job.counts) for job in self.jobs), self._explorer.edges)

    def new_crashes(self) -> list[Path]:
        """Inputs with a failure that were not given before. Different jobs may find the same."""
        return self._new("crashes")

    def new_queue(self) -> list[Path]:
        """Inputs that executed something new and were not given before."""
        return self._new("queue")

    def _new(self, kind: str) -> list[Path]:
        self._require_health()
        paths = [path for path in self._inputs(kind) if path not in self._handed_out and _content(path)]
        self._handed_out.update(dict.fromkeys(paths))
        return paths

    def _inputs(self, kind: str) -> list[Path]:
        """All files that its jobs left in `queue` or `crashes`, without files imported from another job."""
        taken = {f"sync:{job.name}" for job in self.jobs}
        left = [path for job in self.jobs for path in sorted((job.folder / kind).glob("id:*"))]
        return [path for path in left if taken.isdisjoint(path.name.split(","))]

    def _require_health(self) -> None:
        for job in self.jobs:
            if job.process.poll() and not self._stopped:
                raise self._why_ended(job)
            if job.log.exists() and job.log.stat().st_size > LOG_BYTES:
                os.truncate(job.log, 0)

    def _interrupt(self, job: Job) -> None:
        """Orders a job to end."""
        job.process.kill()

    def _why_ended(self, job: Job) -> BadInput:
        """The error to report of a job that has ended with one."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self.stop()


def _content(path: Path) -> bytes:
    """The content of `path`; empty while it is written, or where afl-fuzz writes a shorter input in its place."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


def write_dictionary(path: Path, tokens: Iterable[bytes]) -> None:
    """Writes `"\\x55.."` lines, as `afl-fuzz -x` reads them; each string once."""
    words = ("".join(f"\\x{byte:02x}" for byte in token) for token in dict.fromkeys(tokens))
    path.write_text("".join(f'"{word}"\n' for word in words), encoding="ascii")


def write_seeds(folder: Path, inputs: Iterable[bytes]) -> None:
    """Writes the inputs into `folder`, one a file, long ones up to the length that afl-fuzz makes itself."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, data in enumerate(inputs):
        (folder / f"seed-{number:04d}").write_bytes(data[:LONGEST_BYTES])
