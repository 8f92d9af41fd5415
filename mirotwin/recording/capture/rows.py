"""Transmissions decoded: frames with their contents and whether they are fresh, and damage with its reason."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import msgspec

from miro_protocol.events import Event, Received
from miro_protocol.frames import ContentError, Message
from miro_protocol.transmission import DOWN, Transmission, character_ticks
from mirotwin.recording.capture.source import READ_ERRORS

if TYPE_CHECKING:
    from miro_protocol.decoder import Scanner


class DecodedRow(msgspec.Struct, frozen=True):
    """One frame or damaged run.

    `offset` counts the characters of this network and direction before it. `fresh` is None for damage and for
    telemetry, `message` for damage and for unknown content (`unknown` is the reason then).
    """

    offset: int
    direction: str
    network: int
    event: Event
    message: Message | None = None
    fresh: bool | None = None
    unknown: str = ""


class _Decoding:
    """Decodes one direction of one network."""

    def __init__(self, direction: str, network: int, layout: int) -> None:
        from miro_protocol.decoder import TelemetryDecoder
        from miro_protocol.robot_receiver import RobotReceiver

        self.direction = direction
        self.network = network
        self.layout = layout
        self.step = character_ticks(direction)
        self.robot = RobotReceiver(layout) if direction == DOWN else None
        self.decoder: Scanner = TelemetryDecoder() if self.robot is None else self.robot.decoder
        self.offset = 0
        self.end_tick = 0

    def hear(self, sent: Transmission | None) -> Iterator[DecodedRow]:
        """Rows completed by these characters. None ends the input: the pending characters are then no frame."""
        self.end_tick = self.end_tick if sent is None else sent.end_tick
        source = self.robot or self.decoder
        for reception in source.flush() if sent is None else source.hear(sent):
            event, fresh = reception if isinstance(reception, tuple) else (reception, None)
            yield self.row(event, fresh)
            self.offset += len(event.data)

    def row(self, event: Event, fresh: bool | None) -> DecodedRow:
        if not isinstance(event, Received):
            return DecodedRow(self.offset, self.direction, self.network, event)
        message, unknown = None, ""
        try:
            message = event.message(self.layout)
        except ContentError as error:
            unknown = str(error)
        return DecodedRow(self.offset, self.direction, self.network, event, message, fresh, unknown)


def rows(sent: Iterable[Transmission], layout: Callable[[int], int]) -> Iterator[DecodedRow]:
    """Rows in the order of their last characters. An error raised by `sent` comes after all rows before it. After a
    pause of two characters or more, earlier characters cannot become a frame, so they are yielded as damage.
    """
    decodings: dict[tuple[int, str], _Decoding] = {}
    failure: Exception | None = None
    try:
        for transmission in sent:
            key = (transmission.network, transmission.direction)
            if key not in decodings:
                decodings[key] = _Decoding(
                    transmission.direction, transmission.network, layout(transmission.network)
                )
            for other in decodings.values():
                if other.decoder.pending and transmission.tick >= other.end_tick + 2 * other.step:
                    yield from other.hear(None)
            yield from decodings[key].hear(transmission)
    except READ_ERRORS as error:  # what is pending comes first
        failure = error
    for decoding in decodings.values():
        yield from decoding.hear(None)
    if failure is not None:
        raise failure
