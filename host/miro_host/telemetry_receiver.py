"""The robots' answers at the PC: the last one of each, with the encoder positions unwrapped.

A frame carries the low 16 bits of each encoder count. The full count is taken as the one nearest to the count before; a
robot boots at 0. This is right as long as a wheel turns by less than 32768 counts between two answers that arrive: for
0.17 s at 1.46 m/s, for 1.2 s at 0.2 m/s. After a longer silence the counts may be off by a multiple of 65536;
`tick` shows how long the silence lasted.
"""

from collections.abc import Sequence
from typing import NamedTuple

from msgspec.structs import astuple

from miro_exact.clock import NEVER_TICK
from miro_exact.state import Rows
from miro_protocol.decoder import Received, Symbol, TelemetryDecoder
from miro_protocol.events import Event
from miro_protocol.frames import ContentError, TelemetryFrame

_HALF_TURN = 1 << 15
_TURN = 1 << 16

_COUNT = ("q", -NEVER_TICK, NEVER_TICK)
_NO_TELEMETRY = (-1, 0, 0, 0, 0, 0, 0, 0, 0)


class LastTelemetry(NamedTuple):
    """One robot's last answer.

    `tick` is the start bit of the frame's first character at the PC; `flags` are those of `miro_protocol.table.Flags`;
    `status_*` the status bytes of the LM629; `position_*` unwrapped encoder counts; `accepted` and `rejected` the
    firmware's frame counters modulo 256.
    """

    tick: int
    seq: int
    flags: int
    status_left: int
    status_right: int
    position_left: int
    position_right: int
    accepted: int
    rejected: int


class TelemetryReceiver:
    """Receiver of one network's answers. `last` holds the last one of each slot, None before the first."""

    STATE = {
        "decoder": TelemetryDecoder,
        "last": Rows(
            *(8, ("q", -1, NEVER_TICK), "B", "B", "B", "B", _COUNT, _COUNT, "B", "B"),
            split=lambda last: last or _NO_TELEMETRY,
            make=lambda cells: None if cells[0] < 0 else LastTelemetry(*cells),
        ),
    }
    NOT_STATE = ("robots",)

    def __init__(self, robots: int) -> None:
        self.robots = robots
        self.decoder = TelemetryDecoder()
        self.last: list[LastTelemetry | None] = [None] * robots

    def __repr__(self) -> str:
        return f"TelemetryReceiver({self.decoder!r}, last={self.last!r})"

    def receive(self, symbols: Sequence[Symbol]) -> list[Event]:
        """Takes characters in the order of time; returns what the decoder found in them.

        What is no answer of a robot here changes nothing in `last`.
        """
        events = self.decoder.feed_symbols(symbols)
        for event in events:
            if isinstance(event, Received):
                self._take(event)
        return events

    def _take(self, event: Received) -> None:
        try:
            message = event.message(len(self.last))
        except ContentError:  # the CRC is good: a firmware that sets bits which the format keeps at 0
            return
        if not isinstance(message, TelemetryFrame) or message.slot >= len(self.last):
            return
        before = self.last[message.slot]
        left, right = (0, 0) if before is None else (before.position_left, before.position_right)
        seq, slot, flags, *status, low_left, low_right, accepted, rejected = astuple(message)
        left, right = unwrapped(low_left, left), unwrapped(low_right, right)
        self.last[slot] = LastTelemetry(
            *(event.start_tick, seq, flags, status[0], status[1], left, right, accepted, rejected)
        )

    def after_load(self) -> None:
        """Raises ValueError unless there is an answer, or none, of each robot."""
        if len(self.last) != self.robots:
            raise ValueError(f"answers of {len(self.last)} robots where {self.robots} belong")


def unwrapped(low: int, before: int) -> int:
    """The count with the 16 low bits `low` that is nearest to `before`; halfway, the smaller one."""
    return before + ((low - before + _HALF_TURN) % _TURN) - _HALF_TURN
