"""Which processor core each job of afl-fuzz gets.

afl-fuzz and its target take turns: on one core a turn costs a switch of tasks, on two it wakes the other core. So both
are bound to one core. afl-fuzz can do that itself, but it ends when other programs are bound to all cores, and it knows
the cores of the machine, not those that this process may use.
"""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path


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
