"""Transmissions decoded: frames with their contents and whether they are fresh, and damage with its reason."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import msgspec

from miro_protocol.events import Event, Received
from miro_protocol.frames import ContentError, Message
from miro_protocol.freshness import Freshness
from miro_protocol.transmission import DOWN, Transmission, character_ticks
from mirotwin.recording.capture.source import READ_ERRORS

if TYPE_CHECKING:
    from miro_protocol.decoder import WindowDecoder


class Row(msgspec.Struct, frozen=True):
    """One frame or damaged run.

    `offset` counts the characters of this network and direction before it. `fresh` is None for damage and for
    telemetry, `message` for damage and for unknown content (then `unknown` says why).
    """

    offset: int
    direction: str
    network: int
    event: Event
    message: Message | None = None
    fresh: bool | None = None
    unknown: str = ""


class _Ear:
    """Hears one direction of one network."""

    def __init__(self, direction: str, network: int, layout: int) -> None:
        from miro_protocol.decoder import Decoder, TelemetryDecoder

        self.direction = direction
        self.network = network
        self.layout = layout
        self.step = character_ticks(direction)
        self.decoder: WindowDecoder = Decoder(layout) if direction == DOWN else TelemetryDecoder()
        self.freshness = Freshness()
        self.offset = 0
        self.end_tick = 0

    def hear(self, sent: Transmission) -> Iterator[Row]:
        self.end_tick = sent.end_tick
        return self.rows(self.decoder.hear(sent))

    def flush(self) -> Iterator[Row]:
        return self.rows(self.decoder.flush())

    def rows(self, events: Iterable[Event]) -> Iterator[Row]:
        for event in events:
            yield self.row(event)
            self.offset += len(event.data)

    def row(self, event: Event) -> Row:
        if not isinstance(event, Received):
            return Row(self.offset, self.direction, self.network, event)
        message, unknown = None, ""
        try:
            message = event.message(self.layout)
        except ContentError as error:
            unknown = str(error)
        fresh = self.freshness.judge(event.seq, event.last_tick) if self.direction == DOWN else None
        return Row(self.offset, self.direction, self.network, event, message, fresh, unknown)


def rows(sent: Iterable[Transmission], layout: Callable[[int], int]) -> Iterator[Row]:
    """Rows in the order in which their last characters came. An error of `sent` comes after all before it.

    After a pause of two characters or more what came before it cannot become a frame any more: it is given out.
    """
    ears: dict[tuple[int, str], _Ear] = {}
    failure: Exception | None = None
    try:
        for one in sent:
            key = (one.network, one.direction)
            if key not in ears:
                ears[key] = _Ear(one.direction, one.network, layout(one.network))
            for ear in ears.values():
                if ear.decoder.pending and one.tick >= ear.end_tick + 2 * ear.step:
                    yield from ear.flush()
            yield from ears[key].hear(one)
    except READ_ERRORS as error:  # what is pending comes first
        failure = error
    for ear in ears.values():
        yield from ear.flush()
    if failure is not None:
        raise failure
