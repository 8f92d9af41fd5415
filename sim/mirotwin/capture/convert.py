"""Runs of characters as a capture or a stream file.

What belongs here: runs to blocks and lines, one at a time. What does not: the grammar of either (`miro_protocol`), and
files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from miro_protocol import pcapng, stream
from miro_protocol.pcapng import Packet
from miro_protocol.stream import Transmission
from mirotwin.capture import Run
from mirotwin.capture.render import described
from mirotwin.capture.rows import rows
from mirotwin.capture.source import character_ticks


class ConversionError(ValueError):
    """Runs that the other format cannot hold: tick, what, remedy."""

    def __init__(self, tick: int, what: str, remedy: str) -> None:
        super().__init__(f"tick {tick}: {what}; {remedy}")


def to_pcapng(runs: Iterable[Run]) -> Iterator[bytes]:
    """A packet a run, an interface a network. A run longer than a packet may be goes on in the next."""
    return pcapng.blocks(_packets(runs))


def _packets(runs: Iterable[Run]) -> Iterator[Packet]:
    for run in runs:
        for place in range(0, len(run.data), pcapng.MAX_DATA):
            tick = run.tick + place * character_ticks(run.direction)
            if tick > pcapng.MAX_TICK or run.network > pcapng.MAX_NETWORK:
                limits = f"a capture holds ticks to {pcapng.MAX_TICK} and networks to {pcapng.MAX_NETWORK}"
                raise ConversionError(tick, f"of network {run.network} does not fit", limits)
            yield Packet(tick, run.direction, run.data[place : place + pcapng.MAX_DATA], run.network)


def to_stream(runs: Iterable[Run], layout: Callable[[int], int]) -> Iterator[bytes]:
    """A line a run, with what the run says as comment.

    ConversionError for a second network and for ticks that go backwards: neither can be told in a stream file.
    """
    yield f"{stream.FIRST_LINE}\n".encode()
    before: Run | None = None
    for run in runs:
        if before is not None and run.network != before.network:
            what = f"characters of network {run.network} after those of network {before.network}"
            raise ConversionError(run.tick, what, "a stream file has one; choose it with --network")
        if before is not None and run.tick < before.tick:
            what = f"comes after tick {before.tick}"
            raise ConversionError(run.tick, what, "sort the capture first (`reordercap` does)")
        comment = "; ".join(described(row) for row in rows([run], layout))
        line = stream.format_line(Transmission(run.tick, run.direction, run.data, comment))
        yield f"{line}\n".encode()
        before = run
