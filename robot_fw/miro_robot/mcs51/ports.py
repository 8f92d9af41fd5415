"""The four ports: latches, what the outside puts on the pins, and pushes that have not taken effect yet.

What belongs here: levels. Which pins carry timer inputs and interrupts is `peripherals.py`'s.

A pin is the wired AND of its latch and the outside (P1 to P3 quasi-bidirectional, P0 open drain with pull-
ups). The CPU samples pins at S5P2, so a push with a tick takes effect in the first cycle whose S5P2 is not
before it (P1, P2). The latch changes at the end of an instruction and the pin with the next cycle.
"""

from __future__ import annotations

from operator import itemgetter
from typing import Annotated, Any

from msgspec import Meta, convert

from miro_exact.saved import wholes

_FAR = 1 << 62
_Push = tuple[
    Annotated[int, Meta(ge=0, le=1 << 55)],
    Annotated[int, Meta(ge=0, le=3)],
    Annotated[int, Meta(ge=0, le=0xFF)],
]


class Ports:
    """P0 to P3."""

    NOT_STATE = ("next_cycle",)

    def __init__(self) -> None:
        self.latches = [0xFF] * 4
        self.outside = [0xFF] * 4
        self.pending: list[tuple[int, int, int]] = []  # (cycle, port, levels), by cycle
        self.next_cycle = _FAR  # of the first of them

    def level(self, port: int) -> int:
        return self.latches[port] & self.outside[port]

    def push(self, port: int, levels: int, tick: int) -> None:
        """The outside puts `levels` on the pins of `port` at `tick`."""
        cycle = (tick + 2) // 12  # the first with 12 * cycle + 9 >= tick
        if self.pending and self.pending[len(self.pending) - 1][0] > cycle:
            raise ValueError(f"pins of P{port} pushed for tick {tick}, before one already pushed")
        self.pending.append((cycle, port, levels))
        self.next_cycle = self.pending[0][0]

    def apply(self, cycle: int) -> None:
        """Lets all pushes up to `cycle` take effect."""
        while self.next_cycle <= cycle:
            _, port, levels = self.pending.pop(0)
            self.outside[port] = levels
            self.next_cycle = self.pending[0][0] if self.pending else _FAR

    def snapshot(self) -> dict[str, object]:
        return {
            "latches": [self.latches[port] for port in range(4)],
            "outside": [self.outside[port] for port in range(4)],
            "pending": [tuple(push) for push in self.pending],
        }

    def restore(self, state: dict[str, Any]) -> None:
        latches = wholes(state, "latches", 4, 0, 0xFF)
        outside = wholes(state, "outside", 4, 0, 0xFF)
        for port in range(4):
            self.latches[port] = latches[port]
            self.outside[port] = outside[port]
        self.pending = convert(state["pending"], list[_Push])
        if self.pending != sorted(self.pending, key=itemgetter(0)):
            raise ValueError("pushes of port pins are not in order")
        self.next_cycle = self.pending[0][0] if self.pending else _FAR
