"""Rows as lines of a table and as JSON objects, one a line; transmissions as a capture or a stream file.

The JSON form, for programs:

* first `{"event": "input", "file", "format", "timed", "units": {field: unit}}`
* `{"event": "frame", "offset", "tick", "time_s", "direction", "network", "type", "seq", "fresh", "fields", "data"}`;
  `tick` and `time_s` are null where the input has no times, `fresh` is null for telemetry, `fields` is null and
  `unknown` gives the reason for a frame with a good CRC but unknown content
* `{"event": "damage", "offset", "tick", "time_s", "direction", "network", "reason", "data"}`
* last `{"event": "end", ...counts}`, and before it `{"event": "error", "text"}` when the input could not be read on
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from heapq import merge
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import seconds
from miro_protocol import pcapng, stream
from miro_protocol.actions import ScriptItem
from miro_protocol.events import Damaged, Received
from miro_protocol.frames import Message, ServiceFrame, TeamFrame, describe
from miro_protocol.stream_line import FIRST_LINE, version_of
from miro_protocol.table import FLAG_MEANINGS, SERVICE_DATA, TELEMETRY_FIELDS, VELOCITY, FrameType, Opcode
from miro_protocol.transmission import Transmission, character_ticks
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.capture.source import Source

SHOWN_BYTES = 16
UNITS = {
    field.name: field.unit
    for fields in (VELOCITY, *SERVICE_DATA.values(), TELEMETRY_FIELDS)
    for field in fields
    if field.unit
}
_NUMBERS = [field.name for field in TELEMETRY_FIELDS[1:]]


def units_line() -> str:
    """The units of all fields, for people."""
    by_unit: dict[str, list[str]] = {}
    for name, unit in UNITS.items():
        by_unit.setdefault(unit, []).append(name)
    return "; ".join(f"{', '.join(names)} in {unit}" for unit, names in by_unit.items())


def head_line(timed: bool) -> str:
    position = f"{'tick':>12}  {'t [s]':>10}" if timed else f"{'offset':>10}"
    return f"{position}  dir  net  {'frame':<12}  seq  {'state':<12}  fields"


def table_line(row: DecodedRow, timed: bool) -> str:
    """One row as text; damage with its first bytes."""
    event = row.event
    tick = event.start_tick
    position = f"{tick:>12}  {seconds(tick):>10.4f}" if timed else f"{row.offset:>10}"
    head = f"{position}   {row.direction}   {row.network:>3}"
    if isinstance(event, Damaged):
        shown = event.data[:SHOWN_BYTES].hex(" ") + (" .." if len(event.data) > SHOWN_BYTES else "")
        return f"{head}  {'damage':<12}    -  {reason(event):<12}  {amount(len(event.data), 'byte')}: {shown}"
    state = "-" if row.fresh is None else "accepted" if row.fresh else "stale"
    return f"{head}  {kind(event, row.message):<12}  {event.seq:>3}  {state:<12}  {contents(row)}"


def reason(event: Damaged) -> str:
    return event.reason.name.lower().replace("_", " ")


def kind(event: Received, message: Message | None) -> str:
    """`team`, `filter`, `telemetry`: a service frame goes by its opcode."""
    if isinstance(message, ServiceFrame):
        return Opcode(message.opcode).name.lower()
    return FrameType(event.type).name.lower()


def described(row: DecodedRow) -> str:
    """A short description of a frame or of the damage; it becomes the comment in a stream file."""
    event = row.event
    if isinstance(event, Damaged):
        return f"{amount(len(event.data), 'byte')}, {reason(event)}"
    return describe(row.message) if row.message is not None else f"unknown content: {row.unknown}"


def contents(row: DecodedRow) -> str:
    """The fields of a frame in one line."""
    message = row.message
    if message is None:
        return f"unknown content: {row.unknown}"
    if isinstance(message, TeamFrame):
        return "  ".join(f"{slot}: {a:+d}/{b:+d}" for slot, (a, b) in enumerate(message.velocities))
    return " ".join(f"{name}={_shown(value)}" for name, value in _fields(message).items())


def _shown(value: Any) -> str:
    return ("+".join(value) or "none") if isinstance(value, list) else str(value)


def json_line(row: DecodedRow, timed: bool) -> str:
    """One row as a JSON object."""
    event = row.event
    position = {
        "offset": row.offset,
        "tick": event.start_tick if timed else None,
        "time_s": seconds(event.start_tick) if timed else None,
        "direction": row.direction,
        "network": row.network,
    }
    if isinstance(event, Damaged):
        return json_event("damage", **position, reason=reason(event), data=event.data.hex())
    fields = None if row.message is None else _fields(row.message)
    frame = {"type": kind(event, row.message), "seq": event.seq, "fresh": row.fresh, "fields": fields}
    unknown = {"unknown": row.unknown} if row.unknown else {}
    return json_event("frame", **position, **frame, **unknown, data=event.data.hex())


def _fields(message: Message) -> dict[str, Any]:
    """The content of a frame besides its type and number."""
    if isinstance(message, TeamFrame):
        names = [field.name for field in VELOCITY]
        return {"velocities": [dict(zip(names, pair, strict=True)) for pair in message.velocities]}
    if isinstance(message, ServiceFrame):
        data = zip(SERVICE_DATA[message.opcode], message.values, strict=True)
        return {"slot": message.slot, **{field.name: value for field, value in data}}
    flags = [flag.name.lower() for flag in FLAG_MEANINGS if flag & message.flags and flag.name]
    return {"slot": message.slot, "flags": flags, **{name: getattr(message, name) for name in _NUMBERS}}


def json_event(event: str, **values: Any) -> str:
    """An event. What is no UTF-8 in a text (a file's name need not be) is written out."""
    for name, value in values.items():
        if isinstance(value, str):
            values[name] = value.encode("utf-8", "backslashreplace").decode()
    return msgspec.json.encode({"event": event, **values}).decode()


class Totals:
    """Counts rows for the last line."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.reasons: Counter[str] = Counter()

    def add(self, row: DecodedRow) -> None:
        event = row.event
        if isinstance(event, Damaged):
            self.counts["damaged"] += 1
            self.counts["damaged_bytes"] += len(event.data)
            self.reasons[reason(event)] += 1
        elif row.fresh is None:
            self.counts["telemetry"] += 1
        else:
            self.counts["accepted" if row.fresh else "stale"] += 1

    def as_dict(self) -> dict[str, Any]:
        names = ("accepted", "stale", "telemetry", "damaged", "damaged_bytes")
        return {**{name: self.counts[name] for name in names}, "reasons": dict(sorted(self.reasons.items()))}

    def __str__(self) -> str:
        counts = self.counts
        why = ", ".join(f"{count} {name}" for name, count in sorted(self.reasons.items()))
        damage = f"{amount(counts['damaged'], 'damaged run')} of {amount(counts['damaged_bytes'], 'byte')}"
        frames = f"{counts['accepted']} accepted, {counts['stale']} stale, {counts['telemetry']} telemetry"
        return f"frames: {frames}; {damage}" + (f" ({why})" if why else "")


PIECE_BYTES = 1 << 16


class ConversionError(BadInput):
    """Transmissions that the other format cannot express: tick, reason, remedy."""

    def __init__(self, tick: int, problem: str, remedy: str) -> None:
        super().__init__("", f"tick {tick}", problem, remedy)


def to_pcapng(sent: Iterable[Transmission]) -> Iterator[bytes]:
    """One packet per transmission, one interface per network.

    A transmission longer than a packet continues in the next.
    """
    return pcapng.blocks(_packets(sent))


def _packets(sent: Iterable[Transmission]) -> Iterator[Transmission]:
    for transmission in sent:
        for place in range(0, len(transmission.data), pcapng.MAX_DATA):
            tick = transmission.tick + place * character_ticks(transmission.direction)
            if tick > pcapng.MAX_TICK or transmission.network > pcapng.MAX_NETWORK:
                limits = f"a capture holds ticks to {pcapng.MAX_TICK} and networks to {pcapng.MAX_NETWORK}"
                raise ConversionError(tick, f"of network {transmission.network} does not fit", limits)
            data = transmission.data[place : place + pcapng.MAX_DATA]
            yield Transmission(tick, transmission.direction, data, transmission.network)


def to_stream(
    sent: Iterable[Transmission],
    layout: Callable[[int], int],
    source: Source | None = None,
    actions: Iterable[ScriptItem] = (),
) -> Iterator[bytes]:
    """One line per transmission, with its content as comment. Raises ConversionError for ticks that go backwards.

    `actions`, sorted by tick, get a line each among them. The notes of `source` follow the first line. The first line
    contains the format version, which is known only after the last transmission: until then lines wait in a temporary
    file.
    """
    version, last = 1, 0
    with tempfile.TemporaryFile() as lines:
        for item in merge(sent, actions, key=lambda item: item.tick):
            if item.tick < last:
                problem = f"comes after tick {last}"
                raise ConversionError(item.tick, problem, "sort the capture first (`reordercap` does)")
            last = item.tick
            version = max(version, version_of(item))
            sent_rows = rows([item], layout) if isinstance(item, Transmission) else ()
            comment = "; ".join(described(row) for row in sent_rows)
            lines.write(f"{stream.format_line(item, comment)}\n".encode())
        yield f"{FIRST_LINE.format(version)}\n".encode()
        for note in source.notes if source else ():
            yield f"# {note}\n".encode()
        lines.seek(0)
        while piece := lines.read(PIECE_BYTES):
            yield piece
