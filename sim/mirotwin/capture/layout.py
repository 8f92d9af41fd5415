"""How many robots a network has, where the file does not say: whatever makes more frames readable.

What belongs here: looking at the first runs of a file. What does not: decoding for the user (`rows`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import msgspec

from miro_protocol.stream import DOWN, UP
from miro_protocol.table import ROBOT_COUNTS
from miro_sim.inputs import InputError
from mirotwin.capture import Run
from mirotwin.capture.source import READ_ERRORS, Source

HEAD_CHARACTERS = 1 << 16
MOST_NETWORKS = 64
SHOWN_NETWORKS = 8


def head_of(runs: Iterator[Run]) -> tuple[list[Run], Iterator[Run]]:
    """The first runs (`HEAD_CHARACTERS` of them or all), and an iterator over all; an error comes in its place."""
    head: list[Run] = []
    size = 0
    failure: Exception | None = None
    try:
        while size < HEAD_CHARACTERS and (run := next(runs, None)) is not None:
            head.append(run)
            size += len(run.data)
    except READ_ERRORS as error:
        failure = error

    def everything() -> Iterator[Run]:
        yield from head
        if failure is not None:
            raise failure
        yield from runs

    return head, everything()


def frame_counts(runs: Iterable[Run]) -> dict[int, int]:
    """Valid frames from a host in each layout, 3 and 5."""
    from miro_protocol.decoder import Decoder  # a hot module: not before the engine was chosen

    decoders = {count: Decoder(count) for count in ROBOT_COUNTS}
    for run in runs:
        for decoder in decoders.values():
            decoder.feed(run.data, run.tick)
    return {count: decoder.valid for count, decoder in decoders.items()}


def telemetry_count(runs: Iterable[Run]) -> int:
    """Valid frames from robots, whatever direction the runs are said to have."""
    from miro_protocol.decoder import TelemetryDecoder

    decoder = TelemetryDecoder()
    for run in runs:
        decoder.feed(run.data, run.tick)
    return decoder.valid


def robots_in(head: Sequence[Run], network: int) -> tuple[int, str]:
    """(3 or 5, what to tell the user or nothing) for a network whose first runs are in `head`."""
    runs = [run for run in head if run.network == network and run.direction == DOWN]
    return chosen(frame_counts(runs), bool(runs), network)


def chosen(counts: Mapping[int, int], any_data: bool, network: int) -> tuple[int, str]:
    best = max(ROBOT_COUNTS, key=lambda count: (counts[count], -count))
    others = [count for count in ROBOT_COUNTS if count != best and counts[count]]
    if any_data and not counts[best]:
        what = f"no frame of 3 or of 5 robots at its beginning; taken for {best}"
    elif others:
        found = " and ".join(f"{counts[count]} frames of {count} robots" for count in ROBOT_COUNTS)
        what = f"{found} at its beginning; taken for {best}"
    else:
        return best, ""
    return best, f"network {network}: {what} (--robots says otherwise)"


def is_telemetry(head: Sequence[Run]) -> bool:
    """Whether raw bytes read as robots' answers rather than as a host's frames."""
    return telemetry_count(head) > max(frame_counts(head).values())


class Layouts:
    """3 or 5 for each network: what the user `said`, else what the file says, else what its `head` looks like.

    `tell` gets what the user should hear about a choice that was not plain.
    """

    def __init__(
        self, said: int | None, source: Source, head: Sequence[Run], tell: Callable[[str], None]
    ) -> None:
        self.said = said
        self.source = source
        self.head = head
        self.tell = tell
        self.found: dict[int, int] = {}
        self.asked: set[int] = set()

    def of(self, network: int) -> int:
        """InputError for more networks than decoders are kept for."""
        self.asked.add(network)
        if len(self.asked) > MOST_NETWORKS:
            what = f"characters of more than {MOST_NETWORKS} networks"
            raise InputError(self.source.label, what, "take one out with `mirotwin export --network`")
        if self.said is not None:
            return self.said
        if network in self.source.robots:
            return self.source.robots[network]
        if network not in self.found:
            self.found[network], note = robots_in(self.head, network)
            if note:
                self.tell(note)
        return self.found[network]

    def __str__(self) -> str:
        """`, network 0 of 3 robots` of all networks in the head, if they are few."""
        networks = sorted({run.network for run in self.head})
        if len(networks) > SHOWN_NETWORKS:
            return f", {len(networks)} networks"
        return "".join(f", network {network} of {self.of(network)} robots" for network in networks)


def look(
    source: Source, said: int | None, tell: Callable[[str], None], guess_direction: bool = False
) -> Layouts:
    """Looks at the beginning of `source` for what it does not say: layout, and the direction of raw bytes."""
    head: list[Run] = []
    guess_direction = guess_direction and not source.timed
    if said is None or guess_direction:
        head, source.runs = head_of(source.runs)
    if guess_direction and is_telemetry(head):
        head = [msgspec.structs.replace(run, direction=UP) for run in head]
        source.runs = (msgspec.structs.replace(run, direction=UP) for run in source.runs)
    return Layouts(said, source, head, tell)
