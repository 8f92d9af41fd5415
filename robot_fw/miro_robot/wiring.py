"""A board as data: reads a board file and resolves every net to its source.

Nets are point to point: an input pin of an LM629 or of the CPU on the left, its source on the right. Sources are
port pins (`P2.3`), bits of an output latch that MOVX writes (`CTRL.3`), outputs of an LM629 (`left.hi`), straps
(`slot.0`, `three`), or the constants `0` and `1`; a leading `!` inverts. The data bus of the LM629 is one shared,
pulled-up bus whose drivers can only pull low.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from miro_exact.bad_input import BadInput
from miro_exact.inputs import BOARD_BYTES, InputError, read_input
from miro_protocol.toml_text import struct_of, tables

SIDES = ("left", "right")
CHIP_INPUTS = ("cs", "rd", "wr", "ps", "rst")
PORTS = 4
MAX_LATCHES = MAX_BUFFERS = 8
CONSTANT_BANK = PORTS + MAX_LATCHES
"""Banks of eight levels a chip input can be taken from: four ports, the latches, and one of constant ones."""

_PORT_PIN = re.compile(r"P([0-3])\.([0-7])$")


class WiringError(BadInput):
    """A board file that cannot be built: file, key, what, remedy."""


Address = Annotated[int, Meta(ge=0, le=0xFFFF)]
Byte = Annotated[int, Meta(ge=0, le=0xFF)]


class Latch(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Eight output bits that a MOVX write with `address & mask` equal to `address` stores."""

    name: str
    address: Address
    mask: Address = 0xFFFF
    initial: Byte = 0xFF


class InputBuffer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Puts the LM629 data bus on the external bus when a MOVX read addresses it."""

    address: Address
    mask: Address = 0xFFFF


class Wiring(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A board file as read: clocks, nets and what hangs on the external bus."""

    name: str
    crystal_hz: int
    data: str
    nets: dict[str, str]
    latch: tuple[Latch, ...] = ()
    buffer: tuple[InputBuffer, ...] = ()

    def data_bank(self) -> int:
        """The bank that drives the LM629 data bus."""
        if re.fullmatch(r"P[0-3]", self.data):
            return int(self.data[1])
        return self._latch_bank(self.data, "data")

    def chip_input(self, side: str, pin: str) -> tuple[int, int, int]:
        """(bank, bit, inverted) that drives an LM629 input."""
        net = f"{side}.{pin}"
        if net not in self.nets:
            raise WiringError(self.name, "nets", f"{net} is not connected", "add a line for it")
        source = self.nets[net]
        inverted = int(source.startswith("!"))
        name = source.lstrip("!")
        if name in ("0", "1"):
            return CONSTANT_BANK, 0, inverted ^ int(name == "0")
        if match := _PORT_PIN.match(name):
            return int(match[1]), int(match[2]), inverted
        latch, dot, bit = name.partition(".")
        if not dot or bit not in tuple("01234567"):
            raise WiringError(self.name, "nets", f"{net} = {source!r} is no source of an LM629 input")
        return self._latch_bank(latch, net), int(bit), inverted

    def cpu_inputs(self) -> list[tuple[int, int, str, int]]:
        """(port, bit, source, inverted) for every port pin that something outside drives."""
        inputs = []
        for net, source in self.nets.items():
            if match := _PORT_PIN.match(net):
                inputs.append((int(match[1]), int(match[2]), source.lstrip("!"), int(source.startswith("!"))))
            elif net.partition(".")[0] not in SIDES or net.partition(".")[2] not in CHIP_INPUTS:
                raise WiringError(self.name, "nets", f"{net} is neither a port pin nor an LM629 input")
        for port, _, source, _ in inputs:
            if source not in ("left.hi", "right.hi", "slot.0", "slot.1", "slot.2", "three", "0", "1"):
                raise WiringError(self.name, "nets", f"{source!r} cannot drive a pin of P{port}")
            if f"P{port}" == self.data:
                what = f"P{port} is the data bus, nothing else can drive its pins"
                raise WiringError(self.name, "nets", what)
        return inputs

    def _latch_bank(self, name: str, net: str) -> int:
        for index, latch in enumerate(self.latch):
            if latch.name == name:
                return PORTS + index
        raise WiringError(self.name, net, f"there is no latch called {name!r}")


def load_wiring(path: Path | None = None) -> Wiring:
    """Reads a board file; the MIRO board when no path is given. Raises WiringError naming file and place."""
    if path is None:
        miro = _miro()
        return msgspec.structs.replace(miro, nets=dict(miro.nets))
    try:
        text = read_input(path, BOARD_BYTES).decode()
    except InputError as error:
        raise WiringError(str(path), "", f"{error.what}; {error.remedy}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise WiringError(str(path), "", f"{error}") from error
    return _wiring(text, str(path))


@cache
def _miro() -> Wiring:
    """The MIRO board, read once: every robot of a world has one."""
    return _wiring((Path(__file__).parent / "boards" / "miro.toml").read_text("utf-8"), "miro.toml")


def _wiring(text: str, origin: str) -> Wiring:
    with WiringError.at(origin):
        wiring = struct_of(tables(text), Wiring)
    if len(wiring.latch) > MAX_LATCHES:
        raise WiringError(origin, "latch", f"{len(wiring.latch)} latches, at most {MAX_LATCHES} fit")
    if len(wiring.buffer) > MAX_BUFFERS:
        raise WiringError(origin, "buffer", f"{len(wiring.buffer)} buffers, at most {MAX_BUFFERS} fit")
    if wiring.crystal_hz != 24_000_000:
        raise WiringError(origin, "crystal_hz", "only 24000000 is supported, time is counted in its ticks")
    wiring.data_bank()
    wiring.cpu_inputs()
    for side in SIDES:
        for pin in CHIP_INPUTS:
            wiring.chip_input(side, pin)
    return wiring
