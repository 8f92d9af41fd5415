"""The number of robots in a network, if the file does not contain it: the number with which more frames can be
decoded.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from miro_exact.bad_input import amount
from miro_exact.inputs import InputError
from miro_protocol.table import ROBOT_COUNTS
from miro_protocol.transmission import DOWN, Transmission
from mirotwin.recording.capture.heads import frame_counts, head_of
from mirotwin.recording.capture.source import Source

MOST_NETWORKS = 64
SHOWN_NETWORKS = 8


def robots_in(head: Sequence[Transmission], network: int) -> tuple[int, str]:
    """(3 or 5, a note for the user or nothing) for a network whose first transmissions are in `head`."""
    sent = [piece for piece in head if piece.network == network and piece.direction == DOWN]
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


class Layouts:
    """Network -> 3 or 5: as the user `requested`, else from the file, else guessed from its `head`.

    `tell` gets a note for the user about an uncertain guess.
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
        networks = sorted({sent.network for sent in self.head})
        if len(networks) > SHOWN_NETWORKS:
            return f", {len(networks)} networks"
        return "".join(f", network {network} of {self.of(network)} robots" for network in networks)


def look(source: Source, requested: int | None, tell: Callable[[str], None]) -> Layouts:
    """Reads the beginning of `source` to find the layout, unless it is given."""
    head: list[Transmission] = []
    if requested is None:
        head, source.sent = head_of(source.sent)
    return Layouts(requested, source, head, tell)
