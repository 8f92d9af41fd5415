"""Names of the AT89C52's registers, of their bits, and how an operand is written.

With the symbols of an image, `miro_robot.inspect.symbol_names` writes them. Source: Atmel AT89C52 data sheet, SFR
map; 8051 Hardware Manual, 2.1.
"""

from __future__ import annotations

SFRS = {
    "P0": 0x80, "SP": 0x81, "DPL": 0x82, "DPH": 0x83, "PCON": 0x87, "TCON": 0x88, "TMOD": 0x89,
    "TL0": 0x8A, "TL1": 0x8B, "TH0": 0x8C, "TH1": 0x8D, "P1": 0x90, "SCON": 0x98, "SBUF": 0x99,
    "P2": 0xA0, "IE": 0xA8, "P3": 0xB0, "IP": 0xB8, "T2CON": 0xC8, "T2MOD": 0xC9, "RCAP2L": 0xCA,
    "RCAP2H": 0xCB, "TL2": 0xCC, "TH2": 0xCD, "PSW": 0xD0, "ACC": 0xE0, "B": 0xF0,
}  # fmt: skip
BITS = {
    "IT0": 0x88, "IE0": 0x89, "IT1": 0x8A, "IE1": 0x8B, "TR0": 0x8C, "TF0": 0x8D, "TR1": 0x8E, "TF1": 0x8F,
    "RI": 0x98, "TI": 0x99, "RB8": 0x9A, "TB8": 0x9B, "REN": 0x9C, "SM2": 0x9D, "SM1": 0x9E, "SM0": 0x9F,
    "EX0": 0xA8, "ET0": 0xA9, "EX1": 0xAA, "ET1": 0xAB, "ES": 0xAC, "ET2": 0xAD, "EA": 0xAF,
    "PX0": 0xB8, "PT0": 0xB9, "PX1": 0xBA, "PT1": 0xBB, "PS": 0xBC, "PT2": 0xBD,
    "RXD": 0xB0, "TXD": 0xB1, "INT0": 0xB2, "INT1": 0xB3, "T0": 0xB4, "T1": 0xB5, "WR": 0xB6, "RD": 0xB7,
    "CP_RL2": 0xC8, "C_T2": 0xC9, "TR2": 0xCA, "EXEN2": 0xCB, "TCLK": 0xCC, "RCLK": 0xCD, "EXF2": 0xCE,
    "TF2": 0xCF, "P": 0xD0, "UD": 0xD1, "OV": 0xD2, "RS0": 0xD3, "RS1": 0xD4, "F0": 0xD5, "AC": 0xD6, "CY": 0xD7,
}  # fmt: skip
INTERRUPTS = ("INT0", "timer 0", "INT1", "timer 1", "serial", "timer 2")
"""The six sources in polling order; the vector of number n is at 8 n + 3."""


class Names:
    """Operands as the data sheet writes numbers."""

    def code(self, address: int) -> str:
        """A place in code memory (0..FFFFh)."""
        return f"{address:04X}h"

    def direct(self, address: int) -> str:
        """A direct address: internal RAM (0..7Fh) or a special function register (80h..FFh)."""
        return f"{address:02X}h"

    def bit(self, bit: int) -> str:
        """A bit address (0..FFh)."""
        byte = bit & 0xF8 if bit & 0x80 else 0x20 + (bit >> 3)
        return f"{self.direct(byte)}.{bit & 7}"


NUMBERS = Names()
