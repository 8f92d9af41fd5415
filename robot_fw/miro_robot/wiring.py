"""The wiring of the fast `Board` from a board file: the source or target of each pin of its two LM629.

A board file (`NAME.board.toml`) says who shares a net; here it is point to point: an input pin of an LM629 or of the
CPU on the left, its source on the right. Sources are port pins (`P2.3`), bits of an output latch that MOVX writes
(`CTRL.3`), outputs of an LM629 (`left.hi`), straps (`slot.0`, `three`), or the constants `0` and `1`; a leading `!`
inverts. The data bus of the LM629 is one shared, pulled-up bus whose drivers can only pull low. Which bridge and motors
hang on an LM629 is the plant's, and the parts of a file that say so are left to `WiredBoard`.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.inputs import BOARD_BYTES, InputError, read_input
from miro_protocol.toml_text import struct_of, tables
from miro_robot.board_spec import Address, BufferSpec, Byte, LatchSpec, StrapSpec

SIDES = ("left", "right")
CHIP_INPUTS = ("cs", "rd", "wr", "ps", "rst")
PORTS = 4
MAX_LATCHES = MAX_BUFFERS = 8
CONSTANT_BANK = PORTS + MAX_LATCHES
"""Banks of eight levels a chip input can be taken from: four ports, the latches, and one of constant ones."""

_STRAPS = {"slot0": "slot.0", "slot1": "slot.1", "slot2": "slot.2", "three": "three"}
"""Straps of a file whose levels are the robot's slot, and whether its network has three robots."""
_PORT_PIN = re.compile(r"P([0-3])\.([0-7])$")


class WiringError(BadInput):
    """A board file that cannot be built: file, key, what, remedy."""


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
    """Point to point: clocks, nets and what hangs on the external bus."""

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
        return self._latch_bank(self.data, "parts.left.pins.d0")

    def chip_input(self, side: str, pin: str) -> tuple[int, int, int]:
        """(bank, bit, inverted) that drives an LM629 input."""
        net = f"{side}.{pin}"
        if net not in self.nets:
            raise WiringError("", f"parts.{side}.pins", f"pin {pin} is not connected", f'add {pin} = ".."')
        source = self.nets[net]
        inverted = int(source.startswith("!"))
        name = source.lstrip("!")
        if name in ("0", "1"):
            return CONSTANT_BANK, 0, inverted ^ int(name == "0")
        if match := _PORT_PIN.match(name):
            return int(match[1]), int(match[2]), inverted
        latch, dot, bit = name.partition(".")
        place = f"parts.{side}.pins.{pin}"
        if not dot or bit not in tuple("01234567"):
            problem = f"{source!r} drives no LM629 of the fast board"
            raise WiringError("", place, problem, "name a port pin, a bit of a latch, 0 or 1")
        return self._latch_bank(latch, place), int(bit), inverted

    def cpu_inputs(self) -> list[tuple[int, int, str, int]]:
        """(port, bit, source, inverted) for every port pin that something outside drives."""
        inputs = []
        for net, source in self.nets.items():
            if match := _PORT_PIN.match(net):
                inputs.append((int(match[1]), int(match[2]), source.lstrip("!"), int(source.startswith("!"))))
                if f"P{match[1]}" == self.data:
                    problem = f"{net} is a pin of the data bus, nothing else can drive it"
                    raise WiringError("", "parts.left.pins.d0", problem, "wire the other to another port")
        return inputs

    def _latch_bank(self, name: str, place: str) -> int:
        for index, latch in enumerate(self.latch):
            if latch.name == name:
                return PORTS + index
        raise WiringError("", place, f"there is no latch {name!r}", f"add [latches.{name}]")


class _Chip(msgspec.Struct, frozen=True):
    """A part of a board file."""

    part: str
    pins: dict[str, str] = {}


class _BoardFile(msgspec.Struct, frozen=True):
    """The part of a board file that concerns the fast board; the rest is read by the code that builds all parts."""

    crystal_hz: int
    name: str = "board"
    nets: dict[str, str | tuple[str, ...]] = {}
    straps: dict[str, StrapSpec] = {}
    latches: dict[str, LatchSpec] = {}
    buffers: dict[str, BufferSpec] = {}
    parts: dict[str, _Chip] = {}


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
    return _wiring(
        (Path(__file__).parent / "boards" / "miro.board.toml").read_text("utf-8"), "miro.board.toml"
    )


