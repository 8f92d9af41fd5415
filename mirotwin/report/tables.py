"""A run as tables: one for each channel of a recording, with units in the names of the columns.

A table has the name of its channel (`net0/robot0/truth`). There are further tables for the commands of LM629s and for
all changes on a board. Every row begins with its tick and its time.
"""

from __future__ import annotations

import csv
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from io import TextIOWrapper
from operator import itemgetter
from pathlib import Path
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_host.wheels import UNITS_PER_COUNT
from miro_protocol.transmission import Transmission
from miro_robot.lm629.commands import BY_OPCODE
from mirotwin.recording.capture.input import STDIN, Input
from mirotwin.recording.channels import OTHER_CHANNELS, ROBOT_CHANNELS, ImageMessage, topic_name
from mirotwin.recording.container import BrokenOff
from mirotwin.recording.messages import Messages
from mirotwin.recording.reader import number_of
from mirotwin.shell.outputs import check_new, whole_file
from mirotwin.shell.program import complain

Row = dict[str, Any]
Named = tuple[str, Row]
KINDS = {*ROBOT_CHANNELS.values(), *OTHER_CHANNELS.values()} - {ImageMessage}
COMMANDS = "commands"
UNITS: dict[str, tuple[str, int]] = {
    "desired_position": ("counts", 1),
    "real_position": ("counts", 1),
    "desired_velocity": ("counts_per_sample", 1 << 16),
    "left": ("counts_per_sample", UNITS_PER_COUNT),
    "right": ("counts_per_sample", UNITS_PER_COUNT),
    "magnitude": ("127ths", 1),
    "duty": ("127ths", 1),
    "accepted": ("frames", 1),
    "rejected": ("frames", 1),
    "stale": ("frames", 1),
    "data": ("hex", 1),
}
"""Fields of messages without a unit in their name: unit, and divisor from the recorded value to that unit."""


def timed(tick: int, clock: int) -> Row:
    """The first columns of every row."""
    return {"tick": tick, "time_s": f"{tick / clock:.9f}"}


def recorded_rows(given: Input, network: int | None) -> Iterator[Named]:
    """The rows of a recording, of all networks or of one. Raises RecordingError; reports an interrupted run."""
    messages = Messages(given.read, given.label, KINDS)
    clock = 0
    broken_off = ""
    try:
        for topic, message in messages:
            clock = clock or number_of(messages, messages.metadata or {}, "crystal_hz", TICKS_PER_SECOND)
            if network is None or topic.network in (network, -1):
                name = (
                    topic_name(topic.channel, topic.network, topic.slot) if topic.network >= 0 else "period"
                )
                yield from message_rows(name.lstrip("/"), message, clock)
    except BrokenOff as error:
        if messages.metadata is None:
            raise
        broken_off = f"{error}"
    messages.check_ours()
    if broken_off or messages.broken_off:
        complain(broken_off or messages.broken_off)


def message_rows(name: str, message: Any, clock: int) -> Iterator[Named]:
    """The row of a message, and one for each of the commands in it."""
    row, commands = timed(message.tick, clock), list[Row]()
    _fill(row, commands, "", message)
    yield name, row
    for command in sorted(commands, key=itemgetter("tick")):
        known = BY_OPCODE.get(command["opcode"])
        yield (
            f"{name}-{COMMANDS}",
            timed(command["tick"], clock) | command | {"name": known.name if known else ""},
        )


def _fill(row: Row, commands: list[Row], prefix: str, message: Any) -> None:
    for name in message.__struct_fields__:
        value = getattr(message, name)
        if isinstance(value, msgspec.Struct):
            _fill(row, commands, f"{prefix}{name}_", value)
        elif name == COMMANDS:
            commands += [
                {
                    "tick": command.tick,
                    "chip": prefix[:-1],
                    "opcode": command.opcode,
                    "data_hex": command.data,
                }
                for command in value
            ]
        elif isinstance(value, dict):
            row |= {f"{prefix}{name}.{key}": inner for key, inner in value.items()}
        elif isinstance(value, tuple):
            row[f"{prefix}{name}"] = " ".join(map(str, value))
        elif name != "tick":
            unit, scale = UNITS.get(name.removeprefix("left_").removeprefix("right_"), ("", 1))
            row[f"{prefix}{name}_{unit}".rstrip("_")] = value if scale == 1 else value / scale


def wire_row(sent: Transmission) -> Named:
    """Of characters in a capture or a stream file."""
    said = {"data_hex": sent.data.hex(), "bad_stop": " ".join(map(str, sent.bad_stop))}
    return "wire", timed(sent.tick, TICKS_PER_SECOND) | {
        "network": sent.network,
        "direction": sent.direction,
    } | said


class Tables(ExitStack):
    """Writes rows as CSV files, each whole or not at all.

    `single`: there is one table, and `out` is its file, or `-`, which is standard output. Else each table has its own
    file beside it: `x-net0-wire.csv` for `x.csv`. `only`: the table that is wanted, None for all. `given`: the input.
    """

    def __init__(self, out: str, single: bool, only: str | None, force: bool, given: str) -> None:
        super().__init__()
        self.out = Path(out)
        self.single = single
        self.only = only
        self.force = force
        self.given = given
        self.rows: Counter[str] = Counter()
        self.paths: list[Path] = []
        self.passed_over: dict[str, None] = {}
        self._writers: dict[str, tuple[frozenset[str], csv.DictWriter[str]]] = {}

    def add(self, table: str, row: Row) -> None:
        """Raises OutputError for a file that cannot be written, or is there already."""
        if self.only and table != self.only:
            self.passed_over[table] = None
            return
        columns, writer = self._writers.get(table) or self._open(table, row)
        if not row.keys() <= columns:
            new = ", ".join(key for key in row if key not in columns)
            raise BadInput(
                self.given,
                table,
                f"tick {row['tick']}: {new} is not in the rows before",
                "leave it out with --channel",
            )
        writer.writerow(row)
        self.rows[table] += 1

    def _open(self, table: str, row: Row) -> tuple[frozenset[str], csv.DictWriter[str]]:
        if f"{self.out}" == STDIN:
            text = TextIOWrapper(sys.stdout.buffer, "utf-8", newline="", write_through=True)
            self.callback(text.detach)
        else:
            path = self.out
            if not self.single:
                path = path.with_name(f"{path.stem}-{table.replace('/', '-')}{path.suffix}")
            check_new(path, "--out", self.force, self.given)
            text = self.enter_context(
                self.enter_context(whole_file(path, "--out")).open("w", encoding="utf-8", newline="")
            )
            self.paths.append(path)
        writer = csv.DictWriter(text, list(row), lineterminator="\n")
        writer.writeheader()
        self._writers[table] = frozenset(row), writer
        return self._writers[table]
