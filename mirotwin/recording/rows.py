"""Messages on their way into a recording: the structs of a control period, and the chunk that takes them as JSON.

What belongs in a message says `channels`, what becomes of a chunk that is full says `writer`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import gcd

import msgspec
from msgspec.structs import astuple

from miro_exact.clock import NS_PER_SECOND, TICKS_PER_SECOND
from miro_host.eye.track import Sighting
from miro_sim.periods import Axis, Period, RobotPeriod
from mirotwin.recording.channels import (
    PERIOD,
    VALUES,
    WIRE,
    CommandMessage,
    ControlMessage,
    DutyMessage,
    FirmwareMessage,
    Lm629Message,
    MeasurementMessage,
    PeriodMessage,
    PostureMessage,
    PwmMessage,
    RegistersMessage,
    TruthMessage,
    ValuesMessage,
    WireMessage,
    action_message,
    topic_name,
)

Message = tuple[str, int, msgspec.Struct]
"""Topic, tick and content of what does not come out of a control period."""

LAST_NS = (1 << 64) - 1
_MESSAGE = 5  # opcode
_HEAD = 31  # bytes: opcode, length, channel, sequence, log time, publish time
_BEFORE_LENGTH = 9
_EMPTY_HEAD = bytes(_HEAD)
_EMPTY_ENTRY = bytes(16)  # of an index: time, offset


class Chunk:
    """The records of a chunk under way. `indexes`: by channel, times and offsets of its messages as in a file.

    `full` is called with the record that makes the chunk longer than `limit`, to write it and begin another one.
    """

    def __init__(self, limit: int, full: Callable[[], None]) -> None:
        self.limit = limit
        self.full = full
        self.encode_into = msgspec.json.Encoder().encode_into
        self.data = bytearray()
        self.begin()

    def begin(self) -> None:
        """Begins another chunk."""
        self.data.clear()
        self.indexes: dict[int, bytearray] = {}
        self.first_ns = LAST_NS
        self.last_ns = 0

    def add_record(self, record: bytes) -> None:
        """Adds a record that is no message."""
        self.data += record
        self._end()

    def add(self, channel: int, time_ns: int, message: msgspec.Struct | msgspec.Raw) -> None:
        """Adds a message that was logged at `time_ns`: a struct, or JSON. Adds nothing where it raises."""
        begin = len(self.data)
        self.data += _EMPTY_HEAD
        try:
            self.encode_into(message, self.data, -1)
        except BaseException:
            del self.data[begin:]
            raise
        _put_head(self.data, begin, len(self.data) - begin - _BEFORE_LENGTH, channel, time_ns)
        index = self.indexes.get(channel)
        if index is None:
            index = self.indexes[channel] = bytearray()
        entry = len(index)
        index += _EMPTY_ENTRY
        _put(index, entry, time_ns)
        _put(index, entry + 8, begin)
        self.first_ns = min(self.first_ns, time_ns)
        self.last_ns = max(self.last_ns, time_ns)
        self._end()

    def _end(self) -> None:
        if len(self.data) > self.limit:
            self.full()


def _put_head(out: bytearray, begin: int, size: int, channel: int, time_ns: int) -> None:
    """The head of a message, its sequence number 0. Numbers are put in 8 bytes; the next one overwrites the surplus."""
    out[begin] = _MESSAGE
    _put(out, begin + 1, size)
    _put(out, begin + 9, channel)
    _put(out, begin + 15, time_ns)
    _put(out, begin + 23, time_ns)


def _put(out: bytearray, place: int, value: int) -> None:
    """A number in 8 bytes, the lowest first; written out, a compiler makes one store of it."""
    out[place] = value & 0xFF
    out[place + 1] = value >> 8 & 0xFF
    out[place + 2] = value >> 16 & 0xFF
    out[place + 3] = value >> 24 & 0xFF
    out[place + 4] = value >> 32 & 0xFF
    out[place + 5] = value >> 40 & 0xFF
    out[place + 6] = value >> 48 & 0xFF
    out[place + 7] = value >> 56 & 0xFF


class MessageWriter:
    """Writes messages into a chunk.

    `add_channel` makes a channel of a topic from its first message. `crystal_hz`: ticks per second.
    """

    def __init__(
        self,
        chunk: Chunk,
        add_channel: Callable[[str, msgspec.Struct], int],
        crystal_hz: int = TICKS_PER_SECOND,
    ) -> None:
        self.chunk = chunk
        self.add_channel = add_channel
        common = gcd(NS_PER_SECOND, crystal_hz)
        self.ns_ticks = NS_PER_SECOND // common, crystal_hz // common  # so many nanoseconds are so many ticks
        self.channels: dict[str, int] = {}  # by topic

    def write_all(self, waiting: list[Period | Message]) -> None:
        """Writes periods and single messages, in turn."""
        ns, ticks = self.ns_ticks
        for item in waiting:
            if isinstance(item, tuple):
                topic, tick, message = item
                self._add(topic, tick * ns // ticks, message)  # `nanoseconds`
            else:
                self._period(item)

    def _period(self, period: Period) -> None:
        ns, ticks = self.ns_ticks
        tick = period.tick
        time_ns = tick * ns // ticks
        for robot in period.robots:
            self._robot(robot, tick, time_ns)
        for sent in period.wire:
            message = WireMessage(sent.tick, sent.direction, sent.data.hex(), sent.bad_stop)
            self._add(_topic(WIRE, sent.network), sent.tick * ns // ticks, message)
        for action in period.actions:
            channel, about = action_message(action)
            self._add(_topic(channel, action.network), action.tick * ns // ticks, about)
        for parts in period.values:
            values = ValuesMessage(parts.tick, parts.slot, parts.values)
            self._add(_topic(VALUES, parts.network), parts.tick * ns // ticks, values)
        self._add(PERIOD, time_ns, PeriodMessage(tick, period.index, period.digest))

    def _robot(self, robot: RobotPeriod, tick: int, time_ns: int) -> None:
        """All messages of one robot."""
        names: list[str] = _robot_topics(robot.network, robot.slot)
        wanted, true, measured, control = robot.reference, robot.truth, robot.measurement, robot.control
        self._add(names[0], time_ns, PostureMessage(tick, wanted.x_m, wanted.y_m, wanted.theta_rad))
        speeds = robot.v_m_s, robot.w_rad_s
        self._add(names[1], time_ns, TruthMessage(tick, true.x_m, true.y_m, true.theta_rad, *speeds))
        if measured is not None:
            of_picture = (
                (measured.tick, measured.confidence) if isinstance(measured, Sighting) else (None, None)
            )
            message = MeasurementMessage(tick, measured.x_m, measured.y_m, measured.theta_rad, *of_picture)
            self._add(names[2], time_ns, message)
        if control is not None:
            self._add(names[3], time_ns, ControlMessage(tick, *astuple(control)))
        accepted, rejected, stale = robot.accepted, robot.rejected, robot.stale
        if accepted is not None and rejected is not None and stale is not None:
            self._add(names[4], time_ns, FirmwareMessage(tick, accepted, rejected, stale))
        left, right = robot.left, robot.right
        self._add(names[5], time_ns, Lm629Message(tick, _registers(left), _registers(right)))
        self._add(names[6], time_ns, PwmMessage(tick, _duty(left), _duty(right)))

    def _add(self, topic: str, time_ns: int, message: msgspec.Struct) -> None:
        channel = self.channels.get(topic)
        if channel is None:
            channel = self.channels[topic] = self.add_channel(topic, message)
        self.chunk.add(channel, time_ns, message)


def _registers(axis: Axis) -> RegistersMessage:
    desired, real, velocity, status, _, _, commands = astuple(axis)
    taken = tuple([CommandMessage(tick, opcode, data) for tick, opcode, data in commands])
    return RegistersMessage(desired, real, velocity, status, taken)


def _duty(axis: Axis) -> DutyMessage:
    return DutyMessage(axis.pwm_sign, axis.pwm_magnitude)


@cache
def _robot_topics(network: int, slot: int) -> list[str]:
    """Topics of the messages that a robot has in each period, in their order."""
    names = ("reference", "truth", "measurement", "control", "firmware", "lm629", "pwm")
    return [topic_name(name, network, slot) for name in names]


_topic = cache(topic_name)
