"""Lines and tables of `replay` and `diff`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.table import Table

from miro_exact.bad_input import amount
from miro_exact.clock import seconds
from miro_protocol.events import Damaged
from miro_protocol.frames import TeamFrame, TelemetryFrame
from miro_protocol.transmission import DOWN
from miro_sim.periods import Period
from mirotwin.recording.capture.recorded import transmissions_of
from mirotwin.recording.capture.render import SHOWN_BYTES, described
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.difference import first_per_channel, moment, shown
from mirotwin.replay.difference import RunDifference
from mirotwin.replay.lockstep.firmwares import FirmwareDifference
from mirotwin.replay.lockstep.instructions import InstructionDifference
from mirotwin.replay.lockstep.variables import VariableDifference
from mirotwin.runs.job import Job
from mirotwin.runs.made_from import SourceDifference
from mirotwin.shell.console import plain_table

LISTED = 5
"""Variables and registers that are named in a line."""
Names = tuple[str, str]


def difference_lines(difference: RunDifference, subject: str) -> Iterator[str]:
    """Where `subject` differs first, and what was found by repeating both runs; the notes are not in it."""
    if not difference.differences:
        return
    yield f"{subject} in control period {difference.period}, {difference.differences[0].line(difference.names)}"
    if difference.state is not None:
        yield f"their states differ from {difference.state} on"
    if difference.instruction is not None:
        yield from _firmware_lines(difference.instruction, difference)


def difference_tables(difference: RunDifference, everything: bool) -> Iterator[Table | str]:
    """The first difference of each channel, or all of them."""
    if not difference.differences:
        return
    listed = first_per_channel(difference.differences)
    if everything:
        listed = [(each, 1) for each in difference.differences]
    table = plain_table("period", "tick", "t [s]", justify="right")
    table.add_column("channel", no_wrap=True)
    for name in difference.names:
        table.add_column(name)
    if not everything:
        table.add_column("in all", justify="right")
    for each, count in listed:
        place = (str(each.period), str(each.tick), f"{each.tick / each.clock:.6f}", each.topic)
        table.add_row(*place, *each.values(), *([] if everything else [str(count)]))
    yield table
    if len(listed) < len(difference.differences):
        yield f"{len(difference.differences)} differences in {amount(len(listed), 'channel')}; --all lists them"


def source_tables(origins: Sequence[SourceDifference], names: Names) -> Iterator[Table | str]:
    """A table of the sources in which two runs differ, and an empty line."""
    if origins:
        table = plain_table("made from", *names)
        for origin in origins:
            table.add_row(origin.key, origin.a, origin.b)
        yield table
        yield ""


def _firmware_lines(difference: FirmwareDifference, runs: RunDifference) -> Iterator[str]:
    for each in (difference.changed, difference.mapped):
        if each is not None:
            yield from _instruction_lines("the first changed instruction that is executed", each, runs)
    if difference.effect is not None and difference.effect != difference.changed:
        yield from _instruction_lines("the states differ for good from here on", difference.effect, runs)
    if difference.effect is not None and difference.effect.parted is not None:
        yield f"they go on at different places after {difference.effect.parted}"
    for variable in difference.variables[:LISTED]:
        yield from _variable_lines(variable, runs)
    if len(difference.variables) > LISTED:
        yield f"{len(difference.variables) - LISTED} more variables differ; --json lists them"
    yield from difference.notes


def _instruction_lines(head: str, difference: InstructionDifference, runs: RunDifference) -> Iterator[str]:
    names = runs.names
    yield f"{head}: {_place(difference, runs)}{names[0]} {difference.one}"
    if (difference.one.pc, difference.one.text) != (difference.other.pc, difference.other.text):
        yield f"  {names[1]} {difference.other}"
    values = [
        f"{each.name}: {names[0]} {shown(each.one)}, {names[1]} {shown(each.other)}"
        for each in difference.values
    ]
    if values:
        more = f"; {len(values) - LISTED} more" if len(values) > LISTED else ""
        yield f"  after it {'; '.join(values[:LISTED])}{more}"


def _variable_lines(difference: VariableDifference, runs: RunDifference) -> Iterator[str]:
    names, since = runs.names, moment(difference.tick, difference.clock)
    values = f"{names[0]} {difference.one}, {names[1]} {difference.other}"
    yield f"from {since} on {_place(difference, runs)}{difference.name} differs: {values}"
    for name, writer in zip(names, difference.writers, strict=True):
        if writer is not None:
            yield f"  {name}: written at {writer}"


def _place(difference: InstructionDifference | VariableDifference, runs: RunDifference) -> str:
    return "" if runs.alone else f"net{difference.network}/robot{difference.slot}: "


SHOWN = 20
"""Frames in the list unless all are requested."""


def frame_tables(
    job: Job, replayed: Sequence[Period], everything: bool, to_tick: int | None
) -> Iterator[Table | str]:
    """The frames up to `to_tick` (None: all) that were recorded, of a stream those that were sent."""
    robots = {index: network.robots for index, network in enumerate(job.spec.robot_scenario.networks)}
    decoded = sorted(
        rows(transmissions_of(job.recorded or replayed), robots.__getitem__),
        key=lambda row: row.event.start_tick,
    )
    if to_tick is not None:
        decoded = [row for row in decoded if row.event.start_tick < to_tick]
    listed = decoded if everything else decoded[:SHOWN]
    table = plain_table("tick", "t [s]", justify="right")
    table.add_column("")
    table.add_column("from")
    table.add_column("frame")
    for row in listed:
        sender = "host" if row.direction == DOWN else "robot ?"
        if isinstance(row.message, TelemetryFrame):
            sender = f"robot {row.message.slot}"
        if len(robots) > 1:
            sender = f"net{row.network} {sender}"
        tick = row.event.start_tick
        table.add_row(str(tick), f"{seconds(tick):.4f}", row.direction, sender, frame_text(row))
    yield table
    if len(listed) < len(decoded):
        yield f"{len(decoded) - len(listed)} more of {len(decoded)} frames; --all lists them"


def response_table(replayed: Sequence[Period]) -> Table:
    """How the robots reacted to a stream: there is no recording to compare with."""
    names = ("robot", "accepted", "rejected", "stale", "commands", "left [counts]", "right [counts]")
    table = plain_table(*names, justify="right")
    for index, robot in enumerate(replayed[-1].robots):
        records = [period.robots[index] for period in replayed]
        commands = sum(len(one.left.commands) + len(one.right.commands) for one in records)
        counters = [
            str(count) if count is not None else "?"
            for count in (robot.accepted, robot.rejected, robot.stale)
        ]
        positions = (str(robot.left.real_position), str(robot.right.real_position))
        table.add_row(f"{robot.slot}", *counters, str(commands), *positions)
    return table


def frame_text(row: DecodedRow) -> str:
    """The content of a frame, or of a run of damaged bytes."""
    text = described(row)
    if isinstance(row.event, Damaged):
        more = " .." if len(row.event.data) > SHOWN_BYTES else ""
        return f"{text}: {row.event.data[:SHOWN_BYTES].hex(' ')}{more}"
    if isinstance(row.message, TeamFrame):
        return f"{text}  {' '.join(f'{left:+d}/{right:+d}' for left, right in row.message.velocities)}"
    return text if row.message is not None else f"frame with {text}"
