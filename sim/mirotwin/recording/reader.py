"""Reads a recording back: what it was made from, and its control periods as the world left them.

What belongs here: messages to periods, and telling a foreign file from a recording. What does not: the container
(`container`), and running it again (`replay`). A file is read whole and checked (CRCs, schema) before anything is
returned. Of one that has no end, the whole control periods are returned.
"""

import re
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata

from miro_sim.periods import Period, RobotPeriod, WireRun
from mirotwin.recording import channels
from mirotwin.recording.container import Cut, RecordingError, records
from mirotwin.recording.recorder import (
    BROKEN_OFF,
    FIRMWARE_ATTACHMENT,
    FORMAT,
    METADATA,
    SCENARIO_ATTACHMENT,
    SYMBOLS_ATTACHMENT,
    Source,
)


class Recording(msgspec.Struct, frozen=True):
    """A run that was recorded. `broken_off`: what to say of one that does not go to its end, else empty."""

    source: Source
    periods: tuple[Period, ...]
    broken_off: str = ""

    @property
    def digest(self) -> str:
        """Digest of the whole run, or the empty string if not even one period is in it."""
        return self.periods[-1].digest if self.periods else ""


def read(path: str | Path) -> Recording:
    """Reads a recording, as far as it goes. Raises RecordingError for any other content, OSError as `open` does."""
    return parse(Path(path).read_bytes(), str(path))


def parse(data: bytes, path: str) -> Recording:
    """A recording from its bytes; `path` names it in errors."""
    collector = _Collector(path)
    found = records(BytesIO(data), path)
    try:
        for place, record in found:
            collector.take(record, place)
    except Cut as cut:
        return collector.finish(len(data), cut)
    except RecordingError:
        for _ in found:  # a wrong checksum says more than what it made of the contents
            pass
        raise
    return collector.finish(len(data))


def _brief(error: Exception) -> str:
    return f"{error}".strip().splitlines()[0] if f"{error}".strip() else type(error).__name__


class _Collector:
    """Puts records together again: messages of a robot by channel, until `/period` closes the period."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.place = 0
        self.topics: dict[int, str] = {}
        self.decoders: dict[str, msgspec.json.Decoder[Any]] = {}
        self.metadata: dict[str, str] | None = None
        self.attachments: dict[str, bytes] = {}
        self.robots: dict[tuple[int, int], dict[str, Any]] = {}
        self.wire: list[WireRun] = []
        self.periods: list[Period] = []
        self.broken_off = ""

    def take(self, record: McapRecord, place: int) -> None:
        self.place = place
        if isinstance(record, Message):
            self._message(record)
        elif isinstance(record, Channel):
            self._channel(record)
        elif isinstance(record, Attachment):
            self.attachments[record.name] = record.data
        elif isinstance(record, Metadata) and record.name == BROKEN_OFF:
            self.broken_off = f"{self.path}: the run that wrote it was broken off"
        elif isinstance(record, Metadata) and record.name == METADATA:
            self.metadata = record.metadata
            if self.metadata.get("format") != FORMAT:
                raise self.error(
                    f"recording format {self.metadata.get('format')!r}", f"this program reads format {FORMAT}"
                )

    def error(self, what: str, remedy: str) -> RecordingError:
        return RecordingError(self.path, f"offset {self.place}", what, remedy)

    def _channel(self, record: Channel) -> None:
        kind = channels.message_type(record.topic)
        if kind is not None and record.id not in self.topics:
            self.topics[record.id] = record.topic
            self.decoders[record.topic] = msgspec.json.Decoder(kind)

    def _message(self, record: Message) -> None:
        topic = self.topics.get(record.channel_id)
        if topic is None:
            return
        try:
            message = self.decoders[topic].decode(record.data)
            self._place(topic, message)
        except (msgspec.DecodeError, ValueError, KeyError) as error:
            raise self.error(f"{topic}: {_brief(error)}", "record the run again") from None

    def _place(self, topic: str, message: Any) -> None:
        if isinstance(message, channels.PeriodMessage):
            self._close(message)
            return
        network, slot, channel = _place_of(topic)
        if channel == "wire":
            self.wire.append(channels.wire_run(network, message))
        elif channel not in ("samples", "fault"):
            self.robots.setdefault((network, slot), {})[channel] = message

    def _close(self, message: channels.PeriodMessage) -> None:
        if message.index != len(self.periods):
            raise ValueError(f"period {message.index} where {len(self.periods)} should be")
        robots: list[RobotPeriod] = [
            channels.robot_period(network, slot, found) for (network, slot), found in self.robots.items()
        ]
        self.periods.append(
            Period(message.index, message.tick, tuple(robots), tuple(self.wire), message.digest)
        )
        self.robots = {}
        self.wire = []

    def finish(self, size: int, cut: Cut | None = None) -> Recording:
        """The recording; `cut` is raised again if it left out what a recording needs."""
        self.place = size
        if cut is not None and (self.metadata is None or not self.periods):
            raise cut
        if self.metadata is None:
            raise self.error(
                "an MCAP file, but not a recording of this program", "give a run.mcap that it wrote"
            )
        for name in (SCENARIO_ATTACHMENT, FIRMWARE_ATTACHMENT, SYMBOLS_ATTACHMENT):
            if name not in self.attachments:
                raise self.error(f"attachment {name} is missing", "record the run again")
        seed = self.metadata.get("seed", "")
        if not re.fullmatch(r"\d{1,19}", seed):
            raise self.error(f"seed {seed!r} is not a number", "record the run again")
        try:
            text = self.attachments[SCENARIO_ATTACHMENT].decode("utf-8")
            symbols = msgspec.json.decode(
                self.attachments[SYMBOLS_ATTACHMENT], type=dict[str, tuple[int, str]]
            )
        except (UnicodeDecodeError, msgspec.DecodeError) as error:
            raise self.error(_brief(error), "record the run again") from None
        source = Source(
            scenario_name=self.metadata.get("scenario", ""),
            scenario_text=text,
            seed=int(seed),
            firmware=self.attachments[FIRMWARE_ATTACHMENT],
            firmware_sha256=self.metadata.get("firmware_sha256", ""),
            symbols=symbols,
            record=self.metadata.get("record", "default"),
        )
        return Recording(source, tuple(self.periods), str(cut) if cut else self.broken_off)


def _place_of(topic: str) -> tuple[int, int, str]:
    match = re.fullmatch(r"/net(\d{1,9})(?:/robot(\d{1,9}))?/(\w+)", topic)
    if match is None:
        raise ValueError("not a topic of a robot")
    return int(match[1]), int(match[2] or -1), match[3]
