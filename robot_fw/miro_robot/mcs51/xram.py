"""A bus with 64 KB of RAM on it and nothing else."""

from __future__ import annotations

from miro_robot.mcs51.bus import Bus


class XramBus(Bus):
    """A bus that ignores characters and faults."""

    HAS_XRAM = True
    STATE = {"memory": "65536B"}

    def __init__(self) -> None:
        self.memory = bytearray(0x10000)

    def movx_read(self, address: int, tick: int) -> int:
        return self.memory[address]

    def movx_write(self, address: int, value: int, tick: int) -> None:
        self.memory[address] = value

    def xram(self) -> bytes:
        return bytes(self.memory[:0x10000])
