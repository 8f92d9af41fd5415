"""The characters in a recording (`run.mcap`), in the order of time.

What belongs here: wire messages and periods to runs. What does not: the container (`recording.container`), all other
channels.

A recording holds the characters of each control period. A run that goes on over the end of a period is put
together again here; where one run of a period goes on right behind another, the first ended in a bad stop bit
(`network.runs`).
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NoReturn

import msgspec
from mcap.records import Attachment, Channel, Message, Metadata

from miro_protocol.stream import DIRECTIONS, MAX_TICK, UP
from miro_protocol.table import SPACING_TICKS, SPACING_TOLERANCE_TICKS, TELEMETRY
from miro_sim.periods import Period, WireRun
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import parse
from mirotwin.capture import Run
from mirotwin.capture.input import Input
from mirotwin.recording import channels
from mirotwin.recording.container import BrokenOff, RecordingError, records
from mirotwin.recording.recorder import BROKEN_OFF, FORMAT, METADATA, SCENARIO_ATTACHMENT


def runs(
    source: Input, robots: dict[int, int], tell: Callable[[str], None] = lambda text: None
) -> Iterator[Run]:
    """Runs in the order of time; `robots` is filled with the layout (3 or 5) of each network before the first.

    RecordingError, after all that could be read, for what is no recording of this program, and for a part of a copy.
    `tell` is told of a recording whose run was broken off, after all its runs.
    """
    reader = _Reader(source, robots)
    try:
        yield from reader.runs()
    except BrokenOff as error:
        yield from reader.rest()
        if not reader.ours:
            raise
        reader.broken_off = str(error)
    except RecordingError:
        yield from reader.rest()
        raise
    if reader.broken_off:
        tell(reader.broken_off)


def follows(run: Run, tick: int) -> bool:
    """Whether a robot's character at `tick` comes right after those of `run`."""
    last = run.tick + (len(run.data) - 1) * TELEMETRY.character_ticks
    return abs(tick - last - SPACING_TICKS) <= SPACING_TOLERANCE_TICKS


def runs_of(periods: Iterable[Period]) -> list[Run]:
    """The runs in `periods`, all from the first on, in the order of time."""
    joiner = _Joiner()
    found = [run for period in periods for run in joiner.take(period.wire)] + joiner.rest()
    return sorted(found, key=lambda run: (run.tick, run.network, run.direction))


class _Joiner:
    """Puts runs together that go on over the end of a period, and finds out which ended in a bad stop bit."""

    def __init__(self) -> None:
        self.open: dict[int, Run] = {}  # network -> what its robots sent last, which may go on

    def take(self, period: Sequence[WireRun]) -> list[Run]:
        """What is complete with the next period."""
        done: list[Run] = []
        carried = dict(self.open)
        for wire in period:
            run = Run(wire.tick, wire.data, wire.direction, wire.network)
            if wire.direction != UP:
                done.append(run)
                continue
            before = self.open.get(run.network)
            if before is not None and follows(before, run.tick):
                if carried.get(run.network) is before:
                    run = msgspec.structs.replace(before, data=before.data + run.data)
                else:
                    done.append(msgspec.structs.replace(before, bad_stop=True))
            elif before is not None:
                done.append(before)
            self.open[run.network] = run
        for network, run in carried.items():
            if self.open.get(network) is run:  # nothing came that could go on with it
                done.append(self.open.pop(network))
        return done

    def rest(self) -> list[Run]:
        """What is left when nothing more comes."""
        left, self.open = list(self.open.values()), {}
        return left


class _Reader:
    def __init__(self, source: Input, robots: dict[int, int]) -> None:
        self.source = source
        self.robots = robots
        self.place = 0
        self.ours = False
        self.broken_off = ""
        self.topics: dict[int, str] = {}
        self.wire_decoder = msgspec.json.Decoder(channels.WireMessage)
        self.period_decoder = msgspec.json.Decoder(channels.PeriodMessage)
        self.period: list[WireRun] = []
        self.joiner = _Joiner()
        self.heap: list[tuple[int, int, str, int, Run]] = []
        self.count = 0

    def runs(self) -> Iterator[Run]:
        for place, record in records(self.source, self.source.label):
            self.place = place
            if isinstance(record, Message):
                topic = self.topics.get(record.channel_id)
                try:
                    if topic == channels.PERIOD_TOPIC:
                        yield from self._close(self.period_decoder.decode(record.data).tick)
                    elif topic is not None:
                        self.period.append(self._wire(topic, record.data))
                except (msgspec.DecodeError, ValueError) as error:
                    self._fail(f"{topic}: {error}", "record the run again")
            elif isinstance(record, Channel):
                kind = channels.message_type(record.topic)
                if kind in (channels.WireMessage, channels.PeriodMessage):
                    self.topics[record.id] = record.topic
            elif isinstance(record, Metadata) and record.name == BROKEN_OFF:
                self.broken_off = f"{self.source.label}: the run that wrote it was broken off"
            elif isinstance(record, Metadata) and record.name == METADATA:
                self.ours = True
                if record.metadata.get("format") != FORMAT:
                    what = f"recording format {record.metadata.get('format')!r}"
                    self._fail(what, f"this program reads format {FORMAT}")
            elif isinstance(record, Attachment) and record.name == SCENARIO_ATTACHMENT:
                self._take_scenario(record.data)
        yield from self.rest()
        if not self.ours:
            self._fail("an MCAP file, but not a recording of this program", "give a run.mcap that it wrote")

    def rest(self) -> Iterator[Run]:
        """What is left when nothing more comes."""
        self._take_period()
        for run in self.joiner.rest():
            self._push(run)
        yield from self._before(None)

    def _fail(self, what: str, remedy: str) -> NoReturn:
        raise RecordingError(self.source.label, f"offset {self.place}", what, remedy) from None

    def _take_scenario(self, text: bytes) -> None:
        """How many robots each network has; a scenario that this version cannot read does not say."""
        try:
            scenario = parse(text.decode("utf-8"), self.source.label)
        except (ScenarioError, UnicodeDecodeError):
            return
        self.robots.update({index: network.robots for index, network in enumerate(scenario.networks)})

    def _wire(self, topic: str, message: bytes) -> WireRun:
        run = channels.wire_run(_network(topic), self.wire_decoder.decode(message))
        if not 0 <= run.tick <= MAX_TICK or run.direction not in DIRECTIONS or not run.data:
            raise ValueError(f"{len(run.data)} characters {run.direction!r} at tick {run.tick}")
        return run

    def _close(self, tick: int) -> Iterator[Run]:
        """The period that began at `tick` is complete."""
        self._take_period()
        yield from self._before(min([tick, *(run.tick for run in self.joiner.open.values())]))

    def _take_period(self) -> None:
        for run in self.joiner.take(self.period):
            self._push(run)
        self.period = []

    def _push(self, run: Run) -> None:
        heapq.heappush(self.heap, (run.tick, run.network, run.direction, self.count, run))
        self.count += 1

    def _before(self, tick: int | None) -> Iterator[Run]:
        while self.heap and (tick is None or self.heap[0][0] < tick):
            yield heapq.heappop(self.heap)[-1]


def _network(topic: str) -> int:
    number = topic.split("/")[1].removeprefix("net")
    if not number.isdecimal() or len(number) > 9:
        raise ValueError("not a topic of a network")
    return int(number)
