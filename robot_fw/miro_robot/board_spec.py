"""The specification of a board: processor, crystal, memories, and the parts wired to it (`NAME.board.toml`)."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from miro_robot.parts.keys import PartKeys

CRYSTAL_HZ = 24_000_000
CRYSTAL_RANGE_HZ = (32_768, 100_000_000)
XRAM_BYTES = 0x10000

Address = Annotated[int, Meta(ge=0, le=0xFFFF)]
Byte = Annotated[int, Meta(ge=0, le=0xFF)]


class StrapSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A jumper from the net `pin`, mostly a port pin, to VCC (level 1) or ground (0)."""

    pin: str
    level: Annotated[int, Meta(ge=0, le=1)] = 1


class LatchSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Eight strong outputs that a MOVX write with `address & mask` equal to `address` stores."""

    address: Address
    mask: Address = 0xFFFF
    initial: Byte = 0xFF


class BufferSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A MOVX read with `address & mask` equal to `address` gives the levels of eight nets, bit 0 first."""

    address: Address
    mask: Address = 0xFFFF
    pins: tuple[str, ...]


class PartSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A part: its keys, which say its kind, and by the names of its pins what they are wired to."""

    keys: PartKeys
    pins: dict[str, str] = {}

    def __post_init__(self) -> None:
        msgspec.structs.force_setattr(self, "pins", dict(sorted(self.pins.items())))


class BoardSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A tick is a period of the crystal, a machine cycle 12. Without parts it is the bare processor with external RAM.

    `xram`: where MOVX goes, `xram_bytes` of it if that is external. `code_in_xram`: EA low, program and data share one
    RAM of 64 KB. `start`: address of the first instruction, as after a jump there by a monitor. `bound_stack`: SP that
    leaves the stack of the image is a fault. `of_file`: a board file describes it: its port pins are
    nets, and a MOVX while P3.6 or P3.7 holds its strobe is a fault.
    `nets`: a name for the net of a port pin, or of several. `pull_ups`, `pull_downs`: nets, port pins, whole ports.
    `allow_contention`: the same, on which outputs of different level are no fault; the low one wins.
    `baud`: of what a terminal sends; 0: the receiver's own rate.
    All tables are in the order of the names, so that the order of a file changes no bit.
    Raises ValueError for values out of range.
    """

    name: str = "board"
    chip: str = "at89c52"
    crystal_hz: int = CRYSTAL_HZ
    xram: Literal["none", "internal", "external"] = "external"
    xram_bytes: int = XRAM_BYTES
    code_in_xram: bool = False
    start: int = 0
    bound_stack: bool = True
    of_file: bool = False
    pull_ups: tuple[str, ...] = ()
    pull_downs: tuple[str, ...] = ()
    allow_contention: tuple[str, ...] = ()
    nets: dict[str, tuple[str, ...]] = {}
    straps: dict[str, StrapSpec] = {}
    latches: dict[str, LatchSpec] = {}
    buffers: dict[str, BufferSpec] = {}
    baud: int = 0
    parts: dict[str, PartSpec] = {}

    def __post_init__(self) -> None:
        least, most = CRYSTAL_RANGE_HZ
        if not least <= self.crystal_hz <= most:
            raise ValueError(f"crystal {self.crystal_hz} Hz is outside {least}..{most}")
        for name in ("nets", "straps", "latches", "buffers", "parts"):
            msgspec.structs.force_setattr(self, name, dict(sorted(getattr(self, name).items())))

    @property
    def is_wired(self) -> bool:
        """True if it has nets: there is more on it than the processor and its memory, or a file describes it."""
        return bool(
            self.of_file or self.parts or self.straps or self.latches or self.buffers or self.pull_downs
        )
