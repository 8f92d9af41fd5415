"""Messages on their way into a recording: values in the forms that they stand in, and the chunk that takes them.

A form is a message as JSON, with a line end in place of each value. So the values of many messages are encoded at once,
a line each, and only copied here. What belongs in a message says `channels`, where a chunk ends says `writer`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import msgspec
from msgspec.structs import astuple

from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_protocol.transmission import Transmission
from miro_sim.periods import Axis, Control, Period, RobotPeriod
from mirotwin.recording import topics
from mirotwin.recording.channels import (
    CommandMessage,
    ControlMessage,
    FirmwareMessage,
    Lm629Message,
    MeasurementMessage,
    PeriodMessage,
    PostureMessage,
    PwmMessage,
    TruthMessage,
    WireMessage,
    action_message,
)

Head = tuple[int, int, bytes]
"""Channel, time and form of a message."""

WHOLE = b"\n"
"""The form of a message whose only value is all of it."""
LAST_NS = (1 << 64) - 1
_LINE_END = 10
_MESSAGE = 5  # opcode
_HEAD = 31  # bytes: opcode, length, channel, sequence, log time, publish time
_BEFORE_LENGTH = 9


@cache
def form_of(kind: type[msgspec.Struct]) -> bytes:
    """The form of messages of a kind; what a message in it holds are values too."""
    fields = [
        f'"{field.encode_name}":'.encode() + (form_of(field.type) if _is_message(field.type) else WHOLE)
        for field in msgspec.structs.fields(kind)
    ]
    return b"{" + b",".join(fields) + b"}"


def _is_message(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)


class Chunk:
    """The records of a chunk under way. `indexes`: channel -> time and offset of each message, in one row."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.indexes: dict[int, list[int]] = {}
        self.first_ns = LAST_NS
        self.last_ns = 0
        self.end = 0  # where `_fill` came to

    def add(self, channel: int, time_ns: int, content: bytes) -> None:
        """Adds a message."""
        begin = len(self.data)
        self.data += bytes(_HEAD)
        self._head(memoryview(self.data), begin, len(content), channel, time_ns)
        self.data += content

    def fill(self, heads: list[Head], first: int, text: bytes, at: int, limit: int) -> tuple[int, int]:
        """Adds messages from `heads[first]` on, up to the one that makes the chunk longer than `limit`.

        Their values stand in `text`, from `at` on. Returns where both go on.
        """
        end = len(self.data)
        room = len(text) - at
        for place in range(first, len(heads)):
            room += _HEAD + len(heads[place][2])
        self.data += bytes(room)
        reached = self._fill(memoryview(self.data), end, heads, first, text, at, limit)
        del self.data[self.end :]
        return reached

    def _fill(
        self, out: memoryview, end: int, heads: list[Head], first: int, text: bytes, at: int, limit: int
    ) -> tuple[int, int]:
        place = first
        while place < len(heads) and (place == first or end <= limit):
            channel, time_ns, form = heads[place]
            begin = end
            end += _HEAD
            for index in range(len(form)):
                byte = form[index]
                if byte != _LINE_END:
                    out[end] = byte
                    end += 1
                    continue
                assert at < len(text), "there are fewer values than the forms have places for"
                while text[at] != _LINE_END:
                    out[end] = text[at]
                    end += 1
                    at += 1
                at += 1
            self._head(out, begin, end - begin - _HEAD, channel, time_ns)
            place += 1
        self.end = end
        return place, at

    def _head(self, out: memoryview, begin: int, size: int, channel: int, time_ns: int) -> None:
        """The head of a message whose content has `size` bytes, and its entry in the index."""
        out[begin] = _MESSAGE
        _put(out, begin + 1, size + _HEAD - _BEFORE_LENGTH, 8)
        _put(out, begin + 9, channel, 2)
        _put(out, begin + 11, 0, 4)
        _put(out, begin + 15, time_ns, 8)
        _put(out, begin + 23, time_ns, 8)
        index = self.indexes.get(channel)
        if index is None:
            index = self.indexes[channel] = []
        index.append(time_ns)
        index.append(begin)
        self.first_ns = min(self.first_ns, time_ns)
        self.last_ns = max(self.last_ns, time_ns)


def _put(out: memoryview, place: int, value: int, size: int) -> None:
    """A number, the lowest byte first."""
    for index in range(size):
        out[place + index] = value >> 8 * index & 0xFF


