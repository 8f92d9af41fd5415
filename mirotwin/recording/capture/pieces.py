"""The output of capture readers: characters, and facts about the file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeVar

from miro_exact.bad_input import BadInput, amount
from miro_exact.inputs import InputError
from miro_protocol.transmission import DOWN, UP

Item = TypeVar("Item")


class Piece(NamedTuple):
    """Consecutive characters. `tick` (24 MHz): None if they follow the piece before; `direction`: "" if unknown.

    `line`: number of the wire.
    """

    tick: int | None
    direction: str
    data: bytes
    line: int = 0
    bad_stop: bool = False


class Facts:
    """Facts about a capture, from its user or its reader.

    `resolution_ticks`: step of the file's times. `spacing_ticks`: from one start bit to the next as it was sent, 0 if
    not known. `baud`, `channels`: requested by the user. `offset_s`: subtracted from all times.
    """

    def __init__(
        self, label: str, tell: Callable[[str], None], baud: int | None = None, channels: tuple[str, ...] = ()
    ) -> None:
        self.label = label
        self.tell = tell
        self.baud = baud
        self.channels = channels
        self.resolution_ticks = 1
        self.spacing_ticks = 0
        self.offset_s = 0
        self._foreign: Counter[str] = Counter()
        self._first = ""

    def pass_over(self, kind: str, place: str) -> None:
        """Counts something without characters, such as a `line` at `line 3`."""
        self._foreign[kind] += 1
        self._first = self._first or place

    def tell_passed_over(self, read_any: bool) -> None:
        """Reports skipped input. Raises InputError if nothing else was read (`read_any` false)."""
        if not self._foreign:
            return
        kinds = ", ".join(amount(count, kind) for kind, count in sorted(self._foreign.items()))
        if not read_any:
            raise InputError(self.label, f"no characters in {kinds}", "name another form with --from-form")
        self.tell(f"{self.label}: passed over {kinds} without characters, the first at {self._first}")


_DIRECTION = re.compile(
    r"(?P<up><+-*|←|收|(?<![A-Za-z])(?:rxd?|in|input|recv|receiv(?:ed?|ing)|read|incoming|rcvd)(?![A-Za-z]))"
    r"|(?P<down>(?<!-)>+|发|(?<![A-Za-z])(?:txd?|out|output|send(?:ing)?|sent|write|written|outgoing|xmit)(?![A-Za-z]))",
    re.IGNORECASE,
)


def direction_in(words: str) -> str:
    """The direction named by words such as `ttyUSB0 TX`, `<` or `[RX] -`, from the PC's view; "" for none.

    `->` names none: terminals write it between the time and the received text.
    """
    match = _DIRECTION.search(words)
    return "" if match is None else UP if match["up"] else DOWN


def peeked(
    items: Iterator[Item], most: int, while_: Callable[[Item], bool] = lambda item: True
) -> tuple[list[Item], Iterator[Item]]:
    """The first items, and an iterator over all; an error comes in its place."""
    head: list[Item] = []
    failure: BadInput | None = None
    try:
        for item in items:
            head.append(item)
            if len(head) == most or not while_(item):
                break
    except BadInput as error:
        failure = error

    def everything() -> Iterator[Item]:
        yield from head
        if failure is not None:
            raise failure
        yield from items

    return head, everything()
