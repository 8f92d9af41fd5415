"""What `replay` and `diff` say of the differences they found: lines, tables and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click

from miro_exact.bad_input import amount
from miro_exact.clock import seconds
from miro_protocol.events import Damaged
from miro_protocol.frames import TeamFrame, TelemetryFrame, describe
from miro_protocol.transmission import DOWN
from miro_sim.periods import Period
from mirotwin.recording.capture.recorded import transmissions_of
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.difference import WORDS, Difference, first_per_channel, shown
from mirotwin.replay.builds import VariableDifference
from mirotwin.replay.firmwares import FirmwareDifference
from mirotwin.replay.instructions import InstructionDifference
from mirotwin.rerun.job import Job
from mirotwin.shell.console import plain_table, show
from mirotwin.shell.json_text import json_bytes
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
    for one in (found.changed, found.mapped):
        if one is not None:
            _print_instruction("the first changed instruction that is executed", one, words)
    if found.effect is not None and found.effect != found.changed:
        _print_instruction("the states differ for good from here on", found.effect, words)
    if found.effect is not None and found.effect.parted is not None:
        complain(f"they go on at different places after {found.effect.parted}")
    for variable in found.variables[:LISTED]:
        _print_variable(variable, words)
    if len(found.variables) > LISTED:
        complain(f"{len(found.variables) - LISTED} more variables differ; --json lists them")
    for note in found.notes:
        complain(note)


def _print_instruction(what: str, found: InstructionDifference, words: tuple[str, str]) -> None:
    complain(f"{what}: net{found.network}/robot{found.slot}: {words[0]} {found.one}")
    if (found.one.pc, found.one.text) != (found.other.pc, found.other.text):
        complain(f"  {words[1]} {found.other}")
    values = [
        f"{one.name}: {words[0]} {shown(one.one)}, {words[1]} {shown(one.other)}" for one in found.values
    ]
    if values:
        more = f"; {len(values) - LISTED} more" if len(values) > LISTED else ""
        complain(f"  after it {'; '.join(values[:LISTED])}{more}")


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
    click.echo(json_bytes(document, indent=2))


SHOWN = 20
"""Frames in the list unless all are asked for."""


def print_frames(job: Job, replayed: Sequence[Period], everything: bool, to_tick: int | None) -> None:
    """The frames up to `to_tick` (None: all) that were recorded, of a stream those that were sent."""
    robots = {index: network.robots for index, network in enumerate(job.scenario.networks)}
    found = sorted(
        rows(transmissions_of(job.recorded or replayed), robots.__getitem__),
        key=lambda row: row.event.start_tick,
    )
    if to_tick is not None:
        found = [row for row in found if row.event.start_tick < to_tick]
    shown = found if everything else found[:SHOWN]
    table = plain_table("tick", "t [s]", justify="right")
    table.add_column("")
    table.add_column("from")
    table.add_column("frame")
    for row in shown:
        sender = "host" if row.direction == DOWN else "robot ?"
        if isinstance(row.message, TelemetryFrame):
            sender = f"robot {row.message.slot}"
        if len(robots) > 1:
            sender = f"net{row.network} {sender}"
        tick = row.event.start_tick
        table.add_row(str(tick), f"{seconds(tick):.4f}", row.direction, sender, frame_text(row))
    show(table)
    if len(shown) < len(found):
        show(f"{len(found) - len(shown)} more of {len(found)} frames; --all lists them")


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


def frame_text(row: DecodedRow) -> str:
    """What a frame or a damaged run says."""
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
