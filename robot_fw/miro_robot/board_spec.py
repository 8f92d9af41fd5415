"""What a board without a robot is: its processor's crystal and memories. Nothing is wired to it but external RAM."""

from __future__ import annotations

import msgspec

CRYSTAL_HZ = 24_000_000
CRYSTAL_RANGE_HZ = (32_768, 100_000_000)


class BoardSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A tick is a period of the crystal, a machine cycle 12.

    `code_in_xram`: EA low, program and data share one RAM of 64 KB. `start`: address of the first instruction, as
    after a jump there by a monitor. `bound_stack`: SP that leaves the stack of the image is a fault.
    Raises ValueError for values out of range.
    """

    name: str = "board"
    crystal_hz: int = CRYSTAL_HZ
    code_in_xram: bool = False
    start: int = 0
    bound_stack: bool = True

    def __post_init__(self) -> None:
        least, most = CRYSTAL_RANGE_HZ
        if not least <= self.crystal_hz <= most:
            raise ValueError(f"crystal {self.crystal_hz} Hz is outside {least}..{most}")
