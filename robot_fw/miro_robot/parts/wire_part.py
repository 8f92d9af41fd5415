"""Base of parts between the serial port and the line: they decide what of it comes through.

    processor TXD ──> gives ──> the line ──> PC, or whoever is the wire's host
    processor RXD <── takes <── the line

Characters are carried by the wire; such a part lets each pass as a whole, or not. What the host sends is judged when
it is put on the line, which may be long before: by what tests and the supply change, `SETTLE_TICKS` after they do.
"""

from __future__ import annotations

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import PartKeys, Place
from miro_robot.parts.part import Part


class WirePart(Part):
    """`lost`: characters that did not come through, either way. `on`: it has its supply."""

    STATE = {"on": FLAG, "lost": TICK}

    def __init__(self, keys: PartKeys, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.on = 0
        self.lost = 0

    def supply(self, on: int, tick: int) -> None:
        self.on = on
        Part.supply(self, on, tick)

    def gives(self, first_tick: int, tick: int, bit_ticks: int) -> bool:
        """True if a character of the processor gets on the line: it began at `first_tick`, its stop bit at `tick`."""
        raise NotImplementedError

    def takes(self, first_tick: int, end_tick: int, characters: int) -> bool:
        """True if `characters` of the host reach the processor, from `first_tick` on; called before that.

        `end_tick`: the begin of the last stop bit, which idle lines hold as well.
        """
        raise NotImplementedError
