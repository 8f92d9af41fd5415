"""Writes the tables of protocol/README.md, as columns of text: `python -m docs.site.protocol_tables`."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from miro_protocol import table
from miro_protocol.table import DOWNLINK, TELEMETRY, Field, Format, FrameType, Opcode


def render() -> str:
    """Frames, messages, flags and times, ending in a newline."""
    parts = (_frames(), _types(), _fields(), _flags(), _times())
    return "\n".join("\n".join(("```text", *part, "```")) + "\n" for part in parts)


def _rows(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[str]:
    return _columns([heads, *rows])


def _columns(rows: Iterable[Sequence[object]]) -> Iterator[str]:
    """Text in columns, two blanks apart."""
    lines = [tuple(str(cell) for cell in row) for row in rows]
    widths = [max(len(cell) for cell in column) for column in zip(*lines, strict=True)]
    for line in lines:
        yield "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()


def _frames() -> Iterator[str]:
    heads = ("frame", "preamble", "payload", "characters", "air time", "layout byte")
    return _rows(heads, (_frame(form) for form in (*DOWNLINK.values(), TELEMETRY)))


def _frame(form: Format) -> tuple[object, ...]:
    preamble = f"55h x{form.lead.count(0x55)}, FFh"
    air = f"{form.air_ticks / table.TICKS_PER_MS:.2f} ms"
    return form.name, preamble, form.payload_size, form.wire_size, air, f"{form.layout:02X}h"


def _types() -> Iterator[str]:
    return _rows(("type", "meaning"), ((f"{kind:d}", table.FRAME_MEANINGS[kind]) for kind in FrameType))


def _fields() -> Iterator[str]:
    """A title for each message, then its fields: offset, names, range, meaning."""
    start = sum(field.size for field in table.SERVICE)
    messages = [
        ("type 0, 3: each robot", table.VELOCITY, 0),
        ("type 1", table.SERVICE, 0),
        *(
            (f"type 1, opcode {code:d} {code.name.lower()}", table.SERVICE_DATA[code], start)
            for code in Opcode
            if table.SERVICE_DATA[code]
        ),
        ("type 2", table.TELEMETRY_FIELDS, 0),
    ]
    yield "payload from byte .. on, field, range, meaning"
    for title, fields, offset in messages:
        yield title
        yield from (f"  {row}" for row in _columns(_offsets(fields, offset)))


def _offsets(fields: Iterable[Field], start: int) -> Iterator[Sequence[object]]:
    """A row for each run of neighbouring fields that have range and meaning in common."""
    placed = []
    for field in fields:
        placed.append((start, field))
        start += field.size
    for (limits, meaning), run in groupby(placed, key=lambda pair: _about(pair[1])):
        offsets, names = zip(*((str(offset), field.name) for offset, field in run), strict=True)
        yield ",".join(offsets), ", ".join(names), limits, meaning


def _about(field: Field) -> tuple[str, str]:
    """Type with its limits, unless it may have all values; meaning with its unit, without the field's own name."""
    whole = (field.low, field.high) == (0, (1 << 8 * field.size) - 1)
    limits = field.c_type if whole else f"{field.c_type} {field.low}..{field.high}"
    meaning = field.meaning.replace(f" {field.name},", ",")
    return limits, f"{meaning}, {field.unit}" if field.unit else meaning


def _flags() -> Iterator[str]:
    rows = ((f"{flag:02X}h", meaning) for flag, meaning in table.FLAG_MEANINGS.items())
    return _rows(("telemetry flag", "meaning"), rows)


def _times() -> Iterator[str]:
    rows = (
        ("bit of the host", table.HOST_BIT_TICKS),
        ("bit of a robot", table.ROBOT_BIT_TICKS),
        ("carrier before the first start bit", table.KEYUP_TICKS),
        ("from start bit to start bit", table.SPACING_TICKS),
        ("tolerance of that, either way", table.SPACING_TOLERANCE_TICKS),
        ("any other `seq` is fresh again", table.FRESH_AGAIN_TICKS),
        ("failsafe: smooth stop", table.FAILSAFE_STOP_TICKS),
        ("failsafe: motors off", table.FAILSAFE_OFF_TICKS),
    )
    texts = ((name, ticks, f"{ticks / table.TICKS_PER_MS:.6g}") for name, ticks in rows)
    return _rows(("time", "ticks of 24 MHz", "ms"), texts)


if __name__ == "__main__":
    sys.stdout.write(render())
