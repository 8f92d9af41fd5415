"""One process of a campaign under Hypothesis: it has a target of its own and runs until it is killed.

Hypothesis draws inputs and climbs towards those that execute many edges (`hypothesis.target`); there is no other
evolution. It remembers all that it has drawn, so it works in rounds, each with a seed of its own. A crash does not
end its search; crashes are made smaller elsewhere.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.rng import Stream
from mirotwin.fuzz.afl.settings import end_with_parent
from mirotwin.fuzz.spec import TargetSpec, spec_of

if TYPE_CHECKING:
    from mirotwin.fuzz.target import Target


ROUND_EXAMPLES = 500
"""Inputs between two times that Hypothesis forgets: it has then climbed once."""


class Explorer:
    """Runs inputs and tells `keep(kind, data)` which to keep: "queue" for new edges, "crashes" for a new failure.

    How often an edge was executed counts by AFL++'s classes: 1, 2, 3, 4 to 7, 8 to 15, .. times. Findings are new by
    check and place.
    """

    def __init__(self, target: Target, keep: Callable[[str, bytes], None]) -> None:
        self.target = target
        self.keep = keep
        self.seen = 0
        self.failures: dict[tuple[str, int], None] = {}
        self._edges = bytearray(target.map_size)
        self._none = bytes(target.map_size)
        target.use_map(self._edges)

    def run(self, data: bytes) -> int:
        """Returns how many edges it executed."""
        self._edges[:] = self._none
        found = self.target.run(data)
        classes = int.from_bytes(self._edges.translate(_CLASSES), "little")
        failure = self.target.failure if found else None
        if failure is not None:
            if (failure.check, failure.pc) not in self.failures:
                self.failures[failure.check, failure.pc] = None
                self.keep("crashes", data)
        elif classes & ~self.seen:
            self.seen |= classes
            self.keep("queue", data)
        return len(self._edges) - self._edges.count(0)

    @property
    def edges(self) -> int:
        """Seen, in runs without a failure."""
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
        for number in count():
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


TOLD_S = 0.25
"""Between two times that it tells how far it is."""
KINDS = ("queue", "crashes")
_PROGRESS = "progress"


class JobProgress(msgspec.Struct, frozen=True):
    """What a process tells of itself."""

    executions: int
    edges: int


def told(folder: Path) -> JobProgress | None:
    """What the process of that folder told last; None before that."""
    try:
        return msgspec.json.decode((folder / _PROGRESS).read_bytes(), type=JobProgress)
    except FileNotFoundError:
        return None


class _Kept:
    """The folder of a process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.counts = dict.fromkeys(KINDS, 0)
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
            now = JobProgress(explorer.target.executions, explorer.edges)
            _write(self.folder / _PROGRESS, msgspec.json.encode(now))
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
