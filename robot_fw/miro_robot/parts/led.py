"""A light-emitting diode with its resistor, to VCC or to ground.

VCC --[R]--|>|-- pin      active low: lit while the pin is low
pin --[R]--|>|-- ground   active high
"""

from __future__ import annotations

from typing import Literal

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import IN, PartKeys, Pin, Place
from miro_robot.parts.part import Part


class Led(PartKeys, frozen=True, kw_only=True, tag="led"):
    """A LED. `active`: the level that lights it."""

    PINS = (Pin("pin", IN),)
    READS = {"on": "whether it is lit", "flashes": "how often it was switched on"}
    SHEET = "AT89C52 data sheet 0313H, DC characteristics: a pin sinks 10 mA and sources next to nothing"

    active: Literal["low", "high"] = "low"

    @property
    def pulled_up(self) -> tuple[str, ...]:
        return ("pin",) if self.active == "low" else ()

    def make(self, place: Place) -> Part:
        return LedPart(self, place)


class LedPart(Part):
    """`on`, `flashes`: see `Led.READS`."""

    STATE = {"on": FLAG, "flashes": TICK}
    NOT_STATE = ("lit",)

    def __init__(self, keys: Led, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.lit = 1 if keys.active == "high" else 0
        self.on = 0
        self.flashes = 0

    def supply(self, on: int, tick: int) -> None:
        self.on = 1 if on and self.level(0) == self.lit else 0

    def changed(self, pins: int, tick: int) -> None:
        self.on = 1 if self.level(0) == self.lit else 0
        self.flashes += self.on
