"""Compares two builds with code at different addresses: the first variables that differ, and the instructions that
wrote them.

Such builds have different addresses and different times. Every half millisecond, if both processors sleep and so have
finished their work, the variables named in both symbol files are compared. Ignore timer variables: they differ between
builds of another speed. Variables that still differ at the end are listed in the order in which the differences began,
with the last instruction of each build that changed them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

from miro_exact.clock import CYCLE_TICKS, TICKS_PER_SECOND
from miro_robot.inspect.watcher import Watcher, attach, detach
from mirotwin.replay.lockstep.annotated_image import AnnotatedImage, CodeLocation
from mirotwin.replay.lockstep.fields import Record, extents
from mirotwin.replay.lockstep.pair import WorldPair

if TYPE_CHECKING:
    from miro_robot.mcs51.cpu import Cpu
    from miro_sim.world.world import Mark, World

LOOK_TICKS = 12_012
"""Comparison interval in ticks.

It is no divisor of a millisecond: work that the firmware does every millisecond must not be under way at each
comparison.
"""
TRACED = 3
_INTEGERS = (1, 2, 4)
Key = tuple[int, int, str]
Found = tuple["VariableDifference", "tuple[Mark, Mark]"]
"""With the marks of the look before."""


class VariableDifference(Record, frozen=True):
    """A variable that differs from the look at `tick` on, and did not at the one before.

    Values: of 1, 2 and 4 bytes little-endian numbers, else bytes in hex. `writers`: the instructions that changed it
    last, up to then and since the look before; None where none did.
    """

    tick: int
    network: int
    slot: int
    name: str
    one: int | str
    other: int | str
    writers: tuple[CodeLocation | None, CodeLocation | None] = (None, None)
    clock: int = TICKS_PER_SECOND


class Builds:
    """Two worlds at one tick with firmwares of other layouts. `looks`: how often both processors slept."""

    def __init__(self, world: World, other: World, annotated: tuple[AnnotatedImage, AnnotatedImage]) -> None:
        self.pair = WorldPair(world, other)
        self.annotated = annotated
        first, second = (extents(image.image) for image in annotated)
        self.places = {
            name: (first[name][0], second[name][0], min(first[name][1], second[name][1]))
            for name in first
            if name in second
        }
        self.looks = 0
        self.last_tick = 0  # of the look before
        self.since: dict[Key, Found] = {}
        self.gone: dict[Key, Found] = {}  # what differed at two looks or more, the first time

    def variables(self, until_tick: int) -> list[VariableDifference]:
        """The variables that differ when both processors sleep last before `until_tick`, by when that began.

        Where none does, those that did for a while.
        """
        before = self.pair.mark()
        while self.pair.tick < until_tick and not self.pair.over:
            self.pair.run_to(min(until_tick, self.pair.tick + LOOK_TICKS))
            if self._look(before):
                before = self.pair.mark()
                self.last_tick = self.pair.tick
        differences = sorted((self.since or self.gone).values(), key=lambda pair: pair[0].tick)
        return [
            self._traced(difference, mark) if index < TRACED else difference
            for index, (difference, mark) in enumerate(differences)
        ]

    def _look(self, before: tuple[Mark, Mark]) -> bool:
        """Compares the variables of each device whose processors both sleep; returns True if all sleep."""
        slept = True
        for device, twin in zip(self.pair.one.devices, self.pair.other.devices, strict=True):
            if not (device.board.cpu.idle and twin.board.cpu.idle):
                slept = False
                continue
            self.looks += 1
            for name, (first, second, size) in self.places.items():
                here = _bytes(device.board.cpu, first, size)
                there = _bytes(twin.board.cpu, second, size)
                key = device.network, device.slot, name
                if here == there:
                    was = self.since.pop(key, None)
                    if was is not None and was[0].tick < self.last_tick:
                        self.gone.setdefault(key, was)
                elif key not in self.since:
                    difference = VariableDifference(
                        self.pair.tick, *key, _value(here), _value(there), clock=self.pair.one.clock
                    )
                    self.since[key] = difference, before
        return slept

    def _traced(self, difference: VariableDifference, before: tuple[Mark, Mark]) -> VariableDifference:
        """`difference` with the instructions that wrote the variable, searched from the look before it differed."""
        self.pair.go_back(before)
        first, second, size = self.places[difference.name]
        watchers = Writes(first, size), Writes(second, size)
        for world, watcher in zip((self.pair.one, self.pair.other), watchers, strict=True):
            attach(world.device(difference.network, difference.slot).board.cpu, watcher)
        try:
            self.pair.run_to(difference.tick)
        finally:
            for world, watcher in zip((self.pair.one, self.pair.other), watchers, strict=True):
                detach(world.device(difference.network, difference.slot).board.cpu, watcher)
        writers = [
            None if watcher.last is None else image.place(*watcher.last)
            for image, watcher in zip(self.annotated, watchers, strict=True)
        ]
        return msgspec.structs.replace(difference, writers=tuple(writers))


class Writes(Watcher):
    """Keeps the last instruction that changed one of `size` bytes of internal RAM: (PC, tick)."""

    def __init__(self, first: int, size: int) -> None:
        self.first = first
        self.size = size
        self.value = b""
        self.last: tuple[int, int] | None = None

    def attached(self, cpu: Cpu) -> None:
        self.value = _bytes(cpu, self.first, self.size)

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        now = _bytes(cpu, self.first, self.size)
        if now != self.value:
            self.value = now
            self.last = pc, start * CYCLE_TICKS


def _bytes(cpu: Cpu, first: int, size: int) -> bytes:
    return bytes([cpu.peek_iram(first + offset) for offset in range(size)])


def _value(data: bytes) -> int | str:
    return int.from_bytes(data, "little") if len(data) in _INTEGERS else data.hex(" ")
