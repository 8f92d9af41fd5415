"""The bytes on the wire as people read them: one line a frame, or a run of bytes that is not one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import msgspec

from miro_protocol.events import Damaged
from miro_protocol.frames import TeamFrame, TelemetryFrame, describe
from miro_protocol.transmission import Transmission
from mirotwin.recording.capture.rows import DecodedRow, rows


class FrameLine(msgspec.Struct, frozen=True):
    """A frame or a damaged run: first start bit, direction, network, sender's slot, what it says.

    `slot` is -1 for the host's, and for what a robot sent that cannot be told from its bytes.
    """

    tick: int
    direction: str
    network: int
    slot: int
    text: str


def frame_lines(sent: Iterable[Transmission], robots: Mapping[int, int]) -> Iterator[FrameLine]:
    """The lines of everything in `sent`; `robots` is the layout (3 or 5) of each network.

    What the host sent is listed as sent, before the radio.
    """
    for row in rows(sent, robots.__getitem__):
        slot = row.message.slot if isinstance(row.message, TelemetryFrame) else -1
        yield FrameLine(row.event.start_tick, row.direction, row.network, slot, _text(row))


def _text(row: DecodedRow) -> str:
    event, message = row.event, row.message
    if isinstance(event, Damaged):
        reason = event.reason.name.lower().replace("_", " ")
        text = f"{len(event.data)} bytes, {reason}: {event.data[:16].hex(' ')}"
        return text + " .." if len(event.data) > 16 else text
    if message is None:
        return f"frame with unknown content: {row.unknown}"
    text = describe(message)
    if isinstance(message, TeamFrame):
        text += "  " + " ".join(f"{left:+d}/{right:+d}" for left, right in message.velocities)
    return text
