"""Board files, `NAME.board.toml`: finding one, reading it, and saying in one line what is wrong with it.

Nothing but `BoardError`, or another error of bad input, leaves these functions, whatever the text.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
from msgspec import Meta

import miro_robot.boards
from miro_exact.bad_input import BadInput, amount, did_you_mean
from miro_exact.inputs import BOARD_BYTES, InputError, read_input
from miro_exact.plugins import PluginError, use_one_of
from miro_exact.raised import raised
from miro_protocol.toml_text import check_numbers, struct_of, tables, what_and_path, without_none
from miro_robot.board_spec import (
    XRAM_BYTES,
    BoardSpec,
    BufferSpec,
    LatchSpec,
    PartSpec,
    StrapSpec,
)  # fmt: skip
from miro_robot.mcs51.chips import CHIPS
from miro_robot.parts.keys import IN, MOST_PINS, OPEN_DRAIN, STRONG, TWO_WAY, PartKeys, Pin
from miro_robot.parts.resolve import NAME, BoardError, resolve
from miro_robot.wiring import check_no_wiring
from miro_sim.scenario.base import is_path
from miro_sim.scenario.errors import choices_of, explained, value_at
from miro_sim.scenario.file import decode
from miro_sim.scenario.parts import PARTS

ENDING = ".board.toml"
_BUILTIN = Path(miro_robot.boards.__file__).parent
_FASTEST_BIT_TICKS = 32
MOST_PART_PINS = MOST_PINS - 2

_REMEDIES = {
    "crystal_hz": "give what is printed on the crystal, 32_768 to 40_000_000, as crystal_hz = 11_059_200",
}
_T = TypeVar("_T", bound=msgspec.Struct)
Crystal = Annotated[int, Meta(ge=32_768, le=40_000_000)]


class _Serial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    baud: Annotated[int, Meta(ge=1)]


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The tables of a board file; `parts` are read one by one, by what each says it is."""

    name: Annotated[str, Meta(max_length=64, pattern=r"^[A-Za-z0-9_.-]+$")] = "board"
    chip: str = "at89c52"
    crystal_hz: Crystal
    mode: str = "12T"
    xram: Literal["none", "internal", "external"] | None = None
    xram_bytes: Annotated[int, Meta(ge=1, le=XRAM_BYTES)] | None = None
    pull_ups: tuple[str, ...] = ()
    pull_downs: tuple[str, ...] = ()
    allow_contention: tuple[str, ...] = ()
    nets: dict[str, str | tuple[str, ...]] = {}
    straps: dict[str, StrapSpec] = {}
    latches: dict[str, LatchSpec] = {}
    buffers: dict[str, BufferSpec] = {}
    serial: _Serial | None = None
    parts: dict[str, dict[str, Any]] = {}

    @property
    def memory(self) -> Literal["none", "internal", "external"]:
        """The memory accessed by MOVX. Default: the RAM of the chip, if it has one, which is on after a reset."""
        return self.xram or ("internal" if CHIPS[self.chip].xram_bytes else "none")


KEYS = _File.__struct_encode_fields__


# Finding and reading


def builtin_boards() -> list[str]:
    """Names of the boards that come with the package, sorted."""
    return sorted(entry.name.removesuffix(ENDING) for entry in _BUILTIN.glob(f"*{ENDING}"))


def load_board(source: str) -> BoardSpec:
    """The board of a file (a path ends in .toml or has a separator) or of a built-in name. Raises BadInput."""
    stem = Path(source).name.removesuffix(".toml").removesuffix(".board")
    name = re.sub(r"[^A-Za-z0-9_.-]+", "-", stem)[:64] or "board"
    with BoardError.at(source):
        table = tables(board_text(source))
    return board_of_table(table, source, name)


def board_text(source: str) -> str:
    """The text of a board file, which may be wrong. Raises BadInput."""
    if not is_path(source):
        names = builtin_boards()
        if source not in names:
            remedy = f"built-in boards: {', '.join(names)}; a file needs a path that ends in .toml"
            raise BoardError(source, "", "no such board", did_you_mean(source, names, remedy))
        return (_BUILTIN / f"{source}{ENDING}").read_text("utf-8")
    try:
        return decode(read_input(source, BOARD_BYTES), source)
    except InputError as error:
        raise BoardError(source, "", error.what, error.remedy) from None
    except FileNotFoundError:
        raise BoardError(source, "", "no such file", "`mirotwin boards` lists the built-in boards") from None
    except (OSError, ValueError) as error:
        if isinstance(error, BadInput):
            raise
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise BoardError(source, "", f"cannot be read: {reason}") from None


