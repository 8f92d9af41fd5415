"""Writes the Wireshark dissector, in Lua: `python -m miro_protocol.dissector > protocol/miro.lua`.

A packet is a run of characters without a pause, as `pcapng.py` writes them, so the spacing rule holds within it and
ends with it; stop bits are not in a capture. Which way a packet went is RTAC's event type, and N is the number of
robots with which the CRC is good, because the layout byte differs for 3 and 5. A packet may hold several frames.

`dissector.lua` is the part that no table decides. XOR is done by a table of nibbles there, because Wireshark's Lua has
had bit operators under three names since 5.1.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from miro_protocol import crc, table, whitening
from miro_protocol.pcapng import EVENTS
from miro_protocol.table import DOWNLINK, TELEMETRY, Field, Format, FrameType, Opcode
from miro_protocol.transmission import DOWN, UP

_HEAD = """\
-- Wireshark dissector of the Mirotwin radio frames. Written by `python -m miro_protocol.dissector`; do not edit.
-- tshark -X lua_script:protocol/miro.lua -d rtacser.data,miro -r run.pcapng

local miro = Proto("miro", "Mirotwin radio")
"""


def render() -> str:
    """The whole script, ending in a newline."""
    parts = (_numbers(), _formats(), _common_fields(), _payload_fields(), _experts(), _preferences())
    code = Path(__file__).with_suffix(".lua").read_text(encoding="utf-8")
    tables = ("\n" + "".join(f"{line}\n" for line in part) for part in parts)
    return f"{_HEAD}{''.join(tables)}\n{code}"


def _numbers() -> Iterator[str]:
    yield f"local SYNC = {_bytes(table.SYNC)}"
    yield f"local RESIDUE, XOR_OUT = 0x{crc.residue():04X}, 0x{crc.XOR_OUT:04X}"
    yield f"local SEQ_MODULUS, SLOT_MASK = {table.SEQ_MODULUS}, {table.SLOT_MASK}"
    yield from _list("WHITE", (f"0x{byte:02X}" for byte in whitening.STRING))
    yield from _list("CRC_TABLE", (f"0x{word:04X}" for word in crc.byte_table()))
    yield from _list("NIBBLE_XOR", (f"{a ^ b}" for a in range(16) for b in range(16)))


def _list(name: str, values: Iterable[str]) -> Iterator[str]:
    items = list(values)
    yield f"local {name} = {{"
    for place in range(0, len(items), 16):
        yield "  " + ", ".join(items[place : place + 16]) + ","
    yield "}"


def _bytes(data: bytes) -> str:
    return '"' + "".join(f"\\x{byte:02X}" for byte in data) + '"'


def _formats() -> Iterator[str]:
    yield f"local DIRECTIONS = {{ {', '.join(_directions())} }}"
    types = ", ".join(f'[{kind:d}] = "{kind.name.lower()}"' for kind in FrameType)
    yield f"local TYPES = {{ {types} }}"
    yield "local FORMATS = {"
    for robots, form in DOWNLINK.items():
        yield _format(form, robots, DOWN, [kind for kind in FrameType if kind != FrameType.TELEMETRY])
    yield _format(TELEMETRY, 0, UP, [FrameType.TELEMETRY])
    yield "}"


def _directions() -> Iterator[str]:
    for direction, event in EVENTS.items():
        yield f'[{event}] = "{direction}"'
        yield f'[{event + 2}] = "{direction}"'  # ..._END after ..._START


def _format(form: Format, robots: int, direction: str, types: Iterable[FrameType]) -> str:
    known = ", ".join(f"[{kind:d}] = true" for kind in types)
    register = crc.register(bytes([form.layout]))
    return (
        f'  {{ name = "{form.name}", robots = {robots}, direction = "{direction}", lead = {_bytes(form.lead)},\n'
        f"    size = {form.size}, body = {form.body_size}, register = 0x{register:04X}, types = {{ {known} }} }},"
    )


def _common_fields() -> Iterator[str]:
    types = ", ".join(f'[{kind:d}] = "{kind.name.lower()}"' for kind in FrameType)
    mask = 0xFF // table.SEQ_MODULUS * table.SEQ_MODULUS
    yield "local fields = {"
    yield '  robots = ProtoField.uint8("miro.robots", "Robots in the network"),'
    yield f'  type = ProtoField.uint8("miro.type", "Type", base.DEC, {{ {types} }}, 0x{mask:02X}),'
    yield f'  seq = ProtoField.uint8("miro.seq", "Sequence number", base.DEC, nil, 0x{table.SEQ_MODULUS - 1:02X}),'
    yield '  crc = ProtoField.uint16("miro.crc", "CRC", base.HEX),'
    yield '  crc_calculated = ProtoField.uint16("miro.crc.calculated", "CRC calculated", base.HEX),'
    yield '  crc_status = ProtoField.uint8("miro.crc.status", "CRC status", base.DEC, { [0] = "Bad", [1] = "Good" }),'
    yield '  damage = ProtoField.string("miro.damage", "Damage"),'
    yield "}"


def _payload_fields() -> Iterator[str]:
    yield "local function keep(field) fields[#fields + 1] = field; return field end"
    yield "local VELOCITIES = {"
    for slot in range(max(table.ROBOT_COUNTS)):
        yield "  { " + ", ".join(_entry(f"slot{slot}", field) for field in table.VELOCITY) + " },"
    yield "}"
    yield from _entries("local SERVICE = {", "service", table.SERVICE, "}")
    yield "local OPCODES = {"
    for opcode in Opcode:
        head = f'  [{opcode:d}] = {{ name = "{opcode.name.lower()}", fields = {{'
        yield from _entries(head, "service", table.SERVICE_DATA[opcode], "  } },")
    yield "}"
    yield from _telemetry()
    yield "miro.fields = fields"


def _telemetry() -> Iterator[str]:
    first, *rest = table.TELEMETRY_FIELDS
    flags = (
        f'keep(ProtoField.bool("miro.telemetry.{flag.name.lower()}", "{meaning}", 8, nil, 0x{flag:02X}))'
        for flag, meaning in table.FLAG_MEANINGS.items()
        if flag.name
    )
    slot = f'keep(ProtoField.uint8("miro.telemetry.slot", "slot", base.DEC, nil, 0x{table.SLOT_MASK:02X}))'
    yield "local TELEMETRY = {"
    yield f"  {{ size = {first.size}, parts = {{"
    for part in (slot, *flags):
        yield f"    {part},"
    yield "  } },"
    yield from _entries("", "telemetry", rest, "}")


def _entries(head: str, prefix: str, fields: Iterable[Field], tail: str) -> Iterator[str]:
    if head:
        yield head
    for field in fields:
        yield f"  {_entry(prefix, field)},"
    yield tail


def _entry(prefix: str, field: Field) -> str:
    kind = f"{'' if field.signed else 'u'}int{8 * field.size}"
    unit = f" [{field.unit}]" if field.unit else ""
    name = f'"miro.{prefix}.{field.name}", "{field.name}{unit}"'
    return f"{{ size = {field.size}, field = keep(ProtoField.{kind}({name})) }}"


def _experts() -> Iterator[str]:
    yield (
        'local damaged = ProtoExpert.new("miro.damaged", "Damaged", expert.group.CHECKSUM, expert.severity.WARN)'
    )
    yield (
        'local unknown_content = ProtoExpert.new("miro.content", "Unknown content", '
        "expert.group.PROTOCOL, expert.severity.WARN)"
    )
    yield "miro.experts = { damaged, unknown_content }"
    yield "local PAYLOADS"


def _preferences() -> Iterator[str]:
    choices = ['{ 1, "whatever makes the CRC good", 0 }']
    choices += [f'{{ {robots}, "{robots}", {robots} }}' for robots in table.ROBOT_COUNTS]
    text = '"Robots in the network", 0, "Decides how long a damaged frame was", '
    yield f"miro.prefs.robots = Pref.enum({text}{{ {', '.join(choices)} }}, false)"


if __name__ == "__main__":
    sys.stdout.write(render())
