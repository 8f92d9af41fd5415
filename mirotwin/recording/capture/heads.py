"""The first transmissions of a source, and the direction and layout guessed from them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from miro_protocol.table import ROBOT_COUNTS
from miro_protocol.transmission import Transmission
from mirotwin.recording.capture.pieces import peeked

HEAD_CHARACTERS = 1 << 16


def head_of(sent: Iterator[Transmission]) -> tuple[list[Transmission], Iterator[Transmission]]:
    """The first transmissions, and an iterator over all; an error comes in its place."""
    size = 0

    def is_short(transmission: Transmission) -> bool:
        nonlocal size
        size += len(transmission.data)
        return size < HEAD_CHARACTERS

    return peeked(sent, HEAD_CHARACTERS, is_short)


def frame_counts(sent: Iterable[Transmission]) -> dict[int, int]:
    """Valid frames from a host in each layout, 3 and 5."""
    from miro_protocol.decoder import Decoder  # a hot module: not before the engine was chosen

    decoders = {count: Decoder(count) for count in ROBOT_COUNTS}
    for transmission in sent:
        for decoder in decoders.values():
            decoder.hear(transmission)
    return {count: decoder.valid for count, decoder in decoders.items()}


def telemetry_count(sent: Iterable[Transmission]) -> int:
    """Valid frames from robots."""
    from miro_protocol.decoder import TelemetryDecoder

    decoder = TelemetryDecoder()
    for transmission in sent:
        decoder.hear(transmission)
    return decoder.valid


def is_telemetry(head: Sequence[Transmission]) -> bool:
    """True if characters read as robots' answers rather than as a host's frames."""
    return telemetry_count(head) > max(frame_counts(head).values())
