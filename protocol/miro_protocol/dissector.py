"""Writes the Wireshark dissector, in Lua: `python -m miro_protocol.dissector > miro.lua`.

A packet is a run of characters without a pause, as `pcapng.py` writes them, so the spacing rule holds within it and
ends with it; stop bits are not in a capture. Which way a packet went is RTAC's event type, and N is the number of
robots with which the CRC is good, because the layout byte differs for 3 and 5. A packet may hold several frames.

What the table decides becomes Lua tables here; `dissector.lua` reads them. XOR is done by a table of nibbles there,
because Wireshark's Lua has had bit operators under three names since 5.1.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from textwrap import fill
from typing import Any

from miro_protocol import crc, table, whitening
from miro_protocol.pcapng import EVENTS
from miro_protocol.table import DOWNLINK, TELEMETRY, Field, Format, FrameType, Opcode
from miro_protocol.transmission import DOWN, UP

_HEAD = """\
-- Wireshark dissector of the Mirotwin radio frames. Written by `python -m miro_protocol.dissector`; do not edit.
-- tshark -X lua_script:miro.lua -d rtacser.data,miro -r run.pcapng

"""


def render() -> str:
    """The whole script, ending in a newline."""
    code = Path(__file__).with_suffix(".lua").read_text(encoding="utf-8")
    return _HEAD + "".join(f"local {name} = {_shown(value)}\n" for name, value in _tables()) + f"\n{code}"


def _tables() -> Iterable[tuple[str, Any]]:
    down = [kind for kind in FrameType if kind != FrameType.TELEMETRY]
    opcodes = {
        opcode: {"name": opcode.name.lower(), "fields": _fields(table.SERVICE_DATA[opcode])}
        for opcode in Opcode
    }
    flags = [
        {"name": f"{flag.name}".lower(), "label": meaning, "mask": int(flag)}
        for flag, meaning in table.FLAG_MEANINGS.items()
    ]
    return {
        "SYNC": table.SYNC,
        "RESIDUE": crc.residue(),
        "XOR_OUT": crc.XOR_OUT,
        "SEQ_MODULUS": table.SEQ_MODULUS,
        "SLOT_MASK": table.SLOT_MASK,
        "ROBOT_COUNTS": table.ROBOT_COUNTS,
        "WHITE": tuple(whitening.STRING),
        "CRC_TABLE": crc.table_of(8),
        "NIBBLE_XOR": tuple(a ^ b for a in range(16) for b in range(16)),
        "DIRECTIONS": {
            number: way for way, event in EVENTS.items() for number in (event, event + 2)
        },  # ..._END after ..._START
        "TYPES": {kind: kind.name.lower() for kind in FrameType},
        "FORMATS": [
            *(_format(form, robots, DOWN, down) for robots, form in DOWNLINK.items()),
            _format(TELEMETRY, 0, UP, [FrameType.TELEMETRY]),
        ],
        "VELOCITY": _fields(table.VELOCITY),
        "SERVICE": _fields(table.SERVICE),
        "OPCODES": opcodes,
        "FLAGS": flags,
        "TELEMETRY": _fields(table.TELEMETRY_FIELDS),
    }.items()


def _format(form: Format, robots: int, direction: str, types: Iterable[FrameType]) -> dict[str, Any]:
    register = crc.register(bytes([form.layout]))
    names = {"name": form.name, "robots": robots, "direction": direction, "lead": form.lead}
    sizes = {"size": form.size, "body": form.body_size, "register": register}
    return {**names, **sizes, "types": dict.fromkeys(types, True)}


def _fields(fields: Iterable[Field]) -> list[dict[str, Any]]:
    return [
        {
            "name": field.name,
            "label": f"{field.name} [{field.unit}]" if field.unit else field.name,
            "size": field.size,
            "kind": f"{'' if field.signed else 'u'}int{8 * field.size}",
        }
        for field in fields
    ]


def _shown(value: Any) -> str:
    """A value in Lua; a list has a line for each item, numbers many to a line."""
    if isinstance(value, list):
        return "{\n" + "".join(f"  {_lua(item)},\n" for item in value) + "}"
    return fill(_lua(value), 110, subsequent_indent="  ") if isinstance(value, tuple) else _lua(value)


def _lua(value: Any) -> str:
    if isinstance(value, dict):
        keys = (key if type(key) is str else f"[{key:d}]" for key in value)
        return f"{{ {', '.join(f'{key} = {_lua(item)}' for key, item in zip(keys, value.values(), strict=True))} }}"
    if isinstance(value, list | tuple):
        return f"{{ {', '.join(map(_lua, value))} }}"
    if isinstance(value, bytes):
        return '"' + "".join(f"\\x{byte:02X}" for byte in value) + '"'
    return f'"{value}"' if isinstance(value, str) else str(value).lower()


if __name__ == "__main__":
    sys.stdout.write(render())
