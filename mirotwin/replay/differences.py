"""What `replay` and `diff` say of the differences they found: lines, tables and JSON."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import click
import msgspec

from miro_exact.bad_input import amount
from miro_exact.clock import seconds
from miro_protocol.events import Damaged
from miro_protocol.frames import TeamFrame, TelemetryFrame, describe
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.periods import Period
from mirotwin.recording.capture.recorded import transmissions_of
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.difference import WORDS, Difference, first_per_channel, shown
from mirotwin.replay.builds import VariableDifference
from mirotwin.replay.firmwares import FirmwareDifference
from mirotwin.replay.instructions import InstructionDifference
from mirotwin.rerun.job import Job
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.program import complain

LISTED = 5
"""Variables and registers that are named in a line."""


def print_differences(found: Sequence[Difference], everything: bool, words: tuple[str, str] = WORDS) -> None:
    """The first difference of each channel, or all of them."""
    rows = [(one, 1) for one in found] if everything else first_per_channel(found)
    table = plain_table("period", "tick", "t [s]", justify="right")
    table.add_column("channel", no_wrap=True)
    for word in words:
        table.add_column(word)
    if not everything:
        table.add_column("in all", justify="right")
    for one, count in rows:
        place = (str(one.period), str(one.tick), f"{seconds(one.tick):.6f}", one.topic)
        counted = () if everything else (str(count),)
        table.add_row(*place, *one.values(), *counted)
    show(table)
    if len(rows) < len(found):
        channels = "channel" if len(rows) == 1 else "channels"
        show(f"{len(found)} differences in {len(rows)} {channels}; --all lists them")


def print_firmwares(found: FirmwareDifference, words: tuple[str, str] = WORDS) -> None:
    """Lines on stderr: where two firmwares go apart."""
    if found.changed is not None:
        _print_instruction("the first changed instruction that is executed", found.changed, words)
    if found.mapped is not None:
        _print_instruction("the first changed instruction that is executed", found.mapped, words)
    if found.effect is not None and found.effect != found.changed:
        _print_instruction("the states differ for good from here on", found.effect, words)
    if found.effect is not None and found.effect.parted is not None:
        complain(f"they go on at different places after {found.effect.parted}")
    for one in found.variables[:LISTED]:
        _print_variable(one, words)
    if len(found.variables) > LISTED:
        complain(f"{len(found.variables) - LISTED} more variables differ; --json lists them")
    for note in found.notes:
        complain(note)


def _print_instruction(what: str, found: InstructionDifference, words: tuple[str, str]) -> None:
    complain(f"{what}: net{found.network}/robot{found.slot}: {words[0]} {found.one}")
    if (found.one.pc, found.one.text) != (found.other.pc, found.other.text):
        complain(f"  {words[1]} {found.other}")
    values = [
        f"{one.path}: {words[0]} {shown(one.one)}, {words[1]} {shown(one.other)}" for one in found.values
    ]
    if values:
        more = f"; {len(values) - LISTED} more" if len(values) > LISTED else ""
        complain(f"  behind it {'; '.join(values[:LISTED])}{more}")


def _print_variable(found: VariableDifference, words: tuple[str, str]) -> None:
    place = f"net{found.network}/robot{found.slot}: {found.name}"
    at = f"tick {found.tick} ({seconds(found.tick):.6f} s)"
    complain(f"from {at} on {place} differs: {words[0]} {found.one}, {words[1]} {found.other}")
    for word, writer in zip(words, found.writers, strict=True):
        if writer is not None:
            complain(f"  {word}: written at {writer}")


def differences_as_json(
    found: Sequence[Difference], everything: bool, words: tuple[str, str] = WORDS
) -> dict[str, Any]:
    """`count`, `first`, `channels` (the first of each, with `count`), and `differences` if all are wanted."""
    listed = {"differences": [one.as_json(words) for one in found]} if everything else {}
    return {
        "count": len(found),
        "first": found[0].as_json(words) if found else None,
        "channels": [{**one.as_json(words), "count": count} for one, count in first_per_channel(found)],
        **listed,
    }


def print_json(document: dict[str, Any]) -> None:
    click.echo(msgspec.json.format(msgspec.json.encode(document), indent=2))


SHOWN = 20
"""Frames in the list unless all are asked for."""


def print_frames(job: Job, replayed: Sequence[Period], everything: bool, to_tick: int | None) -> None:
    """The frames up to `to_tick` (None: all) that were recorded, of a stream those that were sent."""
    robots = {index: network.robots for index, network in enumerate(job.scenario.networks)}
    lines = sorted(
        frame_lines(transmissions_of(job.recorded or replayed), robots), key=lambda line: line.tick
    )
    if to_tick is not None:
        lines = [line for line in lines if line.tick < to_tick]
    shown: Sequence[FrameLine] = lines if everything else lines[:SHOWN]
    table = plain_table("tick", "t [s]", justify="right")
    table.add_column("")
    table.add_column("from")
    table.add_column("frame")
    for line in shown:
        sender = "host" if line.direction == DOWN else "robot ?" if line.slot < 0 else f"robot {line.slot}"
        if len(robots) > 1:
            sender = f"net{line.network} {sender}"
        table.add_row(str(line.tick), f"{seconds(line.tick):.4f}", line.direction, sender, line.text)
    show(table)
    if len(shown) < len(lines):
        show(f"{len(lines) - len(shown)} more of {len(lines)} frames; --all lists them")


def print_response(replayed: Sequence[Period]) -> None:
    """What the robots made of a stream: there is no recording to compare with."""
    names = ("robot", "accepted", "rejected", "stale", "commands", "left [counts]", "right [counts]")
    table = plain_table(*names, justify="right")
    for index, robot in enumerate(replayed[-1].robots):
        seen = [period.robots[index] for period in replayed]
        commands = sum(len(one.left.commands) + len(one.right.commands) for one in seen)
        counters = [
            str(count) if count is not None else "?"
            for count in (robot.accepted, robot.rejected, robot.stale)
        ]
        positions = (str(robot.left.real_position), str(robot.right.real_position))
        table.add_row(f"{robot.slot}", *counters, str(commands), *positions)
    show(table)


class FrameLine(msgspec.Struct, frozen=True):
    """A frame or a damaged run: first start bit, direction, network, sender's slot, what it says.

    `slot` is -1 for the host's, and for what a robot sent that cannot be told from its bytes.
    """

    tick: int
    direction: str
    network: int
    slot: int
    text: str


def frame_lines(sent: Iterable[Transmission], robots: Mapping[int, int]) -> Iterator[FrameLine]:
    """The lines of everything in `sent`; `robots` is the layout (3 or 5) of each network.

    What the host sent is listed as sent, before the radio.
    """
    for row in rows(sent, robots.__getitem__):
        slot = row.message.slot if isinstance(row.message, TelemetryFrame) else -1
        yield FrameLine(row.event.start_tick, row.direction, row.network, slot, _text(row))


def _text(row: DecodedRow) -> str:
    event, message = row.event, row.message
    if isinstance(event, Damaged):
        reason = event.reason.name.lower().replace("_", " ")
        text = f"{amount(len(event.data), 'byte')}, {reason}: {event.data[:16].hex(' ')}"
        return text + " .." if len(event.data) > 16 else text
    if message is None:
        return f"frame with unknown content: {row.unknown}"
    text = describe(message)
    if isinstance(message, TeamFrame):
        text += "  " + " ".join(f"{left:+d}/{right:+d}" for left, right in message.velocities)
    return text
