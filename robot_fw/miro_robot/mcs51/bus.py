"""The interface from the CPU to the outside.

The board implements the calls. Input goes the other way, pushed by the board: `Cpu.set_external` and the `rxd` Line.
All ticks are those of the 24 MHz crystal; a machine cycle is 12 of them.
"""

from __future__ import annotations


class Bus:
    """A CPU on an empty board. Boards override what they have wired."""

    NOT_STATE: tuple[str, ...] = ()
    HAS_XRAM = False
    """True if all 64 KB of external RAM are there."""

    def port_written(self, port: int, latch: int, tick: int) -> None:
        """Latch of P0..P3 (`port` 0..3) is now `latch`; the pins follow at `tick`, S1P1 of the next cycle."""

    def movx_read(self, address: int, tick: int) -> int:
        """Byte (0..255) on P0 when the CPU samples it at `tick`, end of S3P1 of the second MOVX cycle."""
        return 0xFF

    def movx_write(self, address: int, value: int, tick: int) -> None:
        """/WR goes high at `tick` with `value` on P0."""

    def movx_without_strobe(self, address: int, write: int) -> None:
        """A MOVX that nothing outside notices: P3.6 (`write`) or P3.7 is latched low, so there is no strobe."""

    def inner_read(self, address: int) -> int:
        """A byte of the chip's own RAM for MOVX."""
        return 0xFF

    def inner_write(self, address: int, value: int) -> None:
        """Stores into it."""

    def extra_read(self, address: int) -> int:
        """A register that the AT89C52 has not."""
        return 0xFF

    def extra_write(self, address: int, value: int) -> None:
        """Writes it."""

    def xram(self) -> bytes:
        """All of the external RAM; empty where the board has none."""
        return b""

    def fault(self, kind: int, pc: int, tick: int) -> None:
        """The firmware did what it must not (`miro_robot.faults.FaultKind`) at the instruction at `pc`."""

    def receiver_on(self, tick: int) -> None:
        """REN was 0 and is 1 from `tick` on."""

    def byte_received(self, value: int, stop: int, tick: int) -> None:
        """The serial port set RI at `tick` for the character `value`; `stop`: bit RB8, the stop bit in mode 1."""

    def outputs_changed(self, tick: int) -> int:
        """With `Peripherals.listened`: from `tick` on TXD, the data of mode 0 or the clock of timer 2 may go otherwise
        than was foreseen. A tick beyond the CPU's: pins were sampled. Returns 0.
        """
        return 0

    def byte_sent(self, value: int, tick: int) -> None:
        """The serial port set TI for the character `value` (its 8 data bits)."""
