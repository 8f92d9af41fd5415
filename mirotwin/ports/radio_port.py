"""The serial port of the PC's radio on one network of a world, in virtual time.

    bytes to send  ──► transmit buffer, 4096 characters ──► air ──► robots
    bytes received ◄─────────── the PC's receiver ◄─────── air ◄── robots

A character with a bad stop bit is delivered like any other, as by a serial port without error checking; the recording
marks it. Slicer noise reaches robots only: the PC's receiver has a squelch.
"""

from __future__ import annotations

from miro_sim.world.actions import SETTLE_TICKS
from miro_sim.world.events import Cursor
from miro_sim.world.medium import Medium
from miro_sim.world.outbox import INJECTED
from miro_sim.world.world import World

TRANSMIT_CHARACTERS = 4096
"""Capacity of the transmit buffer in characters: that of a serial port under Linux."""


class RadioPort:
    """The port of `network`. Raises ValueError for a network that is not there."""

    baud = 9600
    """The rate of the terminal until a program sets another."""

    def __init__(self, world: World, network: int = 0) -> None:
        world.earliest_tick(network)  # refuses a network that is not there
        self.world = world
        self.network = network
        self._line: Medium = world.lines[network]
        self._cursor = Cursor(self._line.log)

    @property
    def free_tick(self) -> int:
        """Tick at which everything given to the port has been sent; in the past if it has."""
        return self._line.outbox.end_tick(self._line.free_tick())

    @property
    def waiting(self) -> int:
        """Characters that are not sent yet; the one under way counts."""
        ticks = self.free_tick - self.world.tick
        return max(0, -(-ticks // self._line.outbox.character_ticks)) if ticks > 0 else 0

    @property
    def room(self) -> int:
        """Characters that the transmit buffer takes now."""
        return max(0, TRANSMIT_CHARACTERS - self.waiting)

    def takes(self, baud: int) -> bool:
        """True if a client can set this rate."""
        return baud == self.baud

    def remark_on_sending(self, baud: int) -> str:
        """A remark on a client's rate (0: it has none) that is wrong but does not stop its bytes; "" if it is right."""
        return f"has set another baud rate; the radio has {self.baud}" if baud not in (0, self.baud) else ""

    def deaf_to(self, baud: int) -> str:
        """The reason why bytes from a client that sends at this rate are dropped; "" if they are not."""
        return ""

    def mute_at(self, baud: int) -> str:
        """The reason why a client that receives at this rate gets nothing; "" if it gets the bytes."""
        return ""

    def send(self, data: bytes, at_tick: int = 0, baud: int = 0) -> int:
        """Puts at least one character into the transmit buffer; returns the tick of the first start bit.

        The carrier comes up at the next tick that is not yet settled on any wire: 120 ticks from now, or from
        `at_tick`. `World.inject` is not used because it subtracts the radio's latency, which gives a time before the
        present. A transmission before the start of the control period would, when replayed, belong to the period
        before, and the digests would differ.
        """
        outbox = self._line.outbox
        earliest = max(self.world.tick, at_tick) + SETTLE_TICKS + outbox.lead_ticks
        return self.world.inject(data, self.network, max(earliest, self.free_tick))

    def purge(self) -> None:
        """Removes characters whose transmission has not begun."""
        outbox = self._line.outbox
        outbox.waiting = [sent for sent in outbox.waiting if sent.origin != INJECTED]

    def received(self) -> bytes:
        """Characters that the PC has received since the last call.

        Call it before 4096 events have occurred at the PC.
        """
        return bytes(event.value for _, event in self._cursor.read() if event.what == "heard")
