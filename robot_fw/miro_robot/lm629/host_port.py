"""The host port: strobes, byte phase, busy bit. Bytes in, words out.

It knows how bytes make words and when the chip does not listen; what a command or a word means is in
`chip.py`. Bus cycles (data sheet, host interface): /CS and /WR low is a write, latched when either goes
high; /CS and /RD low is a read, whose byte is fixed when the strobe begins. With both strobes low the write
wins.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK, Queue
from miro_robot.lm629.options import DEFAULT_OPTIONS, Lm629Options

NOTHING, COMMAND, WORD, ANSWERED, MISUSE = 0, 1, 2, 3, 4
"""Result of a change of the pins: nothing yet; a command byte; a data word from the host (`word`); the host has read
the last word of an answer; the host read or wrote when that was not due (command error).
"""

WHOLE, STUCK, DEAD = 0, 1, 2
"""`broken`, a fault: the port works; stays busy from the next command on, reset after reset; or takes nothing and
answers FFh."""

OPEN, HARDWARE_RESET, SOFTWARE_RESET = 0, 1, 2
"""`lock`: whether the port works, or answers 00h / 01h to everything until a reset is over."""

_OPEN, _SOFTWARE_RESET = 0, 2
_STUCK, _DEAD = 1, 2
_NOTHING, _COMMAND, _WORD, _ANSWERED, _MISUSE = 0, 1, 2, 3, 4
_RECORD = 16  # data bytes of the longest command, LTRJ with three parameters, and two more
_BYTE = ("i", 0, 0xFF)
_IGNORED, _ACCEPTED, _REFUSED = 0, 1, 2  # what will become of the strobe that is in progress


class HostPort:
    """The bus side of the chip.

    `words_left` words are due, from the host if `incoming`. `answer` holds what a reading command says, 16
    bits per word. `buffer` is the last data byte that passed. `record` collects the data bytes of the
    command in progress. `writes_while_busy` counts writes that were lost because the chip was busy or in
    reset.
    """

    STATE = {
        "ps": FLAG,
        "data": _BYTE,
        "writing": FLAG,
        "reading": FLAG,
        "fate": ("i", 0, 2),
        "drive": _BYTE,
        "busy_until": TICK,
        "writes_while_busy": TICK,
        "buffer": _BYTE,
        "lock": ("i", 0, 2),
        "command": _BYTE,
        "abandoned": FLAG,
        "words_left": ("i", 0, 7),
        "incoming": FLAG,
        "low_next": FLAG,
        "word": ("i", 0, 0xFFFF),
        "answer": ("q", 0, 0xFFFFFFFF),
        "record": Queue("B", _RECORD, "recorded"),
        "broken": ("i", 0, 2),
    }
    NOT_HASHED = ("broken",)  # what it does to the rest is hashed
    NOT_STATE = ("busy_ticks", "judged_at_end", "reset_status", "keeps_phase", "undue_flags", "status_flags")

    def __init__(self, busy_ticks: int, options: Lm629Options = DEFAULT_OPTIONS) -> None:
        self.busy_ticks = busy_ticks
        self.judged_at_end = 1 if options.busy_judged == "end" else 0
        self.reset_status = 1 if options.software_reset_busy else 0
        self.keeps_phase = 0 if options.command_resets_phase else 1
        self.undue_flags = 1 if options.undue_data_flags else 0
        self.status_flags = 1 if options.status_read_flags else 0
        self.ps = 1
        self.data = 0xFF
        self.writing = 0
        self.reading = 0
        self.fate = _IGNORED
        self.drive = 0
        self.writes_while_busy = 0
        self.buffer = 0
        self.broken = WHOLE
        self.reset(OPEN)

    def reset(self, lock: int) -> None:
        """Forget the command in progress, and whatever strobe is on its way."""
        # Levels of the pins are not reset: they are the host's, and a strobe may be low.
        self.lock = lock
        self.busy_until = 0
        self.fate = _IGNORED
        self.command = 0
        self.abandoned = 0
        self.words_left = 0
        self.incoming = 0
        self.low_next = 0
        self.word = 0
        self.answer = 0
        self.record = bytearray(_RECORD)
        self.recorded = 0

    def is_busy(self, tick: int) -> bool:
        return self.lock != _OPEN or tick < self.busy_until or self.broken == _DEAD

    def status(self, tick: int, flags: int) -> int:
        """The status byte, given the flags of bits 7..1."""
        if self.broken == _DEAD:
            return 0xFF
        if self.lock != _OPEN:
            return self.reset_status if self.lock == _SOFTWARE_RESET else 0
        return flags | 1 if tick < self.busy_until else flags

    def pins(self, tick: int, cs: int, rd: int, wr: int, ps: int, data: int, flags: int) -> int:
        """New pin levels from `tick` on; returns what that led to. `flags`: status bits 7..1 just now."""
        writing = 1 if cs == 0 and wr == 0 else 0
        # With both strobes low the write wins (B4).
        reading = 1 if cs == 0 and rd == 0 and wr != 0 else 0
        outcome = _NOTHING
        # What was under way ends before anything begins: one change of the pins may do both.
        if self.writing and not writing:
            outcome = self._write_ends(tick)
        elif self.reading and not reading:
            outcome = self._read_ends(tick)
        # The byte taken is the one before the edge: the data sheet requires hold times.
        self.ps = ps
        self.data = data
        if writing and not self.writing:
            self._write_begins(tick)
        elif reading and not self.reading:
            self._read_begins(tick, flags)
        self.writing = writing
        self.reading = reading
        return outcome

    def _write_begins(self, tick: int) -> None:
        self.fate = _ACCEPTED
        if self.lock != _OPEN or (self.is_busy(tick) and not self.judged_at_end):
            self.fate = _IGNORED
            self.writes_while_busy += 1

    def _read_begins(self, tick: int, flags: int) -> None:
        self.fate = _IGNORED
        # Status may be read at any time, and leaves a word in progress alone (SNVS781, host interface).
        if self.ps == 0:
            self.drive = self.status(tick, flags)
            if self.status_flags and self.words_left > 0 and self.incoming and not self.is_busy(tick):
                self.fate = _REFUSED
        elif self.broken == _DEAD:
            self.drive = 0xFF
        elif self.is_busy(tick):
            self.drive = self.buffer
        elif self.words_left > 0 and not self.incoming:
            self.fate = _ACCEPTED
            # High word and high byte first (SNVS781, data I/O).
            self.drive = self.answer >> (16 * self.words_left - 8 * self.low_next - 8) & 0xFF
        else:
            self.drive = self.buffer
            if self.undue_flags or self.words_left > 0:
                self.fate = _REFUSED

    def _write_ends(self, tick: int) -> int:
        if self.fate == _IGNORED:
            return _NOTHING
        if self.judged_at_end and self.is_busy(tick):
            self.writes_while_busy += 1
            return _NOTHING
        if self.ps == 0:
            # A command that comes before the last word of the one before it drops that one (E3).
            self.abandoned = 1 if self.words_left > 0 else 0
            # The byte at the end of the strobe: what was on the bus before does not count.
            self.command = self.data
            self.words_left = 0
            self.low_next = self.low_next if self.keeps_phase else 0
            self.recorded = 0
            if self.low_next:
                # The half word before goes on in this command (B3, the other reading).
                self._record(self.word >> 8)
            self._be_busy(tick)
            return _COMMAND
        if self.words_left == 0 or not self.incoming:
            return _MISUSE if self.undue_flags or self.words_left > 0 else _NOTHING
        self.buffer = self.data
        self._record(self.data)
        if not self.low_next:
            self.word = self.data << 8
            self.low_next = 1
            return _NOTHING
        self.word = self.word & 0xFF00 | self.data
        self._word_is_over(tick)
        return _WORD

    def _read_ends(self, tick: int) -> int:
        if self.fate == _REFUSED:
            return _MISUSE
        if self.fate == _IGNORED:
            return _NOTHING
        self.buffer = self.drive
        self._record(self.drive)
        if not self.low_next:
            self.low_next = 1
            return _NOTHING
        self._word_is_over(tick)
        return _ANSWERED if self.words_left == 0 else _NOTHING

    def _record(self, byte: int) -> None:
        """A data byte of the command in progress. No command has more than there is room for; a loaded state may."""
        if self.recorded < _RECORD:
            self.record[self.recorded] = byte
            self.recorded += 1

    def data_bytes(self) -> bytes:
        """The data bytes of the command in progress."""
        return bytes(self.record[: self.recorded])

    def _word_is_over(self, tick: int) -> None:
        self.low_next = 0
        self.words_left -= 1
        self._be_busy(tick)

    def _be_busy(self, tick: int) -> None:
        # One busy time for commands and words, inside the sheet's 15 to 25 us (B1).
        self.busy_until = tick + self.busy_ticks if self.broken != _STUCK else NEVER_TICK

    def expect(self, words: int) -> None:
        """The command in progress wants `words` more words from the host."""
        self.words_left = words
        self.incoming = 1

    def reply(self, words: int, value: int) -> None:
        """The command in progress answers with `words` words, high word first."""
        self.words_left = words
        self.incoming = 0
        self.answer = value & (0xFFFFFFFF if words == 2 else 0xFFFF)

    def after_load(self) -> None:
        """Raises ValueError for an answer that no command gives."""
        if not self.incoming and self.words_left > 2:
            raise ValueError(f"words_left is {self.words_left}, but an answer has at most 2 words")
