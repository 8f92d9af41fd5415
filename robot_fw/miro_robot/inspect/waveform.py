"""Writes the wires of a board as a VCD file, with a save file for GTKWave.

Time stamps are nanoseconds, rounded down (tick * 125 // 3 at 24 MHz, as in recordings): a crystal's period fits no
decimal timescale, and this one loses nothing, since rounding up gives the tick again.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from typing import IO, Any, NamedTuple

from vcd.gtkw import GTKWSave
from vcd.writer import VCDWriter

from miro_exact.clock import NS_PER_SECOND, TICKS_PER_SECOND, nanoseconds
from miro_robot.board import Board
from miro_robot.inspect.tap import PLACES, UNKNOWN, CpuTap, port_pins
from miro_robot.inspect.watcher import attach, detach
from miro_robot.mcs51.cpu import Cpu
from miro_robot.processor_board import ProcessorBoard
from miro_robot.wired_board import WiredBoard

TOP = "robot"


class Signal(NamedTuple):
    """`place`: where the tap notes it (`tap.PLACES`), a net by its number (`net0`), or a port of the CPU, whose pins
    have several sources.
    """

    name: str
    scope: str
    bits: int
    place: str
    meaning: str

    def wires(self) -> list[str]:
        """Names of its wires, low bit first."""
        return [self.name] if self.bits == 1 else [f"{self.name}{bit}" for bit in range(self.bits)]

    def path(self, wire: str) -> str:
        """A wire's name with its scopes."""
        return ".".join([TOP, *([self.scope] if self.scope else []), wire])

    def places(self) -> list[int]:
        """Places in the tap from whose levels it is computed."""
        if self.place in PLACES:
            return [PLACES.index(self.place)]
        if self.place.startswith("net"):
            return [len(PLACES) + int(self.place[3:])]
        port = int(self.place[4:])
        return [_LATCH + port, _OUTSIDE + port, *((_RXD, _TXD, _SHIFT) if port == 3 else ())]

    @property
    def on_board(self) -> bool:
        """True if a CPU alone does not have it."""
        return self.place == "data" or "." in self.place


def _chip(side: str) -> list[Signal]:
    pins = [
        ("cs_n", 1, "cs", "/CS"),
        ("rd_n", 1, "rd", "/RD"),
        ("wr_n", 1, "wr", "/WR: the byte is taken when it or /CS rises"),
        ("ps", 1, "ps", "PS: 0 command and status, 1 data"),
        ("rst_n", 1, "rst", "/RST"),
        ("busy", 1, "busy", "takes no byte now: busy bit, or in reset"),
        ("hi", 1, "hi", "HI, host interrupt, active high"),
        ("pwm", 1, "pwm", "magnitude pin, the L298's EN: the pulses themselves"),
        ("sign", 1, "sign", "sign pin, the L298's direction: 1 backward"),
        ("magnitude", 7, "magnitude", "of the pulses, in 1/128 of a period (0..127), from its sample on"),
        ("a", 1, "a", "encoder channel A"),
        ("b", 1, "b", "encoder channel B; A leads it forward"),
    ]
    return [Signal(f"{side}_{name}", side, bits, f"{side}.{place}", text) for name, bits, place, text in pins]


_SOURCES = ("int0", "timer0", "int1", "timer1", "serial", "timer2")

SIGNALS = (
    Signal("rxd", "", 1, "rxd", "from the radio receiver to P3.0"),
    Signal("txd", "", 1, "txd", "from P3.1 to the telemetry transmitter"),
    Signal("asleep", "cpu", 1, "asleep", "in idle mode, or powered down"),
    Signal("low_priority", "cpu", 1, "low", "an interrupt routine of low priority is in service"),
    Signal("high_priority", "cpu", 1, "high", "... of high priority"),
    *(Signal(f"isr_{name}", "cpu", 1, name, f"the routine of {name} is in service") for name in _SOURCES),
    Signal("d", "bus", 8, "data", "D0..D7 of both LM629"),
    *_chip("left"),
    *_chip("right"),
    *(Signal(f"p{port}_", "ports", 8, f"port{port}", f"pins of P{port}") for port in range(4)),
)