class Rows:
    """Messages that wait: their heads, and the values of all of them.

    `add_channel` makes a channel of a topic, from its first message's kind and the names of a law's inner values.
    `write` takes heads and values, and is called before a channel is added too.
    """

    def __init__(
        self,
        add_channel: Callable[[str, type[msgspec.Struct], tuple[str, ...] | None], int],
        write: Callable[[list[Head], list[Any]], None],
    ) -> None:
        self.add_channel = add_channel
        self.write = write
        self.channels: dict[str, tuple[int, bytes]] = {}  # by topic: number, form of the messages
        self.heads: list[Head] = []
        self.values: list[Any] = []

    def flush(self) -> None:
        """Writes what waits."""
        heads, values = self.heads, self.values
        self.clear()
        self.write(heads, values)

    def clear(self) -> None:
        """Drops what waits: of a period that failed there is a part, perhaps heads without values."""
        self.heads, self.values = [], []

    def message(self, topic: str, tick: int, message: msgspec.Struct) -> None:
        """Any message, encoded as one value."""
        if topic not in self.channels:
            self._add_channel(topic, type(message), WHOLE, None)
        self._begin(topic, tick, type(message))
        self.values.append(message)

    def period(self, period: Period) -> None:
        """All messages of a control period."""
        tick = period.tick
        for robot in period.robots:
            self._robot(robot, tick)
        for sent in period.wire:
            self._wire(sent)
        for action in period.actions:
            self.message(topics.actions_topic(action.network), action.tick, action_message(action))
        self._begin(topics.PERIOD, tick, PeriodMessage)
        self.values += (tick, period.index, period.digest)

    def _wire(self, sent: Transmission) -> None:
        self._begin(_wire_topic(sent.network), sent.tick, WireMessage)
        self.values += (sent.tick, sent.direction, sent.data.hex(), sent.bad_stop)

    def _robot(self, robot: RobotPeriod, tick: int) -> None:
        """All messages of one robot."""
        names: list[str] = _robot_topics(robot.network, robot.slot)
        seen, answer, left, right = robot.measurement, robot.control, robot.left, robot.right
        accepted, rejected, stale = robot.accepted, robot.rejected, robot.stale
        self._begin(names[0], tick, PostureMessage)
        self._posture(tick, robot.reference)
        self._begin(names[1], tick, TruthMessage)
        self._posture(tick, robot.truth)
        self.values += (robot.v_m_s, robot.w_rad_s)
        if seen is not None:
            self._begin(names[2], tick, MeasurementMessage)
            self._posture(tick, seen)
            self.values += (seen.tick, seen.confidence) if isinstance(seen, Sighting) else (None, None)
        if answer is not None:
            self._control(names[3], answer, tick)
        if accepted is not None and rejected is not None and stale is not None:
            self._begin(names[4], tick, FirmwareMessage)
            self.values += (tick, accepted, rejected, stale)
        self._begin(names[5], tick, Lm629Message)
        self.values.append(tick)
        self._registers(left)
        self._registers(right)
        self._begin(names[6], tick, PwmMessage)
        self.values += (tick, left.pwm_sign, left.pwm_magnitude, right.pwm_sign, right.pwm_magnitude)

    def _control(self, topic: str, answer: Control, tick: int) -> None:
        if topic not in self.channels:
            self._add_channel(topic, ControlMessage, form_of(ControlMessage), tuple(answer.inner))
        self._begin(topic, tick, ControlMessage)
        self.values.append(tick)
        self.values += astuple(answer)

    def _registers(self, axis: Axis) -> None:
        commands = [CommandMessage(tick, opcode, data) for tick, opcode, data in axis.commands]
        self.values += (axis.desired_position, axis.real_position, axis.desired_velocity, axis.status)
        self.values.append(commands)

    def _posture(self, tick: int, at: Posture) -> None:
        """By name: a plug-in's reference may give a posture that holds more."""
        self.values += (tick, at.x_m, at.y_m, at.theta_rad)

    def _begin(self, topic: str, tick: int, kind: type[msgspec.Struct]) -> None:
        """A message, whose values are the next ones."""
        found = self.channels.get(topic)
        if found is None:
            found = self._add_channel(topic, kind, form_of(kind), None)
        self.heads.append((found[0], tick * 125 // 3, found[1]))  # `nanoseconds`

    def _add_channel(
        self, topic: str, kind: type[msgspec.Struct], form: bytes, inner: tuple[str, ...] | None
    ) -> tuple[int, bytes]:
        self.flush()
        found = self.channels[topic] = self.add_channel(topic, kind, inner), form
        return found


@cache
def _robot_topics(network: int, slot: int) -> list[str]:
    """Of the messages that a robot has in each period, in their order."""
    names = ("reference", "truth", "measurement", "control", "firmware", "lm629", "pwm")
    return [topics.robot_topic(network, slot, name) for name in names]


_wire_topic = cache(topics.wire_topic)
