"""What a bare processor hears, played from power-on: without a saved moment, and without a harness."""

from __future__ import annotations

from collections.abc import Sequence

from miro_exact.bad_input import BadInput
from miro_protocol.actions import Reset, ScriptItem
from miro_protocol.transmission import Transmission
from miro_robot.harness.harness import SETTLE_TICKS
from miro_robot.harness.recording_bus import LONGEST_ANSWER_TICKS
from miro_robot.image import Image
from miro_robot.mcs51.uart import STOPPED_TICK
from mirotwin.verify.bare.exchange import NamedCheck
from mirotwin.verify.bare.machine import CHARACTER_BITS, BareLine, BareProcessor

AHEAD_TICKS = 240  # the CPU may look so far beyond the end of a run
_LOOK = 2_000  # cycles between two looks at whether firmware sleeps


class BarePlayback:
    """`image` from power-on, which hears a script. `play` goes to `end_tick`, and on until it has sent what it had if
    it sleeps.

    `idle`: it slept within the last 30 ms (at 24 MHz) before the end, or `sleeps` says that it never does.
    """

    def __init__(
        self, image: Image, line: BareLine, heard: Sequence[ScriptItem], end_tick: int, source: str = ""
    ) -> None:
        self.processor = BareProcessor(image)
        self.line = line
        self.source = source
        self.end_tick = end_tick
        self.idle = True
        self.sleeps = False
        self._end_of_last = 0
        self._next = 0
        first = min((one.tick - AHEAD_TICKS for one in heard), default=line.begin_tick)
        self._inputs: list[tuple[int, ScriptItem | None]] = [(max(0, min(line.begin_tick, first)), None)]
        for one in heard:
            early = AHEAD_TICKS if isinstance(one, Transmission) else 0
            self._inputs.append((one.tick - early, one))

    def play(self) -> BarePlayback:
        """To the end."""
        if self.to(min(self._inputs[-1][0], self.end_tick)):
            self._end(self.end_tick)
        return self

    def to(self, tick: int) -> bool:
        """Runs on to `tick`, and hears what comes up to there; False after a fault."""
        while self._next < len(self._inputs):
            at, one = self._inputs[self._next]
            if at > max(tick, 12 * self.processor.cpu.cycles):
                break
            if not self._to(at):
                return False
            self._next += 1
            self._hear(one)
        return self._to(tick)

    def put_back(self) -> None:
        """Its processor was put back to an earlier moment."""
        bus, now = self.processor.bus, 12 * self.processor.cpu.cycles
        self._next = sum(at <= now for at, _ in self._inputs)
        self._end_of_last = 0
        if bus.fault_tick > now:
            bus.fault_kind = 0

    def verdict(self, check: NamedCheck | None) -> str:
        """What the check says is wrong, or the empty string. Without a check, faults count."""
        fault = self.processor.fault()
        if fault is not None or check is None:
            return str(fault or "")
        return check.judge(self.processor.exchange()) or ""

    def _to(self, tick: int) -> bool:
        """Runs on; False after a fault."""
        cycle = (tick + 11) // 12
        if cycle > self.processor.cpu.cycles:
            self.processor.cpu.run(cycle)
        return not self.processor.bus.fault_kind

    def _begin(self) -> None:
        cpu = self.processor.cpu
        self.processor.begin_tick = 12 * cpu.cycles
        self.sleeps = bool(cpu.idle or cpu.idle_cycles)
        self.processor.bus.begin()

    def _hear(self, one: ScriptItem | None) -> None:
        if one is None:
            self._begin()
        elif isinstance(one, Transmission):
            self._characters(one)
        elif isinstance(one, Reset):
            self._reset(one)

    def _characters(self, sent: Transmission) -> None:
        if sent.tick < self._end_of_last:
            what = f"the characters at tick {sent.tick} begin before those before them end"
            raise BadInput(self.source, "", what, f"leave {self._end_of_last - sent.tick} ticks between them")
        bit, rxd, tick = self.line.bit_ticks, self.processor.cpu.rxd, sent.tick
        for at, value in enumerate(sent.data):
            for place, level in enumerate((0, *(value >> place & 1 for place in range(8)))):
                rxd.append(tick + place * bit, level)
            stop = tick + (CHARACTER_BITS - 1) * bit
            if at in sent.bad_stop:
                rxd.append(stop, 0)
                stop += 3 * bit // 4
            rxd.append(stop, 1)
            tick += CHARACTER_BITS * bit
        self._end_of_last = tick

    def _reset(self, action: Reset) -> None:
        if action.level:
            self.processor.cpu.hold()
        else:
            self.processor.cpu.reset()
            self.processor.bus.reset_tick = action.tick

    def _end(self, end_tick: int) -> None:
        cpu = self.processor.cpu
        if not self._to(end_tick - SETTLE_TICKS):
            return
        idle_cycles = cpu.idle_cycles
        if not self._to(end_tick) or not self.sleeps:
            return
        self.idle = cpu.idle_cycles > idle_cycles
        last = 12 * cpu.cycles + LONGEST_ANSWER_TICKS
        while self.idle and not self._is_done() and 12 * cpu.cycles < last:
            if not self._to(12 * (cpu.cycles + _LOOK)):
                return

    def _is_done(self) -> bool:
        cpu = self.processor.cpu
        return bool(cpu.powered_down or (cpu.idle and cpu.peripherals.uart.ti_tick() >= STOPPED_TICK))
