"""The engine used without AFL++: processes that draw inputs with Hypothesis, each for its own target.

HypothesisRun ── starts ──► python -m mirotwin.fuzz.hypothesis_process SPECIFICATION SEEDS JOB SEED
                               │ JOB/queue/id:..     inputs that executed something new
                               │ JOB/crashes/id:..   inputs with a failure
     reads ◄───────────────────┘ JOB.counts          how many inputs it has run

Hypothesis draws inputs and prefers those that execute many edges (`hypothesis.target`); there is no other evolution. It
remembers all its draws, so it works in rounds, each with its own seed. A crash does not end its search; crashes are
minimised elsewhere.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path

from miro_exact.bad_input import BadInput
from miro_exact.inputs import replace_file
from mirotwin.fuzz.engine import Engine, Explorer, Job, counter
from mirotwin.fuzz.making import make_target
from mirotwin.fuzz.spec import TargetSpec, spec_of
from mirotwin.shell.processes import end_with_parent, python_module

ROUND_EXAMPLES = 500
"""Inputs between two times that Hypothesis forgets: it has then climbed once."""
TOLD_S = 0.25
"""Seconds between two progress reports."""


class HypothesisRun(Engine):
    """A campaign: each of the jobs is a process with a seed of its own. A dictionary is not used.

    Inputs are made of whole operations.
    """

    def start(self) -> None:
        given = self.given
        seed = int.from_bytes(os.urandom(4), "little") if given.seed is None else given.seed
        for number in range(given.jobs):
            name = f"job{number}"
            for kind in ("queue", "crashes"):
                (given.out / name / kind).mkdir(parents=True, exist_ok=True)
            arguments = [given.target, str(given.seeds), str(given.out / name), str(seed + number)]
            self.jobs.append(
                Job(given.out, name, python_module("mirotwin.fuzz.hypothesis_process", *arguments))
            )

    def _why_ended(self, job: Job) -> BadInput:
        lines = job.log.read_text("utf-8", "replace").strip().splitlines()
        reason = lines[-1] if lines else f"ended with exit code {job.process.returncode}"
        return BadInput("Hypothesis", "", reason, f"see {job.log}")


def explore(
    explorer: Explorer, spec: TargetSpec, seeds: Sequence[bytes], seed: int, tell: Callable[[], None]
) -> None:
    """Runs the seeds, then inputs drawn by Hypothesis, for ever. `tell` is called before each run."""
    from miro_exact.rng import Stream  # a hot module: not before the engine was chosen

    def run(data: bytes) -> int:
        tell()
        return explorer.run(data)

    for data in seeds:
        run(data)
    stream = Stream(seed, "rounds of Hypothesis")
    for number in count():
        _round(run, spec, seeds, stream.u64(number))


def _round(run: Callable[[bytes], int], spec: TargetSpec, seeds: Sequence[bytes], seed: int) -> None:
    import hypothesis

    from mirotwin.fuzz.hypothesis_inputs import inputs

    drawn = inputs(spec.input, spec.robots, spec.slot, bool(spec.protocol), seeds, spec.board == "wired")

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
        hypothesis.target(float(run(data)), label="edges")

    one()


def main(arguments: Sequence[str]) -> int:
    """The process: runs until it is killed."""
    end_with_parent(signal.SIGKILL)
    text, seeds_folder, folder, seed = arguments
    try:
        spec = spec_of(text)
        target = make_target(spec)
    except BadInput as error:
        print(error, file=sys.stderr)
        return 2
    counts: Counter[str] = Counter()
    write, reported_s = counter(Path(f"{folder}.counts")), 0.0

    def keep(kind: str, data: bytes) -> None:
        path = Path(folder, kind, f"id:{counts[kind]:06d}")
        counts[kind] += 1
        replace_file(path, data)

    def tell() -> None:
        nonlocal reported_s
        if time.monotonic() - reported_s >= TOLD_S:
            reported_s = time.monotonic()
            write(target.executions)

    seeds = [path.read_bytes() for path in sorted(Path(seeds_folder).iterdir())]
    explore(Explorer(target, keep), spec, seeds, int(seed), tell)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
