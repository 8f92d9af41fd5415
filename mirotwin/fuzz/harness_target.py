"""What targets in a harness have in common: the map, the counters, and what a processor hears of an input."""

from __future__ import annotations

from typing import Any

from miro_protocol.actions import Action, Reset, ScriptItem
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.harness.harness import AHEAD_TICKS, LEAD_TICKS, Harness
from miro_robot.harness.program import INPUTS, RESET_TICKS, Program
from miro_robot.image import Image
from miro_robot.mcs51.cpu import Cpu

MAP_SIZE = 8192
"""Bytes of the edge map. AFL++ is 1.5 times as fast with it as with its own 64 KiB; firmware has some hundred edges."""


class HarnessTarget:
    """`image` in `harness`, fed with what `program` reads. Edges are counted in the map of `use_map`, a writable buffer
    of `map_size` bytes. `slot`: of the robot in its network.
    """

    map_size = MAP_SIZE

    def __init__(self, image: Image, harness: Harness, program: Program, slot: int = 0) -> None:
        self.image = image
        self.input = INPUTS[program.how]
        self.harness = harness
        self.program = program
        self.slot = slot
        self.executions = 0
        self.use_map(bytearray(MAP_SIZE))

    @property
    def cpu(self) -> Cpu:
        return self.harness.cpu

    @property
    def highest_sp(self) -> int:
        return self.cpu.highest_sp

    def use_map(self, edges: Any) -> None:
        self.edges = edges
        self.cpu.watch_edges(memoryview(edges))

    def play(self, data: Any) -> int:
        """Puts the machine back and plays an input; how that ended, as of `Harness.play`."""
        program = self.program
        program.read(data)
        self.executions += 1
        return self.harness.play(program)

    def end_tick(self) -> int:
        """How far the last run went."""
        return self.harness.now_tick

    def script(self, data: bytes) -> list[ScriptItem]:
        """What the processor hears of an input, and its resets, at ticks since power-on."""
        program = self.program
        program.read(data)
        found: list[ScriptItem] = []
        tick = self.harness.begin_tick + LEAD_TICKS
        first = tick
        values = bytearray()
        bad: list[int] = []
        for place in range(program.count):
            value, bad_stop, reset, pause = program.character(place)
            if reset or pause:
                if values:
                    found.append(Transmission(first, DOWN, bytes(values), bad_stop=tuple(bad)))
                    values, bad = bytearray(), []
                if reset:
                    found += self._reset(tick)
                tick += pause
                first = tick
            if bad_stop:
                bad.append(len(values))
            values.append(value)
            tick += program.character_ticks
        if values:
            found.append(Transmission(first, DOWN, bytes(values), bad_stop=tuple(bad)))
        if program.ends_with_reset():
            found += self._reset(tick)
        return found

    def _reset(self, tick: int) -> list[Action]:
        at = tick + AHEAD_TICKS
        return [Reset(at, 0, self.slot, 1), Reset(at + RESET_TICKS, 0, self.slot, 0)]

    def describe(self, data: bytes) -> str:
        """An input as lines, one for each piece of what the processor hears."""
        return "\n".join(described(one) for one in self.script(data))


def described(one: ScriptItem) -> str:
    """One line for people."""
    if isinstance(one, Transmission):
        bad = f", bad stop bits at {', '.join(map(str, one.bad_stop))}" if one.bad_stop else ""
        return f"{one.tick}: {one.data.hex(' ')}{bad}"
    if isinstance(one, Reset):
        return f"{one.tick}: reset {one.level}"
    return str(one)