def board_of_table(table: dict[str, Any], origin: str, name: str = "board") -> BoardSpec:
    """The board of the tables of a file, which `origin` names. Raises BadInput. `name`: if the tables say none."""
    with BoardError.at(origin):
        check_no_wiring(table)
        check_numbers(table)
        file = _read(table, _File)
        parts = {part: _part(part, keys) for part, keys in file.parts.items()}
        spec = _spec(file, parts, name if "name" not in table else file.name)
        try:
            resolve(spec)
        except BadInput:
            raise
        except (Exception, SystemExit) as error:  # of a part that another distribution brought
            raise BoardError("", "parts", f"cannot be wired: {raised(error)}", "repair the part") from error
        return spec


def _read(table: dict[str, Any], struct: type[_T]) -> _T:
    """The struct that a table says. Raises BoardError with the key, what is wrong and the remedy."""
    try:
        return msgspec.convert(table, struct)
    except msgspec.ValidationError as error:
        problem, path = what_and_path(f"{error}")
    if problem.startswith("Object ") or "..." in path:
        try:
            return struct_of(table, struct)
        except BadInput as error:
            remedy = _REMEDIES.get(f"{error.place}", error.remedy)
            raise BoardError("", error.place, error.what, remedy) from None
    choices = _REMEDIES.get(path) or choices_of(struct, path)
    raise BoardError("", path, *explained(problem, path, value_at(table, path), choices))


def _spec(file: _File, parts: dict[str, PartSpec], name: str) -> BoardSpec:
    _check_processor(file)
    _check_memory(file)
    baud = 0 if file.serial is None else file.serial.baud
    if baud * _FASTEST_BIT_TICKS > file.crystal_hz:
        most = file.crystal_hz // _FASTEST_BIT_TICKS
        raise BoardError("", "serial.baud", f"{baud} is out of range", f"must be <= {most} with this crystal")
    return BoardSpec(
        name=name,
        chip=file.chip,
        crystal_hz=file.crystal_hz,
        xram=file.memory,
        xram_bytes=_xram_bytes(file),
        of_file=True,
        pull_ups=file.pull_ups,
        pull_downs=file.pull_downs,
        allow_contention=file.allow_contention,
        nets={net: (pins,) if isinstance(pins, str) else pins for net, pins in file.nets.items()},
        straps=file.straps,
        latches=file.latches,
        buffers=file.buffers,
        baud=baud,
        parts=parts,
    )


def _check_processor(file: _File) -> None:
    if file.chip not in CHIPS:
        remedy = did_you_mean(file.chip, CHIPS, use_one_of(CHIPS))
        raise BoardError("", "chip", f"there is no chip {file.chip!r}", remedy)
    if file.mode != "12T":
        problem = "6T mode is not modelled" if file.mode == "6T" else f"{file.mode!r} is no mode"
        remedy = "leave it out and give twice the crystal as crystal_hz" if file.mode == "6T" else 'use "12T"'
        raise BoardError("", "mode", problem, remedy)
    if file.xram == "internal" and not CHIPS[file.chip].xram_bytes:
        having = [chip for chip, kind in CHIPS.items() if kind.xram_bytes]
        problem = f"{file.chip} has no RAM of its own for MOVX"
        raise BoardError("", "xram", problem, f'use "none" or "external", or chip = "{having[0]}"')


def _check_memory(file: _File) -> None:
    """Checks that no two memories answer to one address of MOVX."""
    if file.xram_bytes is not None and file.memory != "external":
        raise BoardError(
            "", "xram_bytes", f"the board's xram is {file.memory!r}", 'give xram = "external", too'
        )
    for table in ("latches", "buffers"):
        before: dict[str, LatchSpec | BufferSpec] = {}
        for name, device in getattr(file, table).items():
            place = f"{table}.{name}"
            if device.address & ~device.mask:
                problem = f"address {device.address:#06x} has bits that mask {device.mask:#06x} leaves out"
                raise BoardError("", place, problem, "no address would match; clear them in the address")
            for other, there in before.items():
                if not (device.address ^ there.address) & device.mask & there.mask:
                    address = device.address | there.address
                    problem = f"answers to address {address:#06x}, as {table}.{other} does"
                    raise BoardError("", place, problem, "give one another address, or a mask of more bits")
            if file.xram == "external" and device.address < _xram_bytes(file):
                problem = f"answers to address {device.address:#06x}, as the external RAM does"
                raise BoardError("", place, problem, f"give xram_bytes of at most {device.address:#x}")
            before[name] = device


