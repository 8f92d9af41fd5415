"""What inputs reach: coverage of a campaign and of single inputs, and the path that tells crashes apart.

The campaign's own target counts edges at full speed. Here is a second one of the same image that counts instructions,
some fifty times slower, so it sees only inputs that found something new.

The path of an input is the set of functions that ran because of it: those of its run, without those that run when
nothing is heard. A minimised input has little in it besides the mistake, so that one mistake comes down to few paths:
which branches are taken within a function, how often, and what an interrupt came in between of do not count. An image
without symbols has the functions that can be seen: where calls and interrupt vectors lead.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping

from miro_robot.image import Image
from miro_robot.inspect.counters import Counters
from miro_robot.inspect.coverage import Counts, counts_of, merged
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.watcher import attach, detach
from miro_robot.mcs51.cpu import Cpu, on_load
from mirotwin.fuzz.target import Target

PATH_DIGITS = 6


class InputCoverage:
    """`total`: what ran in all inputs so far and while the firmware started; `idle`: functions that run in silence."""

    def __init__(self, image: Image, make: Callable[[], Target]) -> None:
        self.names = SymbolNames(image)
        self.total: Counts = {}
        booting = Counters()
        self.target = _watched(make, booting)
        self.total = counts_of(booting)
        self.idle = self.functions_of(self._counts(b""))

    def run(self, data: bytes) -> Counts:
        """What runs because of `data`; it counts in the total."""
        counts = self._counts(data)
        self.total = merged((self.total, counts))
        return counts

    def _counts(self, data: bytes) -> Counts:
        counters = Counters()
        attach(self.target.cpu, counters)
        try:
            self.target.run(data)
        finally:
            detach(self.target.cpu, counters)
        return counts_of(counters)

    def functions_of(self, counts: Mapping[int, object]) -> frozenset[str]:
        """Names of the functions in which something ran."""
        return frozenset(self.names.function(address)[1] for address in counts)

    def path(self, counts: Counts) -> str:
        """The path of an input that has these counts, as a short hash."""
        names = sorted(self.functions_of(counts) - self.idle)
        return hashlib.sha256("\n".join(names).encode()).hexdigest()[:PATH_DIGITS]

    def function(self, address: int) -> str:
        """The name of the function that an instruction belongs to."""
        return self.names.function(address)[1]


def _watched(make: Callable[[], Target], counters: Counters) -> Target:
    """A target whose processor is counted from the moment at which it gets its program until it is there."""
    seen: list[Cpu] = []

    def watch(cpu: Cpu) -> None:
        if not seen:
            seen.append(cpu)
            attach(cpu, counters)

    token = on_load.set(watch)
    try:
        target = make()
    finally:
        on_load.reset(token)
    for cpu in seen:
        detach(cpu, counters)
    return target
