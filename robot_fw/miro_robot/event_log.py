"""The log of events on a robot's board, with exact ticks: waits, checks and fuzzing read it.

The log is no state: it changes no bit of a run, and a restored board begins a new one.

    kind        code                       value
    RECEIVED    stop bit good (1) or not   the character that the serial port delivered
    SENT        -                          the character whose stop bit begins
    COMMAND     side << 8 | opcode         - (`data`: the data bytes of an LM629 command)
    FAULT       kind of fault              address of the instruction
    REACHED     instructions so far        address of the instruction that is next
    TRUE        -                          - (a predicate of the caller's)
    START_LOST  side                       - (a warning: an STT replaced one that no sample had executed)
    WHEEL_LOST  side                       - (a position error made this LM629 switch its motor off)
    ENDED       -                          address of the instruction (no input can make the program go on)

Parts of a board run ahead of each other, so the log is in the order of noting, not of ticks: sort it by tick.
"""

from __future__ import annotations

RECEIVED, SENT, COMMAND, FAULT, REACHED, TRUE, START_LOST, WHEEL_LOST, ENDED = range(9)
CAPACITY = 2048
_MASK = 2047
_COMMAND = COMMAND


class EventLog:
    """The last 2048 events of one board. `end`: serial number of the next one; `first`: of the oldest kept."""

    NOT_STATE = ("*",)

    def __init__(self) -> None:
        self.end = 0
        self.first = 0
        self._ticks = [0] * 2048
        self._kinds = [0] * 2048
        self._codes = [0] * 2048
        self._values = [0] * 2048
        self._data = [b""] * 2048

    def note(self, kind: int, tick: int, code: int, value: int, data: bytes = b"") -> None:
        """Adds an event."""
        place = self.end & _MASK
        self._ticks[place] = tick
        self._kinds[place] = kind
        self._codes[place] = code
        self._values[place] = value
        if kind == _COMMAND:
            self._data[place] = data
        self.end += 1
        if self.end - self.first > CAPACITY:
            self.first = self.end - CAPACITY

    def event(self, serial: int) -> tuple[int, int, int, int, bytes]:
        """(tick, kind, code, value, data). Raises IndexError for an event that is not kept."""
        if not self.first <= serial < self.end:
            raise IndexError(f"event {serial} is not among {self.first} to {self.end - 1}")
        place = serial & _MASK
        tick, kind, code = self._ticks[place], self._kinds[place], self._codes[place]
        return tick, kind, code, self._values[place], self._data[place] if kind == COMMAND else b""

    def cut(self, serial: int) -> None:
        """Forgets the events from `serial` on: the board goes back to before them."""
        if serial < self.end:
            self.end = max(serial, 0)
            self.first = min(self.first, self.end)

    def __repr__(self) -> str:
        return f"EventLog(events {self.first} to {self.end - 1})"
