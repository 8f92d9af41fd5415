"""The four ports: latches, what the outside puts on the pins, and pushes that have not taken effect yet.

Which pins carry timer inputs and interrupts is `peripherals.py`'s.

A pin is the wired AND of its latch and the outside (P1 to P3 quasi-bidirectional, P0 open drain with pull-
ups); one that is shorted, a fault, has the level of the rail. The CPU samples pins at S5P2, so a push with a
tick takes effect in the first cycle whose S5P2 is not before it (P1, P2). The latch changes at the end of an
instruction and the pin with the next cycle.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import Rows


class Ports:
    """P0 to P3."""

    STATE = {
        "latches": ("4i", 0, 0xFF),
        "outside": ("4i", 0, 0xFF),
        "pending": Rows(4096, ("q", 0, 1 << 55), ("B", 0, 3), "B", ordered=True),
    }
    NOT_STATE = ("next_cycle", "stuck_low", "stuck_high")  # a fault, which the board saves

    def __init__(self) -> None:
        self.latches = [0xFF] * 4
        self.outside = [0xFF] * 4
        self.stuck_low = [0] * 4
        self.stuck_high = [0] * 4
        self.pending: list[tuple[int, int, int]] = []  # (cycle, port, levels), by cycle
        self.next_cycle = NEVER_TICK  # of the first of them

    def hold(self, port: int, low: int, high: int) -> None:
        """Fault: these pins are shorted to ground, and these to the supply."""
        self.stuck_low[port] = low
        self.stuck_high[port] = high

    def is_stuck(self) -> bool:
        """True if any pin is shorted."""
        stuck = 0
        for port in range(4):
            stuck |= self.stuck_low[port] | self.stuck_high[port]
        return stuck != 0

    def driven(self, port: int) -> int:
        """The latches of a port with its shorted pins."""
        return self.shorted(port, self.latches[port])

    def shorted(self, port: int, levels: int) -> int:
        """Levels of a port with those of its shorted pins, which no driver overcomes."""
        return (levels | self.stuck_high[port]) & ~self.stuck_low[port]

    def pins(self, port: int) -> int:
        """The pins of a port without alternate outputs."""
        return self.shorted(port, self.latches[port] & self.outside[port])

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
            self.next_cycle = self.pending[0][0] if self.pending else NEVER_TICK

    def after_load(self) -> None:
        self.next_cycle = self.pending[0][0] if self.pending else NEVER_TICK