def _wiring(text: str, origin: str) -> Wiring:
    with WiringError.at(origin):
        table = tables(text)
        check_no_wiring(table)
        board = struct_of(table, _BoardFile)
        if board.crystal_hz != 24_000_000:
            problem = "the fast board has 24000000 only, time is counted in its ticks"
            raise WiringError("", "crystal_hz", problem, "run it as a board of parts")
        for key, there, most in (
            ("latches", board.latches, MAX_LATCHES),
            ("buffers", board.buffers, MAX_BUFFERS),
        ):
            if len(there) > most:
                raise WiringError("", key, f"{len(there)} {key}, at most {most} fit", "leave some out")
        wiring = _point_to_point(board)
        wiring.data_bank()
        wiring.cpu_inputs()
        for side in SIDES:
            for pin in CHIP_INPUTS:
                wiring.chip_input(side, pin)
        return wiring


def _point_to_point(board: _BoardFile) -> Wiring:
    """The sources of all pins that the fast board knows."""
    ports = {net: (pins,) if isinstance(pins, str) else pins for net, pins in board.nets.items()}
    nets: dict[str, str] = {}
    buses = []
    for side in SIDES:
        if side not in board.parts or board.parts[side].part != "lm629":
            raise WiringError(
                "", f"parts.{side}", "the fast board has two LM629", 'add it, with part = "lm629"'
            )
        pins = {pin: _in_ports(word, ports) for pin, word in board.parts[side].pins.items()}
        nets |= {f"{side}.{pin}": pins[pin][0] for pin in CHIP_INPUTS if pin in pins}
        for word in pins.get("hi", ()):
            source = f"!{side}.hi" if word.startswith("!") else f"{side}.hi"
            _drive(nets, word.removeprefix("!"), source, f"parts.{side}.pins.hi")
        buses.append([pins.get(f"d{bit}", ("",))[0] for bit in range(8)])
    data = buses[0][0].partition(".")[0]
    if any(bus != [f"{data}.{bit}" for bit in range(8)] for bus in buses):
        problem, remedy = (
            "the fast board has one data bus",
            "wire d0 to d7 of both to one port or latch, in order",
        )
        raise WiringError("", "parts.left.pins", problem, remedy)
    for name, strap in board.straps.items():
        for pin in _in_ports(strap.pin, ports):
            _drive(nets, pin, _STRAPS.get(name, str(strap.level)), f"straps.{name}.pin")
    latches = sorted(board.latches.items())
    return Wiring(
        name=board.name,
        crystal_hz=board.crystal_hz,
        data=data,
        nets=nets,
        latch=tuple(Latch(name, latch.address, latch.mask, latch.initial) for name, latch in latches),
        buffer=tuple(InputBuffer(buffer.address, buffer.mask) for _, buffer in sorted(board.buffers.items())),
    )


def _in_ports(word: str, ports: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
    """A pin's word in the file, with the port pins of a net instead of its name."""
    name = word.removeprefix("!")
    return tuple(f"!{pin}" if word.startswith("!") else pin for pin in ports.get(name, (name,)))


def _drive(nets: dict[str, str], pin: str, source: str, place: str) -> None:
    """Something drives a port pin of the CPU. Raises WiringError if it is none, or driven already."""
    if not _PORT_PIN.match(pin):
        problem = f"{pin!r} is no port pin, and the fast board knows nothing else there"
        raise WiringError("", place, problem, "name a port pin, as P3.2")
    if pin in nets:
        raise WiringError("", place, f"{pin} is driven by {nets[pin]}, too", "use another pin")
    nets[pin] = source


def check_no_wiring(table: dict[str, Any]) -> None:
    """Refuses an old wiring file. Raises WiringError."""
    for key in ("data", "latch", "buffer"):
        if key in table:
            problem = "this is an old wiring file, not a board file"
            raise WiringError("", key, problem, "write its parts as `mirotwin boards show miro` does")
