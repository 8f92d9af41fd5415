"""The bytes on the wire as people read them: one line a frame, or a run of bytes that is none.

What belongs here: runs of bytes to events and lines. What does not: decoding (`miro_protocol`), and printing
(`cli`). The decoder has a hot module, so it is imported where it is used: the engine is chosen before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

import msgspec
from miro_protocol.events import Damaged, Event, Received
from miro_protocol.frames import ContentError, TeamFrame, TelemetryFrame, describe
from miro_protocol.stream import DOWN

from miro_sim.records import WireRun

if TYPE_CHECKING:
    from miro_protocol.decoder import WindowDecoder


class FrameLine(msgspec.Struct, frozen=True):
    """A frame or a damaged run: first start bit, direction, network, sender's slot, what it says.

    `slot` is -1 for the host's, and for what a robot sent that cannot be told from its bytes.
    """

    tick: int
    direction: str
    network: int
    slot: int
    text: str


def decoded(runs: Iterable[WireRun], robots: Mapping[int, int]) -> Iterator[tuple[WireRun, Event]]:
    """Decodes runs of bytes; `robots` is the layout (3 or 5) of each network.

    One decoder a network and direction; a run of the host's bytes is as sent, before the radio. An event
    comes with the run in which it ended.
    """
    from miro_protocol.decoder import Decoder, TelemetryDecoder

    decoders: dict[tuple[int, str], WindowDecoder] = {}
    pending: dict[tuple[int, str], WireRun] = {}
    for run in runs:
        place = (run.network, run.direction)
        if place not in decoders:
            decoders[place] = Decoder(robots[run.network]) if run.direction == DOWN else TelemetryDecoder()
        for event in decoders[place].feed(run.data, run.tick):
            yield run, event
        pending[place] = run
    for place, run in pending.items():
        for event in decoders[place].flush():
            yield run, event


def frame_lines(runs: Iterable[WireRun], robots: Mapping[int, int]) -> Iterator[FrameLine]:
    """The lines of everything in `runs`, see `decoded`."""
    for run, event in decoded(runs, robots):
        yield frame_line(run, event, robots[run.network])


def frame_line(run: WireRun, event: Event, layout: int) -> FrameLine:
    """The line of one event of `run`."""
    slot = run.slot
    if isinstance(event, Damaged):
        text = _damage(event)
    else:
        text, slot = _content(event, slot, layout)
    return FrameLine(event.start_tick, run.direction, run.network, slot, text)


def _damage(event: Damaged) -> str:
    reason = event.reason.name.lower().replace("_", " ")
    text = f"{len(event.data)} bytes, {reason}: {event.data[:16].hex(' ')}"
    return text + " .." if len(event.data) > 16 else text


def _content(event: Received, slot: int, layout: int) -> tuple[str, int]:
    """What a frame says, and whose it is."""
    try:
        message = event.message(layout)
    except ContentError as error:
        return f"frame that says nothing known: {error}", slot
    text = describe(message)
    if isinstance(message, TelemetryFrame):
        slot = message.slot
    if isinstance(message, TeamFrame):
        text += "  " + " ".join(f"{left:+d}/{right:+d}" for left, right in message.velocities)
    return text, slot
