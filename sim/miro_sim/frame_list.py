"""The bytes on the wire as people read them: one line a frame, or a run of bytes that is none.

What belongs here: runs of bytes to lines. What does not: decoding (`miro_protocol`), and printing (`cli`).
"""

from collections.abc import Iterable, Iterator, Mapping

import msgspec
from miro_protocol.decoder import Damaged, Decoder, Event, TelemetryDecoder, WindowDecoder
from miro_protocol.frames import ContentError, TeamFrame, TelemetryFrame, describe
from miro_protocol.stream import DOWN

from miro_sim.records import WireRun


class FrameLine(msgspec.Struct, frozen=True):
    """A frame or a damaged run: first start bit, direction, network, sender's slot, what it says.

    `slot` is -1 for the host's, and for what a robot sent that cannot be told from its bytes.
    """

    tick: int
    direction: str
    network: int
    slot: int
    text: str


def frame_lines(runs: Iterable[WireRun], robots: Mapping[int, int]) -> Iterator[FrameLine]:
    """Decodes runs of bytes; `robots` is the layout (3 or 5) of each network.

    One decoder a network and direction; a run of the host's bytes is as sent, before the radio.
    """
    decoders: dict[tuple[int, str], WindowDecoder] = {}
    pending: dict[tuple[int, str], WireRun] = {}
    for run in runs:
        place = (run.network, run.direction)
        layout = robots[run.network]
        if place not in decoders:
            decoders[place] = Decoder(layout) if run.direction == DOWN else TelemetryDecoder()
        events = decoders[place].feed(run.data, run.tick)
        yield from _lines(events, run, layout)
        pending[place] = run
    for place, run in pending.items():
        yield from _lines(decoders[place].flush(), run, robots[run.network])


def _lines(events: Iterable[Event], run: WireRun, layout: int) -> Iterator[FrameLine]:
    for event in events:
        slot = run.slot
        if isinstance(event, Damaged):
            reason = event.reason.name.lower().replace("_", " ")
            text = f"{len(event.data)} bytes, {reason}: {event.data[:16].hex(' ')}"
            text += " .." if len(event.data) > 16 else ""
        else:
            try:
                message = event.message(layout)
                text = describe(message)
                if isinstance(message, TelemetryFrame):
                    slot = message.slot
            except ContentError as error:
                text = f"frame that says nothing known: {error}"
            else:
                if isinstance(message, TeamFrame):
                    text += "  " + " ".join(f"{left:+d}/{right:+d}" for left, right in message.velocities)
        yield FrameLine(event.start_tick, run.direction, run.network, slot, text)