def net_signals(names: Sequence[str]) -> list[Signal]:
    """The nets of a board of parts. A dot in a name would be a scope to viewers."""
    signals: dict[str, Signal] = {}
    for number, net in enumerate(names):
        name = net.replace(".", "_")
        while name in signals:
            name += "_"
        signals[name] = Signal(name, "nets", 1, f"net{number}", f"net {net}")
    return list(signals.values())


SETTLING_TICKS = 4096
"""After it begins to look on in mid-run, so long a level may still be on its way: encoder edges are reported up to a
step of the plant (2048 ticks) late, and the CPU may be four cycles ahead."""
_RXD, _TXD, _SHIFT, _LATCH, _OUTSIDE = map(PLACES.index, ("rxd", "txd", "shift", "latch0", "outside0"))


class Waveform:
    """Writes the wires of `cpu`, and of the `board` around it, to `out` while both run.

    Between `attach` and `close`; or give its `tap` to the CPU's inspector yourself. The file covers the ticks from
    `first_tick`, or from `attach` if that is later, to `end_tick`, or as far as all levels are known. `tick_hz` is
    the crystal of a CPU without a board.
    """

    def __init__(
        self,
        out: IO[str],
        board: ProcessorBoard | None = None,
        first_tick: int = 0,
        end_tick: int | None = None,
        tick_hz: int = TICKS_PER_SECOND,
    ) -> None:
        if end_tick is not None and end_tick <= first_tick:
            raise ValueError(f"ticks {first_tick} to {end_tick}: the window is empty")
        robot = isinstance(board, Board)
        nets = net_signals(board.nets.names) if isinstance(board, WiredBoard) else []
        self.signals = (*(signal for signal in SIGNALS if robot or not signal.on_board), *nets)
        self.tap = CpuTap(board, self._flush)
        self.end_tick = end_tick
        self.tick_hz = tick_hz
        self.written_tick = -1
        self._first_tick = first_tick
        self._out = out
        self._cpu: Cpu | None = None
        self._writer: VCDWriter | None = None
        self._levels: list[int] = []
        self._shown: list[int] = []
        self._variables: list[list[Any]] = []
        self._places = [signal.places() for signal in self.signals]
        self._affected = [
            [index for index, places in enumerate(self._places) if place in places]
            for place in range(len(PLACES) + len(nets))
        ]

    def attach(self, cpu: Cpu) -> Waveform:
        """Looks on from the next run of `cpu` on, whose board was given."""
        try:
            attach(cpu, self.tap)
        except ValueError:
            detach(cpu, self.tap)
            raise
        self._cpu = cpu
        return self

    def pin_moved(self, tick: int, port: int, levels: int) -> None:
        """The outside puts `levels` on a port of a CPU without a board; told before the CPU runs that far."""
        self.tap.events.append((tick, _OUTSIDE + port, levels))

    @property
    def first_tick(self) -> int:
        """First tick of the file."""
        begin = self.tap.begin_tick
        return max(self._first_tick, begin + SETTLING_TICKS if begin > 0 else 0)

    @property
    def begun(self) -> bool:
        """True if the window was reached."""
        return self._writer is not None

    def close(self) -> None:
        """Looks on no more and writes what is known, up to `written_tick`. Raises ValueError for an empty window."""
        if self._cpu is not None:
            detach(self._cpu, self.tap)
            self._cpu = None
        if self.tap.begin_tick >= 0:
            self.tap.take()
            self._flush()
            self.tap.detach()
        if self._writer is None:
            raise ValueError(f"the run ended before tick {self.first_tick}, nothing was written")
        self._writer.close(nanoseconds(self.written_tick, self.tick_hz))

    def _flush(self) -> None:
        """Writes all changes that nothing can come before any more."""
        known_tick = self.tap.known()
        if self.end_tick is not None:
            known_tick = min(known_tick, self.end_tick)
        if not self._levels:
            self._levels = list(self.tap.start)
        events = self.tap.events
        events.sort(key=itemgetter(0))
        done = 0
        while done < len(events) and events[done][0] < known_tick:
            tick = events[done][0]
            if self._writer is None and tick > self.first_tick:
                self._begin()
            changed: set[int] = set()
            while done < len(events) and events[done][0] == tick:
                _, place, level = events[done]
                self._levels[place] = level
                changed.update(self._affected[place])
                done += 1
            if self._writer is not None:
                self._show(tick, changed)
        del events[:done]
        if self._writer is None and known_tick > self.first_tick:
            self._begin()
        self.written_tick = known_tick

    def _begin(self) -> None:
        """The header, and the levels at the beginning of the window."""
        self._writer = VCDWriter(
            self._out,
            timescale="1 ns",
            date="1970-01-01",  # of no run: equal runs have equal files
            version="mirotwin",
            comment=_ticks_in_words(self.tick_hz),
            check_values=False,
            init_timestamp=nanoseconds(self.first_tick, self.tick_hz),
        )
        self._shown = [self._level_of(index) for index in range(len(self.signals))]
        for signal, level in zip(self.signals, self._shown, strict=True):
            scope = (TOP, signal.scope) if signal.scope else (TOP,)
            self._variables.append(
                [
                    self._writer.register_var(scope, wire, "wire", 1, _bit(signal, level, bit))
                    for bit, wire in enumerate(signal.wires())
                ]
            )

    def _show(self, tick: int, changed: set[int]) -> None:
        assert self._writer is not None
        stamp = nanoseconds(tick, self.tick_hz)
        for index in sorted(changed):
            signal = self.signals[index]
            level = self._level_of(index)
            if level == self._shown[index]:
                continue
            for bit, variable in enumerate(self._variables[index]):
                self._writer.change(variable, stamp, _bit(signal, level, bit))
            self._shown[index] = level

    def _level_of(self, index: int) -> int:
        """Present level of a signal's wires; the pin of a port is the AND of all its drivers."""
        place, *more = self._places[index]
        return port_pins(self._levels, place - _LATCH) if more else self._levels[place]


