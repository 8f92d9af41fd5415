"""A Bluetooth module, HC-05 or HC-06 as a slave: a serial line through the air once a master has connected."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import Meta

from miro_exact.state import FLAG
from miro_robot.parts.keys import HIGH, LOW, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part
from miro_robot.parts.wire_part import WirePart

_TOLERANCE = 25  # the centre of the tenth bit is less than half a bit off: 1 in 25, both ends together


class Bluetooth(PartKeys, frozen=True, kw_only=True, tag="bluetooth"):
    """A Bluetooth module. `baud`: that it was set to; the wire's host, at the other end of the air, has any rate.

    `connected`: at power-on. While nobody is connected characters are lost, either way. AT commands are not answered.
    """

    PINS = (Pin("rxd"), Pin("txd"), Pin("state", STRONG, optional=True))
    AT = {"rxd": "P3.1", "txd": "P3.0"}
    PUTS = {"connected": bool}
    READS = {
        "connected": "whether a master is connected: STATE is high",
        "lost": "characters that were lost: nobody was connected, or the rate was another",
    }
    SHEET = "ITead Studio, HC-05 data sheet (2010), sections 2 and 6; HC-06 the same without key and master"

    baud: Annotated[int, Meta(ge=1200, le=1_382_400)] = 9600
    connected: bool = True

    @property
    def line_baud(self) -> int:
        return self.baud

    def make(self, place: Place) -> Part:
        return BluetoothPart(self, place)


class BluetoothPart(WirePart):
    """`connected`: whether a master is."""

    STATE = {"connected": FLAG}
    NOT_STATE = ("baud",)

    def __init__(self, keys: Bluetooth, place: Place) -> None:
        WirePart.__init__(self, keys, place)
        self.baud = keys.baud
        self.connected = 1 if keys.connected else 0

    def start(self, tick: int) -> None:
        self.drive(2, HIGH if self.connected else LOW)

    def put(self, name: str, value: Any, tick: int) -> None:
        self.connected = 1 if value else 0
        self.drive(2, HIGH if self.connected else LOW)

    def gives(self, first_tick: int, tick: int, bit_ticks: int) -> bool:
        off = abs(bit_ticks * self.baud - self.crystal_hz)
        return self._counted(off * _TOLERANCE <= self.crystal_hz, 1)

    def takes(self, first_tick: int, end_tick: int, characters: int) -> bool:
        return self._counted(True, characters)

    def _counted(self, right: bool, characters: int) -> bool:
        passes = bool(self.on and self.connected and right)
        if not passes:
            self.lost += characters
        return passes

    def read(self, name: str, tick: int) -> float | int | bool | str:
        return bool(self.connected) if name == "connected" else self.lost