def _xram_bytes(file: _File) -> int:
    return XRAM_BYTES if file.xram_bytes is None else file.xram_bytes


# Parts


def _part(name: str, table: dict[str, Any]) -> PartSpec:
    """A part of the file: its keys, and what its pins are wired to. Raises BadInput."""
    place = f"parts.{name}"
    with BoardError.at("", place):
        kind = table.get("part")
        if not isinstance(kind, str):
            problem = "this key is missing" if kind is None else "expected a string"
            raise BoardError("", "part", problem, 'say which part it is, as part = "led"')
        try:
            struct = PARTS.find(kind)
            check_struct(struct)
        except PluginError as error:
            raise BoardError("", "part", error.what, error.remedy) from error
        own = {key: value for key, value in table.items() if key != "pins"}
        with BoardError.at("", "pins"):
            pins = struct_of(table.get("pins", {}), dict[str, str])
        return PartSpec(keys=keys_of(struct, own), pins=pins)


def keys_of(struct: type[PartKeys], table: dict[str, Any]) -> PartKeys:
    """The keys of a part. Raises BadInput with the key."""
    try:
        return _read(table, struct)
    except BadInput as error:
        pins = [pin.name for pin in struct.PINS]
        if error.what == "unknown key" and error.place in pins:
            remedy = f"it is a pin: write pins = {{ {error.place} = .. }}"
        elif error.what == "unknown key" and not struct.__struct_encode_fields__:
            remedy = "this part has no keys but part and pins"
        else:
            remedy = error.remedy or f"see `mirotwin boards show {struct.__struct_config__.tag}`"
        raise BoardError("", error.place, error.what, remedy) from None
    except (Exception, SystemExit) as error:
        problem = f"part {struct.__struct_config__.tag!r} cannot check its keys: {raised(error)}"
        raise BoardError("", "", problem, "repair the part") from error


def check_struct(struct: type[PartKeys]) -> None:
    """Checks a part's pins and values, as it may come from another author. Raises PluginError."""
    name, pins = struct.__struct_config__.tag, struct.PINS
    if not isinstance(pins, tuple) or not all(isinstance(pin, Pin) for pin in pins):
        raise PluginError(f"part {name!r}: PINS are {pins!r:.80}", "write PINS = (Pin(..), Pin(..))")
    if len(pins) > MOST_PART_PINS:
        problem = f"part {name!r} has {amount(len(pins), 'pin')}"
        raise PluginError(problem, f"a part has at most {MOST_PART_PINS}")
    names = [pin.name for pin in pins]
    for pin in pins:
        if not isinstance(pin.name, str) or not NAME.fullmatch(pin.name) or names.count(pin.name) > 1:
            problem = f"part {name!r}: a pin is called {pin.name!r}"
            raise PluginError(problem, "give each a name of its own, of letters, digits and _")
        if pin.kind not in (IN, STRONG, OPEN_DRAIN, TWO_WAY) or pin.level not in (0, 1):
            problem = f"part {name!r}: pin {pin.name} is {pin!r:.120}"
            raise PluginError(problem, "kind is IN, STRONG, OPEN_DRAIN or TWO_WAY, level 0 or 1")
    for word, values in (("PUTS", struct.PUTS), ("READS", struct.READS)):
        if not isinstance(values, dict) or not all(isinstance(key, str) for key in values):
            raise PluginError(f"part {name!r}: {word} is {values!r:.80}", f'write {word} = {{"name": ..}}')
    for key, kind in struct.PUTS.items():
        try:
            msgspec.inspect.type_info(kind)
        except (Exception, SystemExit) as error:
            problem = f"part {name!r}: PUTS[{key!r}] is no type of a value: {raised(error)}"
            raise PluginError(
                problem, "use bool, int, float, Literal[..], or Annotated[float, Meta(..)]"
            ) from error


# Writing


def table_of(spec: BoardSpec) -> dict[str, Any]:
    """A board as the tables of its file: what a recording holds. `board_of_table` reads it."""
    table = without_none(msgspec.to_builtins(spec))  # TOML has no null
    table["parts"] = {
        name: {**without_none(msgspec.to_builtins(part.keys)), "pins": part.pins}
        for name, part in spec.parts.items()
    }
    if baud := table.pop("baud"):
        table["serial"] = {"baud": baud}
    if spec.xram != "external":
        del table["xram_bytes"]
    for key in ("code_in_xram", "start", "bound_stack", "of_file"):  # a board file has none of these
        del table[key]
    return {key: value for key, value in table.items() if value not in ([], (), {})}
