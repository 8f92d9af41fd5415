"""The characters in a recording (`run.mcap`), in the order of time.

A recording contains the characters of each control period. A robot's transmission that crosses the end of a period is
joined again here.
"""

from __future__ import annotations

import heapq
import re
from collections.abc import Callable, Iterable, Iterator, Sequence

import msgspec

from miro_exact.clock import TICKS_PER_SECOND
from miro_protocol.transmission import UP, Transmission, joined
from miro_sim.periods import Period
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import parse
from mirotwin.recording import channels
from mirotwin.recording.capture.input import Input
from mirotwin.recording.container import BrokenOff, RecordingError
from mirotwin.recording.messages import Messages
from mirotwin.recording.recorder import SCENARIO_ATTACHMENT


def transmissions(
    source: Input, robots: dict[int, int], tell: Callable[[str], None] = lambda text: None
) -> Iterator[Transmission]:
    """Transmissions in the order of time; `robots` is filled with the layout (3 or 5) of each network before the first.

    Raises RecordingError, after everything readable, for a file that is no recording of this program, and for an
    incomplete copy. For a recording of an interrupted run `tell` gets a message, after all its transmissions.
    """
    messages = Messages(source.read, source.label, (channels.WireMessage, channels.PeriodMessage))
    order = _Order()
    failure: RecordingError | None = None
    crystal_hz = 0
    try:
        for sent in _ordered(messages, order, robots):
            if not crystal_hz:
                crystal_hz = _crystal_hz(messages, tell)
            yield in_usual_ticks(sent, crystal_hz)
    except RecordingError as error:
        failure = error
    _take_layouts(messages, robots)
    crystal_hz = crystal_hz or _crystal_hz(messages, tell)
    for sent in order.rest():
        yield in_usual_ticks(sent, crystal_hz)
    if failure is not None and (not isinstance(failure, BrokenOff) or messages.metadata is None):
        raise failure
    messages.check_ours()
    if broken_off := messages.broken_off if failure is None else str(failure):
        tell(broken_off)


def transmissions_of(periods: Iterable[Period]) -> list[Transmission]:
    """The transmissions in `periods`, all from the first on, in the order of time."""
    order = _Order()
    closed = [sent for period in periods for sent in order.close(period.tick, period.wire)]
    return [*closed, *order.rest()]


def in_usual_ticks(sent: Transmission, crystal_hz: int) -> Transmission:
    """The transmission at ticks of 24 MHz, of one at ticks of another crystal."""
    if crystal_hz == TICKS_PER_SECOND:
        return sent
    return msgspec.structs.replace(sent, tick=sent.tick * TICKS_PER_SECOND // crystal_hz)


def units_line(label: str, crystal_hz: int) -> str:
    """The line about a file that counts ticks of another crystal."""
    return f"{label}: ticks of its {crystal_hz} Hz crystal are given in those of {TICKS_PER_SECOND} Hz"


def _crystal_hz(messages: Messages, tell: Callable[[str], None]) -> int:
    """Ticks per second of a recording; reports the deviations of a board's recording through `tell`."""
    metadata = messages.metadata or {}
    if "board" in metadata:
        tell(f"{messages.path}: is of a board, whose bytes are no frames of robots; what was put is left out")
    text = metadata.get("crystal_hz", "")
    if not re.fullmatch(r"[1-9][0-9]{0,9}", text):
        return TICKS_PER_SECOND
    tell(units_line(messages.path, int(text)))
    return int(text)


def _ordered(messages: Messages, order: _Order, robots: dict[int, int]) -> Iterator[Transmission]:
    period: list[Transmission] = []
    for place, message in messages:
        if isinstance(message, channels.PeriodMessage):
            _take_layouts(messages, robots)
            yield from order.close(message.tick, period)
            period = []
            continue
        try:
            sent = channels.transmission(place.network, message)
        except ValueError as error:
            raise messages.unfit(error) from None
        period.append(sent)
        order.last = period


def _take_layouts(messages: Messages, robots: dict[int, int]) -> None:
    """Fills in the number of robots in each network; nothing for a scenario that this version cannot read."""
    text = messages.attachments.pop(SCENARIO_ATTACHMENT, None)
    if text is not None:
        try:
            scenario = parse(text.decode("utf-8"), "")
        except (ScenarioError, UnicodeDecodeError):
            return
        robots.update({index: network.robots for index, network in enumerate(scenario.networks)})


class _Order:
    """Sorts transmissions by time, and joins those that cross the end of a period.

    `last`: transmissions of the period that has no end yet.
    """

    def __init__(self) -> None:
        self.open: dict[int, Transmission] = {}  # network -> what its robots sent last, which may go on
        self.last: Sequence[Transmission] = ()
        self._heap: list[tuple[int, int, str, int, Transmission]] = []
        self._count = 0

    def close(self, tick: int, period: Sequence[Transmission]) -> list[Transmission]:
        """The transmissions that are final when the period that began at `tick` is complete."""
        self.last = ()
        self._take(period)
        return self._before(min([tick, *(sent.tick for sent in self.open.values())]))

    def rest(self) -> list[Transmission]:
        """The remaining transmissions, at the end of the input."""
        self._take(self.last)
        for sent in self.open.values():
            self._push(sent)
        self.open = {}
        return self._before(None)

    def _take(self, period: Sequence[Transmission]) -> None:
        carried, self.open = self.open, {}
        for sent in period:
            if sent.direction != UP:
                self._push(sent)
                continue
            before = carried.pop(sent.network, None)
            if before is not None:
                both = joined(before, sent)
                if both is None:
                    self._push(before)
                else:
                    sent = both
            if sent.network in self.open:
                self._push(self.open[sent.network])
            self.open[sent.network] = sent
        for sent in carried.values():  # nothing came that could go on with it
            self._push(sent)

    def _push(self, sent: Transmission) -> None:
        heapq.heappush(self._heap, (sent.tick, sent.network, sent.direction, self._count, sent))
        self._count += 1

    def _before(self, tick: int | None) -> list[Transmission]:
        earlier = []
        while self._heap and (tick is None or self._heap[0][0] < tick):
            earlier.append(heapq.heappop(self._heap)[-1])
        return earlier
