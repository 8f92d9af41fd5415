"""The targets of fuzzing under Hypothesis: the engine where AFL++ is missing.

What belongs here: campaigns with the methods and the folders of `AflRun`, and one process of them. What does not: which
inputs there are (`hypothesis_inputs`), and what is made of a find.

    HypothesisRun ── starts ──► python -m mirotwin.fuzz.hypothesis_engine SPECIFICATION SEEDS JOB SEED
                                   │ JOB/queue/id:..     inputs that executed something new
                                   │ JOB/crashes/id:..   inputs with a finding
         reads ◄───────────────────┘ JOB/progress        counters

Hypothesis draws inputs and climbs towards those that execute many edges (`hypothesis.target`); there is no other
evolution. It remembers all that it has drawn, so it works in rounds, each with a seed of its own. A finding is no
failure for it: it goes on, and finds are made smaller elsewhere.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.rng import Stream
from mirotwin.fuzz.afl.parents import end_with_parent
from mirotwin.fuzz.afl.statistics import Progress
from mirotwin.fuzz.spec import TargetSpec, spec_of

if TYPE_CHECKING:
    from mirotwin.fuzz.target import Target

ROUND_EXAMPLES = 500
"""Inputs between two times that Hypothesis forgets: it has then climbed once."""
TOLD_S = 0.25
_PROGRESS, _LOG = "progress", "log"
_KINDS = ("queue", "crashes")


def missing() -> str | None:
    """What of Hypothesis is missing and how to get it; None where it is there."""
    if find_spec("hypothesis") is not None:
        return None
    return "Hypothesis is not installed; install it with `pip install 'mirotwin[strategies]'`"


class HypothesisRun:
    """A campaign: `jobs` processes, each with a target of its own and a seed of its own.

    Arguments as `AflRun` has them; a dictionary is not used, since inputs are made of whole operations. `seed`: of what
    Hypothesis draws; 0 where none is given. Raises BadInput for Hypothesis that is missing; the methods raise it when a
    process has ended with an error, with its last line.
    """

    def __init__(
        self,
        target_args: Sequence[str],
        seeds: Path,
        out: Path,
        dictionary: Path | None = None,
        jobs: int = 1,
        seed: int | None = None,
    ) -> None:
        if jobs < 1:
            raise BadInput("--jobs", "", f"{jobs}: there is nothing to do", "give 1 or more")
        absent = missing()
        if absent:
            raise BadInput("Hypothesis", "", *absent.split("; ", 1))
        self._target_args = list(target_args)
        self._seeds = seeds
        self._folders = [out / f"job{job}" for job in range(jobs)]
        self._seed = seed or 0
        self._processes: list[subprocess.Popen[bytes]] = []
        self._handed_out: dict[str, dict[Path, None]] = {kind: {} for kind in _KINDS}
        self._began_s = 0.0

    def start(self) -> None:
        """Starts all processes."""
        self._began_s = time.monotonic()
        for number, folder in enumerate(self._folders):
            for kind in _KINDS:
                (folder / kind).mkdir(parents=True, exist_ok=True)
            what = [*self._target_args[:1], str(self._seeds), str(folder), str(self._seed + number)]
            with (folder / _LOG).open("wb") as log:
                self._processes.append(
                    subprocess.Popen(
                        [sys.executable, "-m", __spec__.name, *what],
                        stdin=subprocess.DEVNULL,
                        stdout=log,
                        stderr=log,
                        start_new_session=True,  # Ctrl-C is the command's, which stops its processes
                    )
                )

    def stop(self) -> None:
        """Ends all processes at once. A second call does nothing."""
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.wait()

    @property
    def running(self) -> bool:
        """Is any process at work?"""
        self._require_health()
        return any(process.poll() is None for process in self._processes)

    def progress(self) -> Progress:
        """How far it is."""
        self._require_health()
        told = [one for one in (_told(folder) for folder in self._folders) if one]
        run_time_s = time.monotonic() - self._began_s
        executions = sum(one.executions for one in told)
        return Progress(
            executions=executions,
            executions_per_s=executions / run_time_s if run_time_s > 0 else 0.0,
            edges=max((one.edges for one in told), default=None),
            crashes=len(self._all("crashes")),
            corpus_count=len(self._all("queue")),
            stability_percent=None,
            run_time_s=run_time_s,
            frames=sum(one.frames for one in told),
            characters=sum(one.characters for one in told),
        )

    def new_crashes(self) -> list[Path]:
        """Inputs with a finding that were not given before."""
        return self._new("crashes")

    def new_queue(self) -> list[Path]:
        """Inputs that executed something new and were not given before."""
        return self._new("queue")

    def __enter__(self) -> HypothesisRun:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def _require_health(self) -> None:
        for process, folder in zip(self._processes, self._folders, strict=False):
            if process.poll() not in (None, -signal.SIGKILL):
                lines = (folder / _LOG).read_text("utf-8", "replace").strip().splitlines()
                what = lines[-1] if lines else f"ended with exit code {process.returncode}"
                raise BadInput("Hypothesis", "", what, f"see {folder / _LOG}")

    def _all(self, kind: str) -> list[Path]:
        return [path for folder in self._folders for path in sorted((folder / kind).glob("id:*"))]

    def _new(self, kind: str) -> list[Path]:
        self._require_health()
        found = [path for path in self._all(kind) if path not in self._handed_out[kind]]
        self._handed_out[kind].update(dict.fromkeys(found))
        return found


class Told(msgspec.Struct, frozen=True):
    """What a process tells of itself."""

    executions: int
    edges: int
    frames: int
    characters: int


def _told(folder: Path) -> Told | None:
    try:
        return msgspec.json.decode((folder / _PROGRESS).read_bytes(), type=Told)
    except FileNotFoundError:
        return None


# ---- one process ---------------------------------------------------------------------------------------------


class Explorer:
    """Runs inputs and tells `keep(kind, data)` which to keep: "queue" for new edges, "crashes" for a new finding.

    How often an edge was executed counts by AFL++'s classes: 1, 2, 3, 4 to 7, 8 to 15, .. times. Findings are new by
    check and place.
    """

    def __init__(self, target: Target, keep: Callable[[str, bytes], None]) -> None:
        self.target = target
        self.keep = keep
        self.seen = 0
        self.findings: dict[tuple[str, int], None] = {}
        self._edges = bytearray(target.map_size)
        self._none = bytes(target.map_size)
        target.use_map(self._edges)

    def run(self, data: bytes) -> int:
        """Returns how many edges it executed."""
        self._edges[:] = self._none
        found = self.target.run(data)
        classes = int.from_bytes(self._edges.translate(_CLASSES), "little")
        finding = self.target.finding if found else None
        if finding is not None:
            if (finding.check, finding.pc) not in self.findings:
                self.findings[finding.check, finding.pc] = None
                self.keep("crashes", data)
        elif classes & ~self.seen:
            self.seen |= classes
            self.keep("queue", data)
        return len(self._edges) - self._edges.count(0)

    @property
    def edges(self) -> int:
        """Seen, in runs without a finding."""
        seen = self.seen.to_bytes(len(self._edges), "little")
        return len(seen) - seen.count(0)


def _class_of(count: int) -> int:
    """A bit for each class of counts."""
    bit = count - 1 if count < 4 else min(count.bit_length(), 7)
    return 1 << bit if count else 0


_CLASSES = bytes(_class_of(count) for count in range(256))


class Stopped(BaseException):
    """Ends a round: Hypothesis takes exceptions derived from Exception for failures."""


def explore(
    explorer: Explorer, spec: TargetSpec, seeds: Sequence[bytes], seed: int, goes_on: Callable[[], bool]
) -> None:
    """Runs the seeds, then what Hypothesis draws, as long as `goes_on()`, which is asked before each run."""
    for data in seeds:
        if not goes_on():
            return
        explorer.run(data)
    stream = Stream(seed, "rounds of Hypothesis")
    try:
        for number in _counting():
            _round(explorer, spec, seeds, stream.u64(number), goes_on)
    except Stopped:
        return


def _round(
    explorer: Explorer, spec: TargetSpec, seeds: Sequence[bytes], seed: int, goes_on: Callable[[], bool]
) -> None:
    import hypothesis

    from mirotwin.fuzz.hypothesis_inputs import inputs

    drawn = inputs(spec.input, spec.robots, spec.slot, bool(spec.protocol), seeds)

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=ROUND_EXAMPLES,
        phases=[hypothesis.Phase.generate, hypothesis.Phase.target],
        database=None,
        deadline=None,
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    @hypothesis.given(drawn)
    def one(data: bytes) -> None:
        if not goes_on():
            raise Stopped
        hypothesis.target(float(explorer.run(data)), label="edges")

    one()


def _counting() -> Iterator[int]:
    number = 0
    while True:
        yield number
        number += 1


class _Kept:
    """The folder of a process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.counts = dict.fromkeys(_KINDS, 0)
        self.told_s = 0.0

    def keep(self, kind: str, data: bytes) -> None:
        path = self.folder / kind / f"id:{self.counts[kind]:06d}"
        self.counts[kind] += 1
        _write(path, data)

    def tell(self, explorer: Explorer) -> bool:
        """Writes the counters now and then; always True."""
        now_s = time.monotonic()
        if now_s - self.told_s >= TOLD_S:
            self.told_s = now_s
            target = explorer.target
            told = Told(target.executions, explorer.edges, target.frames_fed, target.characters_fed)
            _write(self.folder / _PROGRESS, msgspec.json.encode(told))
        return True


def _write(path: Path, data: bytes) -> None:
    """Whole or not at all; nobody reads the name it has meanwhile."""
    part = path.parent / f".{path.name}"
    part.write_bytes(data)
    part.rename(path)


def main(arguments: Sequence[str]) -> int:
    """The process: runs until it is killed."""
    end_with_parent(signal.SIGKILL)
    text, seeds_folder, folder, seed = arguments
    try:
        spec = spec_of(text)
        target = spec.make()
    except BadInput as error:
        print(error, file=sys.stderr)
        return 2
    kept = _Kept(Path(folder))
    explorer = Explorer(target, kept.keep)
    seeds = [path.read_bytes() for path in sorted(Path(seeds_folder).iterdir()) if path.is_file()]
    explore(explorer, spec, seeds, int(seed), lambda: kept.tell(explorer))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
