"""Processor time of the processes that this one has started, while they run."""

from __future__ import annotations

import os
from pathlib import Path


def of_descendants(proc: Path = Path("/proc")) -> float:
    """Seconds, user and system, of all that live, and of those that their living parents have waited for."""
    parents: dict[int, int] = {}
    spent: dict[int, int] = {}
    for status in proc.glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()  # `man 5 proc`: the name may hold blanks
        except OSError:  # it has ended
            continue
        pid = int(status.parent.name)
        parents[pid] = int(fields[1])
        spent[pid] = sum(map(int, fields[11:15]))
    return sum(spent[pid] for pid in parents if _descends(pid, parents)) / os.sysconf("SC_CLK_TCK")


def _descends(pid: int, parents: dict[int, int]) -> bool:
    me = os.getpid()
    while pid in parents:
        pid = parents[pid]
        if pid == me:
            return True
    return False
