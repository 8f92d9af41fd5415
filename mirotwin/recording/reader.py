"""Reads a recording: its sources and its control periods.

A file is read completely and checked (CRCs, schema) before anything is returned. Of a file without an end, the complete
control periods are returned.
"""

import re
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.inputs import RECORDING_BYTES, read_input
from miro_protocol.actions import Action
from miro_protocol.transmission import Transmission
from miro_sim.periods import PartValues, Period
from mirotwin.recording import channels
from mirotwin.recording.channels import OTHER_CHANNELS, ROBOT_CHANNELS, ImageMessage, TheoryMessage, Topic
from mirotwin.recording.container import Cut, RecordingError
from mirotwin.recording.messages import AGAIN, ATTACHMENTS, Messages, brief
from mirotwin.recording.recorder import (
    FIRMWARE_ATTACHMENT,
    RESUMED_ATTACHMENT,
    SCENARIO_ATTACHMENT,
    SYMBOLS_ATTACHMENT,
    RunSource,
)

NOT_READ = (ImageMessage, TheoryMessage)
KINDS = tuple(kind for kind in (*ROBOT_CHANNELS.values(), *OTHER_CHANNELS.values()) if kind not in NOT_READ)
"""The messages that control periods are made of."""


class Recording(msgspec.Struct, frozen=True):
    """A recorded run. `broken_off`: message about an interrupted run, else empty."""

    source: RunSource
    periods: tuple[Period, ...]
    broken_off: str = ""

    @property
    def digest(self) -> str:
        """Digest of the whole run, or the empty string if not even one period is in it."""
        return self.periods[-1].digest if self.periods else ""


def read(path: str | Path) -> Recording:
    """Reads a recording, as far as it goes. Raises RecordingError for any other content, OSError as `open` does."""
    return parse(read_input(path, RECORDING_BYTES), str(path))


def parse(data: bytes, path: str) -> Recording:
    """A recording from its bytes; `path` names it in errors."""
    messages = Messages(BytesIO(data).read, path, KINDS)
    collector = _Collector(lambda: RESUMED_ATTACHMENT in messages.attachments)
    cut: Cut | None = None
    try:
        for topic, message in messages:
            try:
                collector.take(topic, message)
            except (ValueError, KeyError) as error:
                raise messages.unfit(error) from None
    except Cut as error:
        cut = error
    except RecordingError:
        messages.drain()  # a wrong checksum says more than what it made of the contents
        raise
    if cut is not None and (messages.metadata is None or not collector.periods):
        raise cut
    messages.offset = len(data)
    source = _source(messages)
    return Recording(source, tuple(collector.periods), str(cut) if cut else messages.broken_off)


class _Collector:
    """Collects a robot's messages by channel until `/period` closes the period. `resumed`: the run continued a saved
    world, known with the first message; its first period may have any number.
    """

    def __init__(self, resumed: Callable[[], bool]) -> None:
        self.resumed = resumed
        self.first = 0
        self.robots: dict[tuple[int, int], dict[str, Any]] = {}
        self.wire: list[Transmission] = []
        self.actions: list[Action] = []
        self.values: list[PartValues] = []
        self.periods: list[Period] = []

    def take(self, topic: Topic, message: Any) -> None:
        """Raises ValueError or KeyError for a message that does not belong there."""
        if isinstance(message, channels.PeriodMessage):
            self._close(message)
        elif isinstance(message, channels.WireMessage):
            self.wire.append(channels.transmission(topic.network, message))
        elif isinstance(message, channels.ActionMessage):
            self.actions.append(channels.action(topic.network, message))
        elif isinstance(message, channels.PutMessage):
            self.actions.append(channels.put(topic.network, message))
        elif isinstance(message, channels.HardwareMessage):
            self.actions.append(channels.fault(topic.network, message))
        elif isinstance(message, channels.ValuesMessage):
            values = PartValues(topic.network, message.slot, message.tick, message.values)
            self.values.append(values)
        elif topic.channel not in ("samples", "fault"):
            self.robots.setdefault((topic.network, topic.slot), {})[topic.channel] = message

    def _close(self, message: channels.PeriodMessage) -> None:
        if not self.periods and self.resumed():
            self.first = message.index
        if message.index != self.first + len(self.periods):
            raise ValueError(f"period {message.index} where {self.first + len(self.periods)} should be")
        robots = tuple(
            channels.robot_period(network, slot, robot) for (network, slot), robot in self.robots.items()
        )
        taken = tuple(self.wire), message.digest, tuple(self.actions), tuple(self.values)
        period = Period(message.index, message.tick, robots, *taken)
        self.periods.append(period)
        self.robots = {}
        self.wire = []
        self.actions = []
        self.values = []


def _source(messages: Messages) -> RunSource:
    """The sources of the run. Raises RecordingError for a source that is missing."""
    messages.check_ours()
    metadata, attachments = messages.metadata or {}, messages.attachments
    for name in ATTACHMENTS:
        if name not in attachments:
            raise messages.error(f"attachment {name} is missing", AGAIN)
    seed = metadata.get("seed", "")
    if not re.fullmatch(r"[0-9]{1,19}", seed):
        raise messages.error(f"seed {seed!r} is not a number", AGAIN)
    try:
        text = attachments[SCENARIO_ATTACHMENT].decode("utf-8")
        symbols = msgspec.json.decode(attachments[SYMBOLS_ATTACHMENT], type=dict[str, tuple[int, str]])
    except (UnicodeDecodeError, msgspec.DecodeError) as error:
        raise messages.error(brief(error), AGAIN) from None
    return RunSource(
        scenario_name=metadata.get("scenario", ""),
        scenario_text=text,
        seed=int(seed),
        firmware=attachments[FIRMWARE_ATTACHMENT],
        firmware_sha256=metadata.get("firmware_sha256", ""),
        symbols=symbols,
        record=metadata.get("record", "default"),
        state=metadata.get("state", ""),
        resumed=attachments.get(RESUMED_ATTACHMENT, b""),
        origin=metadata.get("source", ""),
        plugins=tuple(metadata.get("plugins", "").splitlines()),
        board=metadata.get("board", ""),
        crystal_hz=number_of(messages, metadata, "crystal_hz", TICKS_PER_SECOND),
        bit_ticks=number_of(messages, messages.serial, "bit_ticks", 0),
    )


def number_of(messages: Messages, table: Mapping[str, str], key: str, default: int) -> int:
    text = table.get(key, f"{default}")
    if not re.fullmatch(r"[0-9]{1,10}", text):
        raise messages.error(f"{key} {text!r} is not a number", AGAIN)
    return int(text)
