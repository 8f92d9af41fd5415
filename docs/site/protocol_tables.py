"""Writes the tables of protocol/README.md from the table: `python -m docs.site.protocol_tables`."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence

from miro_protocol import table
from miro_protocol.table import DOWNLINK, TELEMETRY, Field, Format, FrameType, Opcode


def render() -> str:
    """Frames, messages, flags and times, ending in a newline."""
    parts = (_frames(), _types(), _fields(), _flags(), _times())
    return "\n".join("\n".join(part) + "\n" for part in parts)


def _rows(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[str]:
    yield "| " + " | ".join(heads) + " |"
    yield "|" + "---|" * len(heads)
    for row in rows:
        yield "| " + " | ".join(str(cell) for cell in row) + " |"


def _frames() -> Iterator[str]:
    heads = ("frame", "preamble", "sync", "HDR", "payload", "CRC", "characters", "air time", "layout byte")
    return _rows(heads, (_frame(form) for form in (*DOWNLINK.values(), TELEMETRY)))


def _frame(form: Format) -> tuple[object, ...]:
    preamble = f"55h x{form.lead.count(0x55)}, FFh"
    sync = " ".join(f"{byte:02X}h" for byte in form.sync)
    air = f"{form.air_ticks / table.TICKS_PER_MS:.2f} ms"
    return form.name, preamble, sync, 1, form.payload_size, 2, form.wire_size, air, f"{form.layout:02X}h"


def _types() -> Iterator[str]:
    return _rows(("type", "meaning"), ((f"{kind:d}", table.FRAME_MEANINGS[kind]) for kind in FrameType))


def _fields() -> Iterator[str]:
    rows: list[Sequence[object]] = []
    rows += _offsets("0, 3, each robot", table.VELOCITY, 0)
    rows += _offsets("1", table.SERVICE, 0)
    start = sum(field.size for field in table.SERVICE)
    for opcode in Opcode:
        rows += _offsets(f"1, opcode {opcode:d} {opcode.name.lower()}", table.SERVICE_DATA[opcode], start)
    rows += _offsets("2", table.TELEMETRY_FIELDS, 0)
    return _rows(("in type", "offset", "field", "is", "range", "unit", "meaning"), rows)


def _offsets(where: str, fields: Iterable[Field], start: int) -> Iterator[Sequence[object]]:
    for field in fields:
        limits = f"{field.low}..{field.high}"
        yield where, start, field.name, field.c_type, limits, field.unit, field.meaning
        start += field.size


def _flags() -> Iterator[str]:
    rows = ((f"{flag:02X}h", meaning) for flag, meaning in table.FLAG_MEANINGS.items())
    return _rows(("telemetry flag", "meaning"), rows)


def _times() -> Iterator[str]:
    rows = (
        ("bit, host / robot", table.HOST_BIT_TICKS, f"{table.ROBOT_BIT_TICKS} in robot to host"),
        ("carrier before the first start bit", table.KEYUP_TICKS, ""),
        ("spacing of characters", table.SPACING_TICKS, f"+-{table.SPACING_TOLERANCE_TICKS}"),
        ("any other number is fresh again", table.FRESH_AGAIN_TICKS, "after the last fresh frame"),
        ("failsafe: smooth stop", table.FAILSAFE_STOP_TICKS, "without a fresh frame"),
        ("failsafe: motors off", table.FAILSAFE_OFF_TICKS, "without a fresh frame"),
    )
    texts = ((name, ticks, f"{ticks / table.TICKS_PER_MS:.6g}", note) for name, ticks, note in rows)
    return _rows(("time", "ticks of 24 MHz", "ms", ""), texts)


if __name__ == "__main__":
    sys.stdout.write(render())
