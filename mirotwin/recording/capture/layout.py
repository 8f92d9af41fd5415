"""How many robots a network has, if the file does not say: the number with which more frames can be decoded."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import msgspec

from miro_exact.bad_input import amount
from miro_exact.inputs import InputError
from miro_protocol.table import ROBOT_COUNTS
from miro_protocol.transmission import DOWN, UP, Transmission
from mirotwin.recording.capture.source import READ_ERRORS, Source

HEAD_CHARACTERS = 1 << 16
MOST_NETWORKS = 64
SHOWN_NETWORKS = 8


def head_of(sent: Iterator[Transmission]) -> tuple[list[Transmission], Iterator[Transmission]]:
    """The first transmissions, and an iterator over all; an error comes in its place."""
    head: list[Transmission] = []
    size = 0
    failure: Exception | None = None
    try:
        while size < HEAD_CHARACTERS and (transmission := next(sent, None)) is not None:
            head.append(transmission)
            size += len(transmission.data)
    except READ_ERRORS as error:
        failure = error

    def everything() -> Iterator[Transmission]:
        yield from head
        if failure is not None:
            raise failure
        yield from sent

    return head, everything()


def frame_counts(sent: Iterable[Transmission]) -> dict[int, int]:
    """Valid frames from a host in each layout, 3 and 5."""
    from miro_protocol.decoder import Decoder  # a hot module: not before the engine was chosen

    decoders = {count: Decoder(count) for count in ROBOT_COUNTS}
    for transmission in sent:
        for decoder in decoders.values():
            decoder.hear(transmission)
    return {count: decoder.valid for count, decoder in decoders.items()}


def robots_in(head: Sequence[Transmission], network: int) -> tuple[int, str]:
    """(3 or 5, a note for the user or nothing) for a network whose first transmissions are in `head`."""
    sent = [one for one in head if one.network == network and one.direction == DOWN]
    counts = frame_counts(sent)
    best = max(ROBOT_COUNTS, key=lambda count: (counts[count], -count))
    others = [count for count in ROBOT_COUNTS if count != best and counts[count]]
    if sent and not counts[best]:
        note = f"no frame of 3 or 5 robots at the beginning; {best} robots assumed"
    elif others:
        counted = " and ".join(
            f"{amount(counts[count], 'frame')} of {count} robots" for count in ROBOT_COUNTS
        )
        note = f"{counted} at the beginning; {best} robots assumed"
    else:
        return best, ""
    return best, f"network {network}: {note} (--robots says otherwise)"


def is_telemetry(head: Sequence[Transmission]) -> bool:
    """Whether raw bytes read as robots' answers rather than as a host's frames."""
    from miro_protocol.decoder import TelemetryDecoder

    decoder = TelemetryDecoder()
    for transmission in head:
        decoder.hear(transmission)
    return decoder.valid > max(frame_counts(head).values())


class Layouts:
    """3 or 5 for each network: as the user `requested`, else as the file says, else as its `head` looks.

    `tell` receives a note for the user about a choice that was not plain.
    """

    def __init__(
        self, requested: int | None, source: Source, head: Sequence[Transmission], tell: Callable[[str], None]
    ) -> None:
        self.requested = requested
        self.source = source
        self.head = head
        self.tell = tell
        self.found: dict[int, int] = {}

    def of(self, network: int) -> int:
        """InputError for more networks than there may be decoders."""
        if network not in self.found:
            if len(self.found) == MOST_NETWORKS:
                reason = f"characters of more than {MOST_NETWORKS} networks"
                raise InputError(self.source.label, reason, "take one out with `mirotwin export --network`")
            count = self.requested or self.source.robots.get(network)
            if count is None:
                count, note = robots_in(self.head, network)
                if note:
                    self.tell(note)
            self.found[network] = count
        return self.found[network]

    def __str__(self) -> str:
        """`, network 0 of 3 robots` of all networks in the head, if they are few."""
        networks = sorted({one.network for one in self.head})
        if len(networks) > SHOWN_NETWORKS:
            return f", {len(networks)} networks"
        return "".join(f", network {network} of {self.of(network)} robots" for network in networks)


def look(
    source: Source, requested: int | None, tell: Callable[[str], None], guess_direction: bool = False
) -> Layouts:
    """Looks at the beginning of `source` for what it does not say: layout, and the direction of raw bytes."""
    head: list[Transmission] = []
    guess_direction = guess_direction and not source.timed
    if requested is None or guess_direction:
        head, source.sent = head_of(source.sent)
    if guess_direction and is_telemetry(head):
        head = [msgspec.structs.replace(one, direction=UP) for one in head]
        source.sent = (msgspec.structs.replace(one, direction=UP) for one in source.sent)
    return Layouts(requested, source, head, tell)
