"""A serial EEPROM, AT24C01 to AT24C64: 128 bytes to 8 KB on two wires, kept without supply.

        ┌──────┐
   a0 ──┤1    8├── VCC
   a1 ──┤2    7├── wp     high: nothing is written
   a2 ──┤3    6├── scl
  GND ──┤4    5├── sda
        └──────┘

    start  1010 a2 a1 a0 0  word address  byte, byte, ..  stop       write: up to a page, which takes `write_ms`
    start  1010 a2 a1 a0 1  byte, byte, ..  no ack, stop             read, from the address counter on

A page write wraps within its page, a read at the end of the memory. In a write cycle no address is acknowledged: the
program asks until one is, or waits. A stop within a byte, a start in place of a stop, or wp high at the stop writes
nothing. Power that is lost in a write cycle leaves its bytes erased (FFh): the chip erases before it writes, and no
sheet says what becomes of them.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK, Octets
from miro_robot.parts.i2c import I2C_PINS, I2cTarget
from miro_robot.parts.keys import IN, PartKeys, Pin, Place
from miro_robot.parts.part import Part

SIZES = {
    "01": (128, 8, 0b111),
    "02": (256, 8, 0b111),
    "04": (512, 16, 0b110),
    "08": (1024, 16, 0b100),
    "16": (2048, 16, 0b000),
    "32": (4096, 32, 0b111),
    "64": (8192, 32, 0b111),
}
"""Bytes, bytes of a page, and which of a2, a1, a0 are pins: the others are bits 10 to 8 of the word address."""
_NARROW_BYTES = 2048  # larger ones take two bytes of word address
_ADDRESS_PINS, _WP_BIT = 2, 1 << 5  # the first one's number
_NEVER = NEVER_TICK
HexText = Annotated[str, Meta(pattern=r"^\s*([0-9A-Fa-f]{2}\s*)*$")]


class At24c(PartKeys, frozen=True, kw_only=True, tag="at24c"):
    """A serial EEPROM. `size`: 01, 02, 04, 08, 16, 32, 64. `content`: hex digits from address 0 on; the rest is FF.

    `write_ms`: of a write cycle; the sheets promise 5 ms at most (10 ms of AT24C before the letter B).
    """

    PINS = (
        *I2C_PINS,
        Pin("a0", IN, optional=True, level=0),
        Pin("a1", IN, optional=True, level=0),
        Pin("a2", IN, optional=True, level=0),
        Pin("wp", IN, optional=True, level=0),
    )
    PUTS = {"content": HexText}
    READS = {
        "content": "all bytes, as hex digits",
        "writes": "write cycles that were begun",
        "busy": "whether it is in a write cycle",
        "short_clocks": "levels of SCL shorter than 1.3 us low, 0.6 us high",
    }
    SHEET = (
        "Atmel AT24C02B 5126, AT24C64B 3350: device operation, device addressing, write and read operations"
    )

    size: Literal["01", "02", "04", "08", "16", "32", "64"] = "02"
    write_ms: Annotated[float, Meta(gt=0, le=100)] = 5.0
    content: HexText = ""

    def __post_init__(self) -> None:
        _of_hex(self.content, SIZES[self.size][0])

    def make(self, place: Place) -> Part:
        return At24cPart(self, place)


def _of_hex(text: str, room: int) -> bytes:
    """Raises ValueError for more bytes than there is room for."""
    content = bytes.fromhex(text)
    if len(content) > room:
        raise ValueError(f"content has {len(content)} bytes, the chip {room}")
    return content


class At24cPart(I2cTarget):
    """`loaded`: which bytes of the `page` came since the last start."""

    STATE = {
        "memory": Octets(8192),
        "address": ("i", 0, 8191),
        "to_come": ("i", 0, 2),  # bytes of the word address
        "page": "32B",
        "loaded": ("32B", 0, 1),
        "writes": TICK,
    }
    NOT_STATE = ("size", "page_size", "address_pins", "write_ticks")

    def __init__(self, keys: At24c, place: Place) -> None:
        I2cTarget.__init__(self, keys, place)
        self.size, self.page_size, self.address_pins = SIZES[keys.size]
        self.write_ticks = max(1, self.ticks(1000.0 * keys.write_ms))
        content = _of_hex(keys.content, self.size)
        self.memory = content + bytes([0xFF]) * (self.size - len(content))
        self.address = 0
        self.to_come = 0
        self.page = [0] * 32
        self.loaded = [0] * 32
        self.writes = 0

    def start(self, tick: int) -> None:
        I2cTarget.start(self, tick)
        self.address = 0  # it is not kept
        self._forget()

    def supply(self, on: int, tick: int) -> None:
        if not on and self.wake_tick != _NEVER:
            self._store(1)
        I2cTarget.supply(self, on, tick)

    def addressed(self, byte: int, tick: int) -> int:
        if self.wake_tick != _NEVER:
            return 0
        self._forget()
        if byte >> 4 != 0b1010 or ((byte >> 1) ^ (self.levels >> _ADDRESS_PINS)) & self.address_pins:
            return 0
        if self.address_pins != 0b111:
            self.address = (byte >> 1 & 0b111 & ~self.address_pins) << 8 | self.address & 0xFF
        if not byte & 1:
            self.to_come = 1 if self.size <= _NARROW_BYTES else 2
        return 1

    def received(self, byte: int, tick: int) -> int:
        if self.to_come:
            self.to_come -= 1
            above = self.address & ~0xFF if self.size <= _NARROW_BYTES else self.address << 8
            self.address = (above | byte) & (self.size - 1)
            return 1
        place = self.address & (self.page_size - 1)
        self.page[place] = byte
        self.loaded[place] = 1
        self.address = self.address - place + ((place + 1) & (self.page_size - 1))
        return 1

    def transmit(self, tick: int) -> int:
        byte = self.memory[self.address]
        self.address = (self.address + 1) & (self.size - 1)
        return byte

    def ended(self, tick: int) -> None:
        if self.levels & _WP_BIT:
            self._forget()
        for place in range(self.page_size):
            if self.loaded[place]:
                self.writes += 1
                self.wake(tick + self.write_ticks)
                return

    def woken(self, tick: int) -> None:
        self._store(0)

    def _store(self, erased: int) -> None:
        """Ends the write cycle: the bytes of the page, or FFh, into the memory."""
        content = bytearray(self.memory)
        first = self.address & ~(self.page_size - 1)
        for place in range(self.page_size):
            if self.loaded[place]:
                content[first + place] = 0xFF if erased else self.page[place]
        self.memory = bytes(content)
        self._forget()

    def _forget(self) -> None:
        for place in range(self.page_size):
            self.loaded[place] = 0

    def put(self, name: str, value: str, tick: int) -> None:
        content = _of_hex(value, self.size)
        self.memory = content + self.memory[len(content) :]

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "content":
            return self.memory.hex()
        if name == "busy":
            return self.wake_tick > tick and self.wake_tick != _NEVER
        return I2cTarget.read(self, name, tick)

    def after_load(self) -> None:
        """Raises ValueError for a memory of another size, and an address beyond it."""
        if len(self.memory) != self.size or self.address >= self.size:
            raise ValueError(f"{self.name}: {len(self.memory)} bytes, address {self.address}, of {self.size}")
