"""A robot on the bench: the real image on the board, a transmitter on RXD, a receiver on TXD, no motors."""

from bisect import bisect_right
from dataclasses import dataclass

from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from miro_robot.board import Board
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.plant import IdealWheels
from miro_robot.wiring import load_wiring

MS = 24_000
US = 24
CYCLE = 12
BIT = 2500  # host UART
CHARACTER = 10 * BIT
SAMPLE = 8192
IMAGE = load_hex(image_path())
BOOTED = 4 * MS


def iram(name):
    """Address of a variable of the firmware."""
    symbol = IMAGE.symbols.find(name)
    assert symbol is not None, name
    assert symbol.space == "iram", symbol
    return symbol.address


class Probe(Board):
    """Notes every change of a port the firmware makes. With `deaf` the wire /RD is broken: the bus reads FFh."""

    def __init__(self, *args, **kwargs):
        self.writes = []
        self.deaf = False
        super().__init__(*args, **kwargs)

    def port_written(self, port, latch, tick):
        self.writes.append((tick, port, latch))
        super().port_written(port, latch | 0x02 if port == 2 and self.deaf else latch, tick)


@dataclass
class Command:
    """A command that one LM629 got, complete with its data."""

    tick: int
    opcode: int
    data: bytes


class Rig:
    """One robot, `slot` of `n`. Time is `now`; characters are sent from then on and run by `run_to`."""

    def __init__(self, slot=0, n=3, wiring=None, options=None, plant=None, boot=True):
        self.n = n
        self.board = Probe(wiring or load_wiring(), plant or IdealWheels(), slot, n, options)
        self.cpu = self.board.cpu
        self.board.load(IMAGE)
        self.now = 0
        self.line_free = 0
        self.pending = []
        self.edges = []
        self.received = 0
        if boot:
            self.run_to(BOOTED)
            self.told(self.board.left)
            self.told(self.board.right)

    # ---- time ----------------------------------------------------------------------------------------------

    def run_to(self, tick):
        """Runs the board; no fault may come up."""
        while self.now < tick:
            until = min(tick, self.now + 100 * MS)
            while self.pending and self.pending[0][0] < until:
                self.cpu.rxd.append(*self.pending.pop(0))
            self.cpu.rxd.settled_tick = until + MS
            self.board.run(until)
            self.now = until
            self._listen()
        assert self.board.faults == [], self.board.faults

    def run_ms(self, ms):
        self.run_to(self.now + int(ms * MS))

    # ---- radio -------------------------------------------------------------------------------------------

    def send(self, data, at=None, bit=BIT, pauses=()):
        """Puts characters on RXD from tick `at` (default: as soon as the line is free).

        `pauses[i]` ticks follow character i. Returns the tick of the last start bit."""
        extra = list(pauses)
        tick = max(self.now + CYCLE, self.line_free) if at is None else at
        for index, byte in enumerate(data):
            start = tick
            self.send_symbol((byte, True, tick), bit)
            tick += 10 * bit + (extra[index] if index < len(extra) else 0)
        return start

    def send_symbol(self, symbol, bit=BIT):
        """One character. A damaged one is low through the middle of its stop bit and high before its end."""
        byte, stop_good, tick = symbol
        assert tick >= self.line_free - bit // 4  # a stop bit may be cut, not left out
        bits = [0] + [byte >> i & 1 for i in range(8)]
        self.pending += [(tick + i * bit, level) for i, level in enumerate(bits)]
        self.pending.append((tick + 9 * bit + (0 if stop_good else 3 * bit // 4), 1))
        if not stop_good:
            self.pending.insert(-1, (tick + 9 * bit, 0))
        self.line_free = tick + 10 * bit

    def team(self, seq, left, right, ask=False, slot=0):
        """Sends a team frame in which `slot` gets these velocities; runs until it has been dealt with."""
        pairs = [(0, 0)] * self.n
        pairs[slot] = (left, right)
        return self.frame(encode(TeamFrame(3 if ask else 0, seq, tuple(pairs)), self.n))

    def service(self, seq, slot, opcode, *values):
        return self.frame(encode(ServiceFrame(seq, slot, opcode, values), self.n))

    def frame(self, data, settle_ms=4):
        """Sends one frame and runs until it has been dealt with; returns the start of its last character."""
        last = self.send(data)
        self.run_to(last + CHARACTER + int(settle_ms * MS))
        return last

    # ---- what came of it -----------------------------------------------------------------------------------

    def _listen(self):
        """Takes over the edges of TXD."""
        line = self.cpu.txd
        self.edges += [edge for edge in line.edges() if not self.edges or edge[0] > self.edges[-1][0]]

    def sent(self):
        """Characters on TXD so far, sampled in the middle of 2500-tick bits from each start edge."""
        ticks = [tick for tick, _ in self.edges]

        def level_at(tick):
            before = bisect_right(ticks, tick)
            return self.edges[before - 1][1] if before else 1

        symbols, free = [], 0
        for tick, level in self.edges:
            if level or tick < free:
                continue
            bits = [level_at(tick + BIT // 2 + i * BIT) for i in range(10)]
            byte = sum(bit << i for i, bit in enumerate(bits[1:9]))
            symbols.append((byte, bits[9] == 1, tick))
            free = tick + 9 * BIT + BIT // 2
        return symbols

    def told(self, chip):
        """The commands that `chip` got since the last call."""
        commands = [Command(*command) for command in chip.commands]
        chip.commands.clear()
        return commands

    def u8(self, name):
        return self.cpu.peek_iram(iram(name))

    def u16(self, name):
        address = iram(name)
        return self.cpu.peek_iram(address) | self.cpu.peek_iram(address + 1) << 8

    def i16(self, name):
        value = self.u16(name)
        return value - 0x10000 if value & 0x8000 else value

    @property
    def counters(self):
        """(accepted, rejected, stale)"""
        return self.u16("_frames_accepted"), self.u16("_frames_rejected"), self.u16("_frames_stale")
