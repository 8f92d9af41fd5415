"""The processors that a board may have: what of an AT89C52 they have, and what they add.

All run with twelve periods of the crystal a machine cycle. Registers that one of them adds are in `chip_registers.py`;
others read FFh, and writing them does nothing.
"""

from __future__ import annotations

from typing import NamedTuple


class ChipKind(NamedTuple):
    """`flash_bytes` of program inside, `iram_bytes` of RAM for data and stack, `xram_bytes` of RAM inside for MOVX.

    `sheet`: the maker's data sheet.
    """

    flash_bytes: int
    iram_bytes: int
    xram_bytes: int
    has_timer2: bool
    sheet: str


CHIPS = {
    "at89c51": ChipKind(0x1000, 128, 0, False, "Atmel 0265G"),
    "at89c52": ChipKind(0x2000, 256, 0, True, "Atmel 0313H"),
    "at89s52": ChipKind(0x2000, 256, 0, True, "Atmel 1919D"),
    "stc89c52": ChipKind(0x2000, 256, 256, True, "STC89C51RC/RD+"),
}
"""By the name in a board file."""
