"""Transmissions as a capture or a stream file."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator

from miro_exact.bad_input import BadInput
from miro_protocol import pcapng, stream
from miro_protocol.stream_line import FIRST_LINE, needs_version_2
from miro_protocol.transmission import Transmission, character_ticks
from mirotwin.recording.capture.render import described
from mirotwin.recording.capture.rows import rows

PIECE_BYTES = 1 << 16


class ConversionError(BadInput):
    """Transmissions that the other format cannot hold: tick, what, remedy."""

    def __init__(self, tick: int, what: str, remedy: str) -> None:
        super().__init__("", f"tick {tick}", what, remedy)


def to_pcapng(sent: Iterable[Transmission]) -> Iterator[bytes]:
    """A packet a transmission, an interface a network. One that is longer than a packet may be goes on in the next."""
    return pcapng.blocks(_packets(sent))


def _packets(sent: Iterable[Transmission]) -> Iterator[Transmission]:
    for one in sent:
        for place in range(0, len(one.data), pcapng.MAX_DATA):
            tick = one.tick + place * character_ticks(one.direction)
            if tick > pcapng.MAX_TICK or one.network > pcapng.MAX_NETWORK:
                limits = f"a capture holds ticks to {pcapng.MAX_TICK} and networks to {pcapng.MAX_NETWORK}"
                raise ConversionError(tick, f"of network {one.network} does not fit", limits)
            yield Transmission(tick, one.direction, one.data[place : place + pcapng.MAX_DATA], one.network)


def to_stream(sent: Iterable[Transmission], layout: Callable[[int], int]) -> Iterator[bytes]:
    """A line a transmission, with what it says as comment. ConversionError for ticks that go backwards.

    The first line names the version, which is known after the last transmission: until then lines are kept in a
    temporary file.
    """
    version, last = 1, 0
    with tempfile.TemporaryFile() as kept:
        for one in sent:
            if one.tick < last:
                what = f"comes after tick {last}"
                raise ConversionError(one.tick, what, "sort the capture first (`reordercap` does)")
            last = one.tick
            version = max(version, 1 + needs_version_2(one))
            comment = "; ".join(described(row) for row in rows([one], layout))
            kept.write(f"{stream.format_line(one, comment)}\n".encode())
        yield f"{FIRST_LINE.format(version)}\n".encode()
        kept.seek(0)
        while piece := kept.read(PIECE_BYTES):
            yield piece
