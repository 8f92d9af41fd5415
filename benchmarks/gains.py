"""Many searches for gains of each law, compared: `python -m benchmarks.gains --write docs/background/gains.md`.

What a search does: `benchmarks.gains_search`. This file chooses the searches, has them made, keeps what is finished in
a journal, and writes all tables (benchmarks/gains.json), the page and its picture. The page does not depend on the
number of processes, on the machine, or on how often the computation was broken off.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, as_completed
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

from benchmarks import gains_page, gains_search
from benchmarks.figures import range_of_seeds
from benchmarks.gains_search import CAMERAS, FAMILIES, HELD_OUT, Budget, Found, Job, Search
from mirotwin.campaign.workers import processes
from mirotwin.shell.processes import cores

REPEATS = 10
DIGESTS = Path(__file__).parents[1] / "tests/vectors/digests.json"
"""Changes when the bits of a run do."""


def jobs_of(repeats: int, budget: Budget, held_out: range, only: str = "") -> list[Job]:
    """All searches, in the order in which they are made."""
    return [
        Job(law, camera, repeat, budget, held_out)
        for repeat in range(repeats)
        for camera in CAMERAS
        for law in FAMILIES
        if only in f"{law}, {camera}"
    ]


def found(job: Job) -> Found:
    """Makes a search, in this process."""
    return Search(job).found()


def key_of(job: Job) -> str:
    """The hash of what decides a search: its parameters, how it searches, and the bits of runs."""
    source = Path(gains_search.__file__).read_bytes()
    seeds = job.held_out.start, job.held_out.stop
    return sha256(
        repr(job._replace(held_out=seeds)).encode() + source + DIGESTS.read_bytes()  # type: ignore[arg-type]
    ).hexdigest()


class Journal:
    """Finished searches, one JSON line each, by their keys. Without a file they are kept until the end only."""

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self.lines: dict[str, Any] = {}
        if path is not None and path.exists():
            self._read(path)

    def _read(self, path: Path) -> None:
        whole, _, _ = path.read_bytes().rpartition(b"\n")  # what follows was cut off
        for line in whole.splitlines():
            entry = msgspec.json.decode(line)
            self.lines[entry["key"]] = entry["found"]
        path.write_bytes(whole + b"\n" if whole else b"")

    def add(self, key: str, one: Found) -> None:
        self.lines[key] = msgspec.to_builtins(one, str_keys=True)
        if self.path is not None:
            with self.path.open("ab") as stream:
                stream.write(msgspec.json.encode({"key": key, "found": one}) + b"\n")

    def found(self, key: str) -> Found:
        return msgspec.convert(self.lines[key], Found, strict=False)


def searched(jobs: Sequence[Job], executor: Executor, journal: Journal) -> Mapping[Job, Found]:
    """What each search came to; those that the journal has are not made again."""
    keys = {job: key_of(job) for job in jobs}
    made = {executor.submit(found, job): job for job, key in keys.items() if key not in journal.lines}
    for number, future in enumerate(as_completed(made), start=1):
        job = made[future]
        journal.add(keys[job], future.result())
        text = f"{number} of {len(made)}: {job.family}, {job.camera}, search {job.repeat}"
        print(text, file=sys.stderr, flush=True)
    return {job: journal.found(key) for job, key in keys.items()}


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="docs/background/gains.md; left out: on the screen"
    )
    parser.add_argument(
        "--journal", type=Path, metavar="FILE", help="keeps finished searches, to go on later"
    )
    parser.add_argument("--only", default="", help='part of "LAW, CAMERA", for a look; not with --write')
    parser.add_argument("--jobs", type=int, default=cores(), help="processes (default: all cores)")
    parser.add_argument("--repeats", type=int, default=REPEATS, help="searches a law and camera")
    parser.add_argument("--budget", type=int, nargs=3, default=Budget(), metavar=("DRAWN", "FIRST", "SECOND"))
    parser.add_argument("--held-out", type=range_of_seeds, default=HELD_OUT, help="first and last: 0-19")
    given = parser.parse_args(arguments)
    jobs = jobs_of(given.repeats, Budget(*given.budget), given.held_out, given.only)
    if given.only and given.write:
        parser.error("--only and --write do not go together")
    if min(given.jobs, given.repeats, *given.budget) < 1:
        parser.error("--jobs, --repeats and the numbers of sets must be 1 or above")
    if not jobs:
        parser.error("--only: no law and camera have such names")
    with processes(given.jobs) as executor:
        results = searched(jobs, executor, Journal(given.journal))
        gains_page.write(results, executor, given.write)
    return 0


if __name__ == "__main__":
    sys.exit(main())
