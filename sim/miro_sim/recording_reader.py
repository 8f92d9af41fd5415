"""Reads a recording back: what it was made from, and its control periods as the world left them.

What belongs here: MCAP to records, and telling a truncated or foreign file from a recording. What does not:
running it again (`replay`). A file is read whole and checked (CRCs, schema, completeness) before anything
is returned.
"""

import re
import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata
from mcap.stream_reader import CRCValidationError, StreamReader

from miro_sim import channels
from miro_sim.recording import (
    FIRMWARE_ATTACHMENT,
    FORMAT,
    METADATA,
    SCENARIO_ATTACHMENT,
    SYMBOLS_ATTACHMENT,
    Source,
)
from miro_sim.records import Period, RobotPeriod, WireRun

MAGIC = b"\x89MCAP0\r\n"


class RecordingError(ValueError):
    """A file that is no whole recording: `path`, `place` (byte offset), what, remedy."""

    def __init__(self, path: str, place: str, what: str, remedy: str) -> None:
        self.path = path
        self.place = place
        self.what = what
        self.remedy = remedy
        super().__init__(f"{path}: {place}: {what}; {remedy}")


class Recording(msgspec.Struct, frozen=True):
    """A run that was recorded."""

    source: Source
    periods: tuple[Period, ...]

    @property
    def digest(self) -> str:
        """Digest of the whole run, or the empty string if not even one period is in it."""
        return self.periods[-1].digest if self.periods else ""


def read(path: str | Path) -> Recording:
    """Reads a recording. Raises RecordingError for any other content, OSError when it cannot be opened."""
    return parse(Path(path).read_bytes(), str(path))


def parse(data: bytes, path: str) -> Recording:
    """A recording from its bytes; `path` names it in errors."""
    collector = _Collector(path)
    for place, record in records(data, path):
        collector.take(record, place)
    return collector.finish(len(data))


def records(data: bytes, path: str) -> Iterator[tuple[int, McapRecord]]:
    """(offset, record) of everything in an MCAP file; RecordingError at the first place that is damaged."""
    if data and len(data) < len(MAGIC) and MAGIC.startswith(data):
        what, remedy = "the file ends in its first bytes", "record the run again"
        raise RecordingError(path, f"offset {len(data)}", what, remedy)
    if not data.startswith(MAGIC):
        what = "empty file" if not data else "not an MCAP file"
        raise RecordingError(
            path, "offset 0", what, "give a run.mcap that `mirotwin run` wrote, or a stream file"
        )
    stream = BytesIO(data)
    start = 0
    reader = StreamReader(stream, validate_crcs=True, record_size_limit=len(data))
    found = iter(reader.records)
    while True:
        try:
            record = next(found, None)
        except (
            McapError,
            CRCValidationError,
            struct.error,
            ValueError,
            KeyError,
            MemoryError,
            OverflowError,
        ) as error:
            truncated = stream.tell() >= len(data)
            what = (
                "the file ends in the middle of a record"
                if truncated
                else f"damaged record ({_brief(error)})"
            )
            remedy = "record the run again; a recording cut short cannot be trusted"
            raise RecordingError(path, f"offset {start}", what, remedy) from None
        if record is None:
            break
        yield start, record
        start = stream.tell()
    if stream.tell() < len(data):
        what = f"{len(data) - stream.tell()} bytes after the end of the recording"
        raise RecordingError(path, f"offset {stream.tell()}", what, "remove them")


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

    def take(self, record: McapRecord, place: int) -> None:
        self.place = place
        if isinstance(record, Message):
            self._message(record)
        elif isinstance(record, Channel):
            self._channel(record)
        elif isinstance(record, Attachment):
            self.attachments[record.name] = record.data
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

    def finish(self, size: int) -> Recording:
        self.place = size
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
        return Recording(source, tuple(self.periods))


def _place_of(topic: str) -> tuple[int, int, str]:
    match = re.fullmatch(r"/net(\d{1,9})(?:/robot(\d{1,9}))?/(\w+)", topic)
    if match is None:
        raise ValueError("not a topic of a robot")
    return int(match[1]), int(match[2] or -1), match[3]
