"""One process of a campaign under Hypothesis: it has a target of its own and runs until it is killed."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.afl.settings import end_with_parent
from mirotwin.fuzz.hypothesis_search import Explorer, explore
from mirotwin.fuzz.spec import spec_of

TOLD_S = 0.25
"""Between two times that it tells how far it is."""
KINDS = ("queue", "crashes")
_PROGRESS = "progress"


class Told(msgspec.Struct, frozen=True):
    """What a process tells of itself."""

    executions: int
    edges: int


def told(folder: Path) -> Told | None:
    """What the process of that folder told last; None before that."""
    try:
        return msgspec.json.decode((folder / _PROGRESS).read_bytes(), type=Told)
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
            now = Told(explorer.target.executions, explorer.edges)
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
