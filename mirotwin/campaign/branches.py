"""Branches of a run: the world at the end of a control period, continued with the noise of other seeds.

A branch is a run of its own: the same script with `reseed` in it. Where a process can be copied (`fork`), one process
runs to the moment and is copied for each branch, with the world, the state of its checks and the pending steps.
Elsewhere each branch runs from the first tick, with the same verdict.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Sequence

import msgspec
from msgspec.structs import replace

from miro_protocol.actions import Reseed
from miro_sim.periods import Period
from miro_sim.world.actions import SETTLE_TICKS
from mirotwin.campaign.chances import wilson
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.verify.checks.interface import Failure

STEP = "step"
"""Name of the failure where a step failed and no check."""
FROM_START = -1
"""In place of a tick: the seed is another one from the start, with other wheels and another calibration."""
PASSED, FAILED, BROKEN = 0, 1, 70
CAN_COPY = hasattr(os, "fork")


class Point(msgspec.Struct, frozen=True):
    """`failed`: for each of the seeds, whether the branch at `tick` failed."""

    tick: int
    failed: tuple[bool, ...]

    @property
    def count(self) -> int:
        return sum(self.failed)

    @property
    def share(self) -> float:
        return self.count / len(self.failed)

    @property
    def interval(self) -> tuple[float, float]:
        return wilson(self.count, len(self.failed))


class _AllBranched(Exception):
    """Raised in the copied process when all branches are done."""


def failure_of(run: Run, name: str = "") -> Failure | None:
    """The first failure of that check, or of any."""
    failures = [failure for group in run.judges for failure in group.failures if name in ("", failure.check)]
    return min(failures, key=lambda failure: failure.tick, default=None)


def has_failed(run: Run, name: str) -> bool:
    """True if the check `name` failed; for `STEP`, if a step failed."""
    if name == STEP:
        return run.player is not None and run.player.failure is not None
    return failure_of(run, name) is not None


def branch(spec: RunSpec, tick: int, seed: int) -> RunSpec:
    """The run with the noise of `seed` from tick `tick`, the end of a control period, on."""
    if tick == FROM_START:
        return replace(spec, seed=seed)
    lines = range(len(getattr(spec.scenario, "networks", ())) or 1)
    # `tick + SETTLE_TICKS` is what `earliest_action_tick` is in a copy: both ways give the same bits.
    reseeds = [Reseed(tick + SETTLE_TICKS, line, seed) for line in lines]
    # A stable sort: behind the script's own actions of that tick, as `do` puts it in a copy.
    script = sorted([*(spec.script or ()), *reseeds], key=lambda item: item.tick)
    return replace(spec, script=script, computed=spec.computed or spec.script is None)


def branched(spec: RunSpec, name: str, tick: int, seeds: Sequence[int], jobs: int = 1) -> Point:
    """Runs the branches at `tick`, `jobs` at a time, and counts failures. `name`: the check that fails."""
    if not CAN_COPY:
        return Point(tick, tuple(has_failed(Run(branch(spec, tick, seed)).play(), name) for seed in seeds))
    codes: list[int] = []
    own_seed: int | None = None  # of the copy that this process is

    def look(period: Period | None) -> None:
        nonlocal own_seed
        # A copy that knows its verdict ends here: the rest of the run would change nothing.
        if own_seed is not None and has_failed(run, name):
            os._exit(FAILED)
        # `own_seed`: a copy comes here in every later period, and must not copy itself again.
        if own_seed is not None or run.world.tick < tick:
            return
        own_seed = _copied(seeds, jobs, codes)
        if own_seed is None:
            # Out of the run from within an observer: this process itself has nothing more to compute.
            raise _AllBranched
        for line in run.world.lines:
            run.world.do(Reseed(run.world.earliest_action_tick, line.index, own_seed))

    try:
        if tick == FROM_START:
            own_seed = _copied(seeds, jobs, codes)
        if tick != FROM_START or own_seed is not None:
            run = Run(spec if own_seed is None else replace(spec, seed=own_seed))
            # Observers are called at the end of a period: a branch at the run's first tick would be missed.
            look(None)
            run.world.observers.append(look)
            codes = [FAILED if has_failed(run.play(), name) else PASSED] * len(seeds)  # over before that tick
    except _AllBranched:
        pass
    except BaseException:
        if own_seed is not None:
            # A copy that let the exception out would go on as a second campaign, on the same files.
            os._exit(BROKEN)
        raise
    if own_seed is not None:
        os._exit(codes[0])  # what this process holds open is the first one's to end
    return Point(tick, tuple(code == FAILED for code in codes))


def _copied(seeds: Sequence[int], jobs: int, codes: list[int]) -> int | None:
    """Copies this process once for each seed, `jobs` of them at a time: returns the seed in a copy, and None in this
    process, with the exit codes of all. Raises RuntimeError for a copy that broke.
    """
    gc.freeze()  # a collection in a copy would touch, and so copy, all that it shares with this process
    running: list[int] = []
    for place in range(len(seeds) + jobs):
        if place >= jobs and running:
            # The oldest first, even if a later one has ended: codes are in the order of the seeds.
            codes.append(os.waitstatus_to_exitcode(os.waitpid(running.pop(0), 0)[1]))
            if codes[-1] not in (PASSED, FAILED):
                raise RuntimeError(f"a branch ended with exit code {codes[-1]}")
        if place < len(seeds):
            process = os.fork()
            if not process:
                # With what it shares still frozen: a copy never thaws it.
                return seeds[place]
            running.append(process)
    gc.unfreeze()
    return None


def search(
    branches: Callable[[int], Point], end: int, coarse: int, done: Callable[[Point], object]
) -> tuple[list[Point], int]:
    """Points in the order of time, and the index of the control period in which the failure rate passes one half.

    `branches(n)`: the branches at the end of control period n; `end`: the control periods after which the check has
    failed. The search begins with about `coarse` points. It then halves the interval after the last point below one
    half until that interval is one control period. The index is -1 if no first point is below one half.
    """
    points: dict[int, Point] = {}

    def look(index: int) -> Point:
        if index not in points:
            points[index] = branches(index)
            done(points[index])
        return points[index]

    grid = [end * place // coarse for place in range(coarse + 1)]
    # The last one: the share may fall again, and the question is from when on it stays high.
    low = max((index for index in grid if look(index).share < 0.5), default=-1)
    if low >= 0:
        high = min(index for index in [*grid, end] if index > low)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if look(middle).share < 0.5 else (low, middle)
        for index in (low - 2, low - 1, high + 1, high + 2):  # the curve beside the jump
            if 0 <= index <= end:
                look(index)
    return [points[index] for index in sorted(points)], low
