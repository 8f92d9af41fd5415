"""The input on RXD of a single board: bytes from a file or a keyboard, as another machine would send them.

                    REN is set, a time,           back to back at the line's rate, whatever RI says
                    a text on TXD                 │
    piece ── waits ──────┴──> character character character ──> the next piece

The order of things: a piece begins when its condition is met. The first one without a condition begins when the program
listens: its receiver is on, or, where `baud` is given, it polls P3 as a program does that measures the first character.
The line has the rate `baud`, or that of the receiver when a character begins; while the receiver is off, the rate that
it had. A character that the program does not take in time is lost, as on silicon.

With `wait` each character waits instead until the program has taken the one before: its receiver is on with RI down,
or it polls P3.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK, Octets, Rows
from miro_robot.empty_board import EmptyBoard
from miro_robot.mcs51.cpu import Cpu
from miro_sim.scenario.terminal import RXD, InputPiece, PinEvent, TerminalSpec

SLICE = 1_000  # cycles between two looks at what is to be sent
_CLOCK_SLICE = 100  # ... while the receiver is on and its clock has not overflowed yet
MARGIN_TICKS = 240  # the CPU may look this far beyond the end of a run
_IDLE_SLICE = 200_000  # cycles between two looks when nothing is left to send
_POLLS = 32  # reads of P3 within a slice that count as listening on RXD
_SCON, _SM0, _SM1, _REN, _RI = 0x98, 0x80, 0x40, 0x10, 0x01
_CHARACTER_BITS = 10  # and one more in the modes of 9 bits, whose ninth is sent as 1
_TICKS_PER_BIT = 32  # of the fastest receiver there is: mode 2 with SMOD
_LONGEST = 1 << 30  # bytes of a saved piece
_MOST_RXD = 2_000  # edges of RXD handed over at a time: the line keeps 4096


class SerialInput:
    """Sends `pieces` to the serial port of `cpu`, bit by bit at `baud`, or at the rate that its receiver is set to.

    `gap_ticks`: least time from the end of a character to the start of the next. `live`: more may be added any time.
    `wait`: each character waits until the program listens. Raises ValueError for a rate that the crystal does not
    allow.
    """

    STATE = {
        "pieces": Rows(
            *(1 << 16, ("s", _LONGEST), ("s", _LONGEST), ("q", -1, NEVER_TICK)),
            split=lambda piece: (
                piece.data,
                piece.when,
                -1 if piece.delay_ticks is None else piece.delay_ticks,
            ),
            make=lambda cells: InputPiece(cells[0], cells[1], None if cells[2] < 0 else cells[2]),
        ),
        "fed": TICK,
        "tail": Octets(_LONGEST),
        "begin_tick": TICK,
        "char_start": TICK,
        "char_end": TICK,
        "polls": TICK,
        "bit_ticks": ("q", 0, 1 << 40),
    }
    NOT_HASHED = ("pieces",)
    """Pieces that wait to be sent.

    They may be long, and the time of their addition changes nothing before they are sent.
    """
    NOT_STATE = ("seen", "cpu", "baud", "crystal_hz", "gap_ticks", "live", "wait")

    def __init__(
        self,
        cpu: Cpu,
        pieces: tuple[InputPiece, ...],
        baud: int | None,
        crystal_hz: int,
        gap_ticks: int = 0,
        live: bool = False,
        wait: bool = False,
    ) -> None:
        fastest = crystal_hz // _TICKS_PER_BIT
        if baud is not None and not 50 <= baud <= fastest:
            raise ValueError(f"baud {baud} is outside 50..{fastest} at {crystal_hz} Hz")
        self.cpu = cpu
        self.pieces = list(pieces)  # those not sent yet, the one being sent first
        self.baud = baud
        self.crystal_hz = crystal_hz
        self.gap_ticks = gap_ticks
        self.live = live
        self.wait = wait
        self.fed = 0  # bytes of the first piece that are on their way or received
        self.tail = b""  # of what the program sent, as long as the text waited for
        self.seen: Counter[bytes] = Counter()  # how often each text was sent while it was waited for
        self.begin_tick = 0  # the first piece begins; NEVER_TICK until its text was sent
        self.char_start = self.char_end = 0  # of the last character, which may be to come
        self.polls = 0  # reads of P3 so far
        self.bit_ticks = 0  # as the receiver was last set, 0 while that is not known
        self._arm()

    def add(self, data: bytes) -> None:
        """More input, to be sent as if its condition were met now."""
        self.pieces.append(InputPiece(data, delay_ticks=0))
        if len(self.pieces) == 1:
            self._arm()

    def heard(self, value: int, tick: int) -> None:
        """The program has sent a character, whose stop bit began at `tick`."""
        if self.waiting_for and tick >= self.char_start:
            self.tail = (self.tail + bytes([value]))[-len(self.waiting_for) :]
            if self.tail == self.waiting_for:
                self.seen[self.tail] += 1
                self.begin_tick = tick + (self.pieces[0].delay_ticks or 0)

    @property
    def waiting_for(self) -> bytes:
        """The text that the program has to send before anything more is typed; empty if none."""
        return self.pieces[0].when if self.pieces and self.begin_tick == NEVER_TICK else b""

    @property
    def left(self) -> int:
        """Bytes still to be sent."""
        remaining = -self.fed
        for piece in self.pieces:
            remaining += len(piece.data)
        return remaining

    @property
    def waits_for_receiver(self) -> bool:
        """True if the first piece begins when the receiver is switched on."""
        return bool(self.pieces) and self.fed == 0 and not self.waiting_for

    def feed(self) -> int:
        """Puts on RXD what begins soon, and says up to which cycle to run now."""
        now = self.cpu.cycles
        self.bit_ticks = self.cpu.peripherals.bit_ticks() or self.bit_ticks
        receiving = self._receiving()
        reads = self.cpu.peripherals.p3_reads
        polling = self.baud is not None and reads - self.polls >= _POLLS
        self.polls = reads
        end = now + (_CLOCK_SLICE if receiving and not self.baud and not self.bit_ticks else SLICE)
        while self.pieces and self._listening(now, receiving, polling):
            start = max(self.begin_tick, 12 * now + MARGIN_TICKS)
            if self.char_end:
                start = max(start, self.char_end + self.gap_ticks)
            if start >= 12 * end + 2 * MARGIN_TICKS:
                break
            self._send(start)
        if self.live or (self.pieces and not self.waiting_for):
            self.cpu.rxd.settled_tick = 12 * end + MARGIN_TICKS
        else:
            self.cpu.rxd.settled_tick = NEVER_TICK
        return end if self.live or self.pieces else now + _IDLE_SLICE

    def _receiving(self) -> bool:
        """True if the receiver is on, in a mode that takes characters."""
        control = self.cpu.sfr(_SCON)
        return bool(control & _REN and control & (_SM0 | _SM1))

    def _listening(self, now: int, receiving: bool, polling: bool) -> bool:
        """True if the next character may be sent, as far as the program has a say in it."""
        if not self.baud and not self.bit_ticks:
            return False
        condition = self.fed == 0 and self.pieces[0].has_condition
        if not self.wait:
            return receiving or polling or condition or self.char_end > 0
        if 12 * now < self.char_end or (receiving and self.cpu.sfr(_SCON) & _RI):
            return False
        return receiving or polling or (condition and self.baud is not None)

    def _send(self, start: int) -> None:
        """Start bit, eight data bits, stop bit; in the modes of 9 bits a ninth before it, which has its level."""
        bits = self.pieces[0].data[self.fed] << 1 | 1 << (_CHARACTER_BITS - 1)
        for number in range(_CHARACTER_BITS):
            self.cpu.rxd.append(start + self._bit_offset(number), bits >> number & 1)
        count = _CHARACTER_BITS + (self.cpu.sfr(_SCON) & _SM0 != 0)
        self.char_start, self.char_end = start, start + self._bit_offset(count)
        self.fed += 1
        if self.fed == len(self.pieces[0].data):
            self.pieces.pop(0)
            self._arm()

    def _arm(self) -> None:
        """Sets up the piece that is now the first."""
        self.fed = 0
        self.tail = b""
        while self.pieces and not self.pieces[0].data:
            self.pieces.pop(0)
        if self.pieces:
            piece = self.pieces[0]
            self.begin_tick = NEVER_TICK if piece.when else self.char_end + (piece.delay_ticks or 0)

    def after_load(self) -> None:
        """Raises ValueError for more characters on their way than the first piece has."""
        available = len(self.pieces[0].data) if self.pieces else 1
        if self.fed >= available:
            raise ValueError(f"{self.fed} characters of {available} were sent")

    def _bit_offset(self, number: int) -> int:
        """Ticks from the start of a character to its bit `number`."""
        if self.baud is None:
            return number * self.bit_ticks
        return (2 * number * self.crystal_hz + self.baud) // (2 * self.baud)


class PinInput:
    """Passes `events`, sorted by time, to `cpu`. `told(tick, port, levels)` is called for each, too."""

    STATE = {"done": TICK, "levels": ("4B", 0, 0xFF)}
    NOT_STATE = ("cpu", "events", "told", "uses_rxd")

    def __init__(self, cpu: Cpu, events: tuple[PinEvent, ...]) -> None:
        self.cpu = cpu
        self.events = events
        self.uses_rxd = any((event.port, event.bit) == RXD for event in events)
        self.told: Callable[[int, int, int], object] | None = None
        self.done = 0  # events handed over
        self.levels = [0xFF] * 4

    @property
    def next_tick(self) -> int:
        """Tick of the first event that the CPU does not know yet, NEVER_TICK if it knows them all."""
        return self.events[self.done].tick if self.done < len(self.events) else NEVER_TICK

    def feed(self) -> int:
        """Hands over what comes soon, and says up to which cycle the CPU may run before it needs more."""
        end_tick = 12 * (self.cpu.cycles + SLICE) + MARGIN_TICKS
        rxd_edges = 0
        while self.next_tick < end_tick and rxd_edges < _MOST_RXD:
            event = self.events[self.done]
            rxd_edges += (event.port, event.bit) == RXD
            self._push(event)
            self.done += 1
        if self.uses_rxd:
            self.cpu.rxd.settled_tick = self.next_tick
        return max((self.next_tick - MARGIN_TICKS) // 12, self.cpu.cycles + 1)

    def _push(self, event: PinEvent) -> None:
        tick, port, bit, level = event
        if (port, bit) == RXD:
            self.cpu.rxd.append(tick, level)
            return
        levels = self.levels[port] & (0xFF ^ 1 << bit) | level << bit
        if levels != self.levels[port]:
            self.levels[port] = levels
            self.cpu.set_external(port, levels, tick)
            if self.told is not None:
                self.told(tick, port, levels)

    def after_load(self) -> None:
        """Raises ValueError for more events than there are."""
        if self.done > len(self.events):
            raise ValueError(f"{self.done} of {len(self.events)} events were handed over")


def moves(events: tuple[PinEvent, ...]) -> list[tuple[int, int, int]]:
    """Tick, port and all its levels, at each change of a pin that is not RXD."""
    levels, changes = [0xFF] * 4, []
    for tick, port, bit, level in events:
        now = levels[port] & (0xFF ^ 1 << bit) | level << bit
        if (port, bit) != RXD and now != levels[port]:
            levels[port] = now
            changes.append((tick, port, now))
    return changes


class Terminal:
    """Serial input and levels for the pins of `board`, as `spec` says. `next_feed`: cycle of the next look at both.

    Raises ValueError for a rate that the crystal does not allow, and for levels on RXD beside serial input.
    """

    STATE = {"input": SerialInput, "pins": PinInput, "next_feed": TICK}
    NOT_STATE = ("board", "may_send")

    def __init__(self, spec: TerminalSpec, board: EmptyBoard) -> None:
        self.board = board
        self.input = SerialInput(
            board.cpu, spec.pieces, spec.baud, board.spec.crystal_hz, spec.gap_ticks, spec.live, spec.wait
        )
        self.pins = PinInput(board.cpu, spec.pins)
        if self.pins.uses_rxd and (spec.live or self.input.pieces):
            raise ValueError("P3.0 is RXD and cannot be a pin while serial input is sent there")
        self.may_send = bool(spec.live or self.input.pieces or self.pins.uses_rxd)
        self.next_feed = 0
        board.listening = self._listening
        board.input_tick = self.pins.next_tick

    def feed(self) -> None:
        """Puts on the wires what begins soon."""
        self.next_feed = min(self.input.feed(), self.pins.feed())
        self.board.input_tick = self.pins.next_tick

    def _listening(self, tick: int) -> bool:
        """The receiver is on: a piece that waits for it begins now, not only at the next call."""
        if not self.input.waits_for_receiver:
            return False
        self.next_feed = 0
        return True

    def after_load(self) -> None:
        self.board.input_tick = self.pins.next_tick
