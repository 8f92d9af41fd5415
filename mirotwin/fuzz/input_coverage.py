"""Coverage of a campaign and of single inputs, and the causes of failed runs. The campaign's own target counts edges at
full speed. This module uses a second target of the same image that counts instructions, some fifty times slower; it
runs only inputs that found something new, and inputs that failed.
"""

from __future__ import annotations

from collections.abc import Callable

from miro_robot.image import Image
from miro_robot.inspect.counters import Counters
from miro_robot.inspect.coverage import Counts, counts_of, merged
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.watcher import Watcher, attach, detach
from miro_robot.mcs51.cpu import Cpu, on_load
from mirotwin.fuzz.cause import Cause, CauseWatcher
from mirotwin.fuzz.target import Target


class InputCoverage:
    """`total`: the coverage of all inputs so far and of the firmware's start."""

    def __init__(self, image: Image, make: Callable[[], Target]) -> None:
        self.names = SymbolNames(image)
        self._causes = CauseWatcher(image, self.names)
        self.total: Counts = {}
        booting = Counters()
        self.target = _watched(make, booting)
        self.total = counts_of(booting)

    def run(self, data: bytes) -> Counts:
        """The coverage of `data`, which also counts in the total."""
        counts = self._counts(data)
        self.total = merged((self.total, counts))
        return counts

    def _counts(self, data: bytes) -> Counts:
        counters = Counters()
        self._watch(data, counters)
        return counts_of(counters)

    def cause(self, data: bytes, pc: int) -> Cause:
        """The cause of a fault at `pc`: the instruction there, unless an earlier one went wrong."""
        self.target.harness.back()
        self._watch(data, self._causes)
        return self._causes.cause or Cause(pc)

    def _watch(self, data: bytes, watcher: Watcher) -> None:
        attach(self.target.cpu, watcher)
        try:
            self.target.run(data)
        finally:
            detach(self.target.cpu, watcher)

    def function(self, address: int) -> str:
        """The name of the function that an instruction belongs to."""
        return self.names.function(address)[1]


def _watched(make: Callable[[], Target], counters: Counters) -> Target:
    """A target whose processor is counted from the start of its firmware until it is ready."""
    watched: list[Cpu] = []

    def watch(cpu: Cpu) -> None:
        if not watched:
            watched.append(cpu)
            attach(cpu, counters)

    token = on_load.set(watch)
    try:
        target = make()
    finally:
        on_load.reset(token)
    for cpu in watched:
        detach(cpu, counters)
    return target
