"""A recording with Foxglove's topics beside its own, as another recording: `mirotwin export run.mcap --out fox.mcap`.

The result contains every record of the recording unchanged, except camera frames, which it contains once, in Foxglove's
form. So it is readable as a recording, too. The same recording gives the same bytes.
"""

from __future__ import annotations

from io import BytesIO
from typing import BinaryIO

import msgspec
from mcap.records import Attachment, Channel, Message, Metadata, Schema

from miro_exact.bad_input import BadInput, shortened
from miro_exact.clock import nanoseconds
from miro_sim.scenario.file import parse
from miro_sim.scenario.keys import Scenario
from mirotwin.recording import channels, reader
from mirotwin.recording.channels import IMAGE, PERIOD, FaultMessage, ImageMessage, Topic, topic_name, topic_of
from mirotwin.recording.container import Cut, RecordingError, Records
from mirotwin.recording.messages import AGAIN, brief
from mirotwin.recording.recorder import BROKEN_OFF, METADATA
from mirotwin.recording.writer import McapWriter
from mirotwin.report.foxglove import derived, messages
from mirotwin.report.foxglove.derived import Derived, DerivedMessage
from mirotwin.report.foxglove.frames import camera_frame, robot_frame

PREFIX = "foxglove."


def schema_of(message: msgspec.Struct) -> tuple[str, bytes]:
    """Name and text of a message's schema. Foxglove draws by the name, so its own messages have Foxglove's."""
    kind = type(message)
    published = kind.__module__ == messages.__name__
    name = PREFIX + kind.__name__ if published else channels.schema_name(kind)
    return name, channels.schema_text(kind)


FAULT = "fault"


class Conversion:
    """Writes a recording with Foxglove's topics. `path` names it in errors. Raises BadInput.

    `images`: number of images written; `notes`: missing items with reasons, a line each.
    """

    def __init__(self, data: bytes, path: str, stream: BinaryIO) -> None:
        recording = reader.parse(data, path)
        self.path = path
        self.periods = recording.periods
        self.images = 0
        self.notes = [recording.broken_off] if recording.broken_off else []
        scenario: Scenario | None = None
        try:
            with BadInput.at(path):
                scenario = parse(recording.source.scenario_text, "")
        except BadInput as error:
            without = "so there are no camera, no ball, no patches and no references in the scene"
            board = (
                f"{path}: is of a board: `/net0/values` has the values of its parts, and there is no scene"
            )
            self.notes.append(board if recording.source.board else f"{error}; {without}")
        self.derive = Derived(scenario)
        self.writer = McapWriter(stream, profile=METADATA, library=METADATA)
        self._images = msgspec.json.Decoder(ImageMessage)
        self._faults = msgspec.json.Decoder(FaultMessage)
        self._schemas: dict[int, int] = {}  # theirs by number -> ours
        self._channels: dict[int, tuple[int, Topic | None]] = {}
        self._named: dict[str, int] = {}
        self._topics: dict[str, int] = {}
        self._coming = iter(recording.periods)
        self._convert(data)

    def _convert(self, data: bytes) -> None:
        broken = False
        try:
            for _, record in Records(BytesIO(data).read, self.path):
                self._take(record)
                broken = broken or (isinstance(record, Metadata) and record.name == BROKEN_OFF)
        except Cut as error:
            if not broken:
                reason = {"by": type(error).__name__, "reason": shortened(error.what)}
                self.writer.add_metadata(BROKEN_OFF, reason)
        self.writer.finish()

    def _take(self, record: object) -> None:
        if isinstance(record, Message):
            self._take_message(record)
        elif isinstance(record, Schema):
            number = self.writer.add_schema(record.name, record.encoding, record.data)
            self._schemas[record.id] = number
        elif isinstance(record, Channel):
            self._take_channel(record)
        elif isinstance(record, Attachment):
            self.writer.add_attachment(record.name, record.media_type, record.data)
        elif isinstance(record, Metadata):
            self.writer.add_metadata(record.name, record.metadata)

    def _take_channel(self, record: Channel) -> None:
        if record.topic.startswith(derived.PREFIX):
            reason = f"holds Foxglove's topics already ({record.topic})"
            raise BadInput(
                self.path, "", reason, "open it in Foxglove, or give the run.mcap that it was made of"
            )
        topic = topic_of(record.topic)
        schema = self._schemas.get(record.schema_id, 0)
        number = 0  # of none: frames are written in Foxglove's form alone
        if topic is None or topic.channel != IMAGE:
            number = self.writer.add_channel(record.topic, record.message_encoding, schema)
        self._channels[record.id] = number, topic

    def _take_message(self, record: Message) -> None:
        number, topic = self._channels.get(record.channel_id, (0, None))
        if number:
            self.writer.chunk.add(number, record.log_time, msgspec.Raw(record.data))
        if topic is None:
            return
        if topic.channel == IMAGE:
            self._take_image(topic, record)
        elif topic.channel == FAULT and topic.slot >= 0:
            fault = self._faults.decode(record.data)
            time, robot = messages.time_of(fault.tick), robot_frame(topic.network, topic.slot)
            line = messages.Log(time, messages.ERROR, f"firmware fault: {fault.text}", robot)
            self._add(DerivedMessage(derived.LOG, fault.tick, line))
        elif topic.channel == PERIOD and (period := next(self._coming, None)):
            for message in self.derive.period(period):
                self._add(message)

    def _take_image(self, topic: Topic, record: Message) -> None:
        try:
            image = self._images.decode(record.data)
        except (msgspec.DecodeError, ValueError) as error:
            where = f"{topic_name(IMAGE, topic.network)} at {record.log_time} ns"
            raise RecordingError(self.path, where, brief(error), AGAIN) from None
        self.images += 1
        frame = camera_frame(topic.network)
        message = messages.CompressedImage(messages.time_of(image.tick), frame, image.data, "png")
        self._add(DerivedMessage(f"{derived.PREFIX}net{topic.network}/image", image.tick, message))

    def _add(self, to_write: DerivedMessage) -> None:
        topic, tick, message = to_write
        channel = self._topics.get(topic) or self._register(topic, message)
        self.writer.chunk.add(channel, nanoseconds(tick), message)

    def _register(self, topic: str, message: msgspec.Struct) -> int:
        name, text = schema_of(message)
        if name not in self._named:
            self._named[name] = self.writer.add_schema(name, "jsonschema", text)
        self._topics[topic] = self.writer.add_channel(topic, "json", self._named[name])
        return self._topics[topic]
