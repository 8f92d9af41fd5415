"""The serial port of a PC at the wire of a board, in virtual time.

    bytes to send  ──► transmit buffer ──► RXD, bit by bit at the wire's rate ──► the board's receiver, at its own
    bytes received ◄────────────────────── TXD, as the board's transmitter sends them

The wire has one rate a session: `[serial] baud` of the board's file, or that of the first port that sends at a rate
which the receiver takes; a TCP port has none and takes the receiver's own. A receiver of another rate than `[serial]
baud` gets wrong characters, as on a desk. A port of another rate is not simulated: it sends and receives nothing, and a
line reports it.
"""

from __future__ import annotations

from miro_exact.clock import CHARACTER_BITS
from miro_sim.scenario.board import FASTEST_BIT_TICKS
from miro_sim.world.wire import Wire
from miro_sim.world.world import World
from mirotwin.ports.radio_port import TRANSMIT_CHARACTERS, RadioPort

TOLERANCE = 0.045
"""Largest difference of rates, as a share: half a bit in the ten of a character, less the sampling error."""


class WirePort(RadioPort):
    """The port at the wire of a world with one board. `baud`: of the board's file, or 9600."""

    def __init__(self, world: World, network: int = 0) -> None:
        RadioPort.__init__(self, world, network)
        wire = world.lines[network]
        assert isinstance(wire, Wire)
        self.wire = wire
        self.baud = self._baud(wire.bit_ticks) or 9600

    @property
    def room(self) -> int:
        """Free characters; 0 until the wire has a rate, or the board has switched its receiver on.

        Until then bytes wait at the port.
        """
        begun = self.wire.bit_ticks or self._receiver
        return TRANSMIT_CHARACTERS - self.waiting if begun else 0

    def takes(self, baud: int) -> bool:
        bit_ticks = self._bit_ticks(baud)
        fits = FASTEST_BIT_TICKS <= bit_ticks <= self.world.clock
        return fits and self.wire.bit_ticks in (0, bit_ticks)

    def remark_on_sending(self, baud: int) -> str:
        receiver = self._receiver
        if not receiver:
            return "sends while the board's receiver is off: it is lost"
        if _differ(self.wire.bit_ticks, receiver):
            rates = (
                f"{self._baud(self.wire.bit_ticks)} baud, and the board receives at {self._baud(receiver)}"
            )
            return f"sends at {rates}: it receives wrong characters"
        return ""

    def deaf_to(self, baud: int) -> str:
        if not baud:
            return ""
        if self.takes(baud):
            receiver = self._receiver
            if self.wire.bit_ticks or not _differ(self._bit_ticks(baud), receiver):
                return ""
            own = self._baud(receiver)
            return f"sends at {baud} baud, and the board receives at {own}: nothing is passed on"
        if not self.wire.bit_ticks:
            return f"sends at {baud} baud, which the crystal does not allow: nothing is passed on"
        wire = self._baud(self.wire.bit_ticks)
        return f"sends at {baud} baud, and the wire has {wire} in this session: nothing is passed on"

    def mute_at(self, baud: int) -> str:
        sender = self.wire.character_ticks // CHARACTER_BITS
        if baud and sender and _differ(self._bit_ticks(baud), sender):
            return (
                f"receives at {baud} baud, and the board sends at {self._baud(sender)}: nothing is passed on"
            )
        return ""

    def send(self, data: bytes, at_tick: int = 0, baud: int = 0) -> int:
        if not self.wire.bit_ticks and baud:
            self.wire.bit_ticks = self._bit_ticks(baud)
            self.wire.outbox.character_ticks = CHARACTER_BITS * self.wire.bit_ticks
        return RadioPort.send(self, data, at_tick, baud)

    @property
    def _receiver(self) -> int:
        """Ticks of a bit as the board receives; 0 while its receiver is off."""
        return self.wire.board.cpu.peripherals.bit_ticks()

    def _bit_ticks(self, baud: int) -> int:
        return (self.world.clock + baud // 2) // baud

    def _baud(self, bit_ticks: int) -> int:
        return (self.world.clock + bit_ticks // 2) // bit_ticks if bit_ticks else 0


def _differ(first: int, other: int) -> bool:
    return abs(first - other) > TOLERANCE * other
