"""A bus with 64 KB of RAM on it and nothing else."""

from __future__ import annotations

from collections.abc import Callable

from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.cpu import Cpu


class XramBus(Bus):
    """`sent(value, tick)` gets every character, `faulted(kind, pc, tick)` every firmware fault.

    `listening(tick)` is called when the receiver of the serial port is switched on.

    With `code_of` set, the RAM is also that CPU's code memory (EA low, one space for both).
    """

    HAS_XRAM = True
    STATE = {"memory": "65536B"}
    NOT_STATE: tuple[str, ...] = ("code_of", "faulted", "sent", "listening")

    def __init__(
        self,
        sent: Callable[[int, int], None],
        faulted: Callable[[int, int, int], None],
        listening: Callable[[int], None],
    ) -> None:
        self.memory = bytearray(0x10000)
        self.sent = sent
        self.faulted = faulted
        self.listening = listening
        self.code_of: Cpu | None = None

    def movx_read(self, address: int, tick: int) -> int:
        return self.memory[address]

    def movx_write(self, address: int, value: int, tick: int) -> None:
        self.memory[address] = value
        if self.code_of is not None:
            self.code_of.write_code(address, value)

    def receiver_on(self, tick: int) -> None:
        self.listening(tick)

    def byte_sent(self, value: int, tick: int) -> None:
        self.sent(value, tick)

    def fault(self, kind: int, pc: int, tick: int) -> None:
        self.faulted(kind, pc, tick)

    def fill(self, content: bytes) -> None:
        """The whole RAM, 64 KB."""
        for address in range(0x10000):
            self.memory[address] = content[address]

    def xram(self) -> bytes:
        return bytes(self.memory[:0x10000])
