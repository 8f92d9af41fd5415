"""The messages of a recording in order, and its metadata and attachments: the only reader of our MCAP files."""

from collections.abc import Callable, Collection, Iterator
from typing import Any

import msgspec
from mcap.records import Attachment, Channel, Message, Metadata

from miro_exact.bad_input import one_line, shortened
from mirotwin.recording import channels
from mirotwin.recording.channels import Topic, topic_of
from mirotwin.recording.container import RecordingError, Records
from mirotwin.recording.recorder import (
    BROKEN_OFF,
    FIRMWARE_ATTACHMENT,
    FORMAT,
    METADATA,
    RESUMED_ATTACHMENT,
    SCENARIO_ATTACHMENT,
    SERIAL,
    SYMBOLS_ATTACHMENT,
)

ATTACHMENTS = (SCENARIO_ATTACHMENT, FIRMWARE_ATTACHMENT, SYMBOLS_ATTACHMENT)
AGAIN = "record the run again"


class Messages:
    """Iterates over (topic, message) of those of `kinds` (default: all). Raises RecordingError where reading cannot
    continue.

    `read` and `path` as in `Records`. `metadata` (None: not a recording of this program) and `attachments` are at the
    beginning of a file and known with the first message; `serial`, about a board's line, comes later, or not at all.
    `broken_off`: message about an interrupted run, else "".
    """

    def __init__(
        self, read: Callable[[int], bytes], path: str, kinds: Collection[type[msgspec.Struct]] | None = None
    ) -> None:
        self.path = path
        self.kinds = kinds
        self.offset = 0
        self.metadata: dict[str, str] | None = None
        self.serial: dict[str, str] = {}
        self.attachments: dict[str, bytes] = {}
        self.broken_off = ""
        self._topic = ""
        self._records = iter(Records(read, path))
        self._channels: dict[int, tuple[str, Topic, msgspec.json.Decoder[Any]]] = {}

    def __iter__(self) -> Iterator[tuple[Topic, Any]]:
        for offset, record in self._records:
            self.offset = offset
            if isinstance(record, Message):
                channel = self._channels.get(record.channel_id)
                if channel is not None:
                    self._topic, topic, decoder = channel
                    try:
                        message = decoder.decode(record.data)
                    except (msgspec.DecodeError, ValueError) as error:
                        raise self.unfit(error) from None
                    yield topic, message
            elif isinstance(record, Channel):
                self._open(record)
            elif isinstance(record, Attachment) and record.name in (*ATTACHMENTS, RESUMED_ATTACHMENT):
                self.attachments[record.name] = record.data
            elif isinstance(record, Metadata):
                self._take_metadata(record)

    def _open(self, record: Channel) -> None:
        topic = topic_of(record.topic)
        kind = None if topic is None else channels.message_type(topic)
        if topic is None or kind is None or record.id in self._channels:
            return
        if self.kinds is None or kind in self.kinds:
            self._channels[record.id] = (record.topic, topic, msgspec.json.Decoder(kind))

    def _take_metadata(self, record: Metadata) -> None:
        if record.name == BROKEN_OFF:
            self.broken_off = f"{self.path}: the run that wrote it was broken off"
            if record.metadata.get("reason"):
                self.broken_off += f": {one_line(shortened(record.metadata['reason']))}"
        elif record.name == SERIAL:
            self.serial = record.metadata
        elif record.name == METADATA:
            self.metadata = record.metadata
            recorded_format = record.metadata.get("format")
            if recorded_format != FORMAT:
                remedy = f"this program reads format {FORMAT}; use the version that wrote it, or {AGAIN}"
                raise self.error(f"recording format {recorded_format!r}", remedy)

    def drain(self) -> None:
        """Reads to the end. Raises RecordingError if a checksum of the rest is wrong."""
        for _ in self._records:
            pass

    def check_ours(self) -> None:
        """Raises RecordingError unless the content so far is a recording of this program."""
        if self.metadata is None:
            reason = "an MCAP file, but not a recording of this program"
            raise self.error(reason, "give a run.mcap that it wrote")

    def error(self, reason: str, remedy: str) -> RecordingError:
        return RecordingError(self.path, f"offset {self.offset}", reason, remedy)

    def unfit(self, error: Exception) -> RecordingError:
        """The error for a last message with impossible content."""
        return self.error(f"{self._topic}: {brief(error)}", AGAIN)


def brief(error: Exception) -> str:
    """The text of an error in one line."""
    text = f"{error}".strip()
    return text.splitlines()[0] if text else type(error).__name__
