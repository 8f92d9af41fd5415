"""The signals of a waveform: their names, where they are picked up, and what they mean.

Every signal of one bit is a 1-bit wire, and every signal of more bits is as many 1-bit wires, since sigrok's reader
gives up at the first vector; the save file puts them together again. Names are unique without their scope, because
sigrok drops scopes.
"""

from __future__ import annotations

from typing import NamedTuple

from miro_robot.inspect.tap import PLACES

TOP = "robot"


class Signal(NamedTuple):
    """`place`: where the tap notes it (`tap.PLACES`), or a port of the CPU, whose pins have several sources."""

    name: str
    scope: str
    bits: int
    place: str
    meaning: str

    def wires(self) -> list[str]:
        """Names of its wires, low bit first."""
        return [self.name] if self.bits == 1 else [f"{self.name}{bit}" for bit in range(self.bits)]

    def path(self, wire: str) -> str:
        """A wire's name with its scopes."""
        return ".".join([TOP, *([self.scope] if self.scope else []), wire])

    @property
    def on_board(self) -> bool:
        """Whether a CPU alone does not have it."""
        return self.place == "data" or "." in self.place


def _chip(side: str) -> list[Signal]:
    pins = [
        ("cs_n", 1, "cs", "/CS"),
        ("rd_n", 1, "rd", "/RD"),
        ("wr_n", 1, "wr", "/WR: the byte is taken when it or /CS rises"),
        ("ps", 1, "ps", "PS: 0 command and status, 1 data"),
        ("rst_n", 1, "rst", "/RST"),
        ("busy", 1, "busy", "takes no byte now: busy bit, or in reset"),
        ("hi", 1, "hi", "HI, host interrupt, active high"),
        ("pwm", 1, "pwm", "magnitude pin, the L298's EN: the pulses themselves"),
        ("sign", 1, "sign", "sign pin, the L298's direction: 1 backward"),
        ("magnitude", 7, "magnitude", "of the pulses, in 1/128 of a period (0..127), from its sample on"),
        ("a", 1, "a", "encoder channel A"),
        ("b", 1, "b", "encoder channel B; A leads it forward"),
    ]
    return [Signal(f"{side}_{name}", side, bits, f"{side}.{place}", text) for name, bits, place, text in pins]


_SOURCES = ("int0", "timer0", "int1", "timer1", "serial", "timer2")

SIGNALS = (
    Signal("rxd", "", 1, "rxd", "from the radio receiver to P3.0"),
    Signal("txd", "", 1, "txd", "from P3.1 to the telemetry transmitter"),
    Signal("asleep", "cpu", 1, "asleep", "in idle mode, or powered down"),
    Signal("low_priority", "cpu", 1, "low", "an interrupt routine of low priority is in service"),
    Signal("high_priority", "cpu", 1, "high", "... of high priority"),
    *(Signal(f"isr_{name}", "cpu", 1, name, f"the routine of {name} is in service") for name in _SOURCES),
    Signal("d", "bus", 8, "data", "D0..D7 of both LM629"),
    *_chip("left"),
    *_chip("right"),
    *(Signal(f"p{port}_", "ports", 8, f"port{port}", f"pins of P{port}") for port in range(4)),
)

PLACE_OF = {name: place for place, name in enumerate(PLACES)}