def _ticks_in_words(tick_hz: int) -> str:
    if tick_hz == TICKS_PER_SECOND:
        return "ticks of 24 MHz as ns = tick * 125 // 3"
    return f"ticks of {tick_hz} Hz as ns = tick * {NS_PER_SECOND} // {tick_hz}"


def _bit(signal: Signal, level: int, bit: int) -> int | str:
    return "x" if signal.bits == 1 and level == UNKNOWN else level >> bit & 1


_CLOSED = ("ports",)
"""Groups that are folded at first: most pins are there as what they are wired to already."""
_ZOOM = -22.0  # about one control period on a screen


def write_save_file(out: IO[str], vcd_name: str, signals: Sequence[Signal] = SIGNALS) -> None:
    """Writes the save file for the VCD called `vcd_name` in the same folder. No wall clock, no absolute path."""
    save = GTKWSave(out)
    save.dumpfile(vcd_name, abspath=False)
    save.zoom_markers(_ZOOM)
    save.sst_expanded(False)
    for scope in dict.fromkeys(signal.scope for signal in signals):
        with save.group(scope or "link", closed=scope in _CLOSED):
            for signal in signals:
                if signal.scope == scope:
                    _trace(save, signal)


def _trace(save: GTKWSave, signal: Signal) -> None:
    wires = [signal.path(wire) for wire in signal.wires()]
    if signal.bits == 1:
        save.trace(wires[0])
        return
    name = f"{signal.name.rstrip('_')}[{signal.bits - 1}:0]"
    save.trace_combined(name, wires[::-1], datafmt="dec" if "magnitude" in name else "hex")
