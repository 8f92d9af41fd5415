"""The values of a board's parts by their path, `PART.KEY`: what a test may put, and what it may read.

A level can be put on a port pin that nothing drives, too: `P1.0 = 0`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgspec

from miro_exact.bad_input import did_you_mean
from miro_exact.plugins import use_one_of
from miro_protocol.toml_text import TomlError, struct_of
from miro_robot.parts.keys import PartKeys

_PORT_PIN = re.compile(r"P[0-3]\.[0-7]")
Parts = Mapping[str, PartKeys]
"""The parts of a board by their names."""


def leaves(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """The values of a table of tables, by their paths."""
    for key, value in table.items():
        path = f"{above}{key}"
        if isinstance(value, Mapping):
            yield from leaves(value, f"{path}.")
        else:
            yield path, value


def checked_read(parts: Parts, path: str) -> tuple[str, str]:
    """Part and key of a value that may be read. Raises ValueError: reason; remedy."""
    name, key, keys = _part_of(parts, path)
    return name, _known(path, key, list(keys.READS), f"part {name!r} ({keys.name}) has no value {key!r}")


def checked_put(parts: Parts, path: str, value: Any) -> tuple[str, str, Any]:
    """Part, key, and the value as the part takes it; of a pin, port and bit. Raises ValueError: reason; remedy."""
    if _PORT_PIN.fullmatch(path) and path[:2] not in parts:
        if value not in (0, 1):
            raise ValueError(f"{path} = {value!r}: is no level; use 0 or 1")
        return path[:2], path[3:], int(value)
    name, key, keys = _part_of(parts, path)
    _known(path, key, list(keys.PUTS), f"nothing can be put at {key!r} of part {name!r} ({keys.name})")
    kind = keys.PUTS[key]
    try:
        return name, key, struct_of(value, kind)
    except TomlError as error:
        raise ValueError(f"{path} = {value!r}: {error.what}; {_takes(kind) or error.remedy}") from None


def _part_of(parts: Parts, path: str) -> tuple[str, str, PartKeys]:
    name, dot, key = path.partition(".")
    if name not in parts and path.count(".") > 1:  # of several boards: BOARD.PART.KEY
        board, name, key = path.split(".", 2)
        name = f"{board}.{name}"
    if not dot or not key:
        raise ValueError(f"{path!r} is not PART.KEY; name a part and its value, such as eyes.distance_cm")
    if not parts:
        raise ValueError(f"{path}: the board has no parts; add [parts.{name}] to the board's file")
    if name not in parts:
        remedy = did_you_mean(name, list(parts)) or f"its parts are {', '.join(parts)}"
        raise ValueError(f"{path}: the board has no part {name!r}; {remedy}")
    return name, key, parts[name]


def _known(path: str, key: str, keys: Sequence[str], reason: str) -> str:
    if key not in keys:
        remedy = did_you_mean(key, keys) or (use_one_of(keys) if keys else "leave it out")
        raise ValueError(f"{path}: {reason}; {remedy}")
    return key


def _takes(kind: Any) -> str:
    """Text about the possible words of a key, if there are few."""
    info = msgspec.inspect.type_info(kind)
    options = info.types if isinstance(info, msgspec.inspect.UnionType) else (info,)
    literals = [literal for literal in options if isinstance(literal, msgspec.inspect.LiteralType)]
    return use_one_of([str(value) for literal in literals for value in literal.values]) if literals else ""
