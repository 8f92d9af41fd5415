"""Lines and tables of `replay` and `diff`."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import NamedTuple

from rich.table import Table

from miro_exact.bad_input import amount
from miro_exact.clock import seconds, ticks
from miro_protocol.events import Damaged, Reason
from miro_protocol.frames import TeamFrame, TelemetryFrame
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.periods import Period
from mirotwin.recording.capture.recorded import transmissions_of
from mirotwin.recording.capture.render import SHOWN_BYTES, described
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.difference import first_per_channel, moment, shown
from mirotwin.replay.difference import RunDifference
from mirotwin.replay.lockstep.firmwares import FirmwareDifference
from mirotwin.replay.lockstep.instructions import InstructionDifference
from mirotwin.replay.lockstep.variables import VariableDifference
from mirotwin.report.page.link import STOPS, LinkMark
from mirotwin.runs.job import Job
from mirotwin.runs.made_from import SourceDifference
from mirotwin.shell.console import plain_table

LISTED = 5
"""Variables and registers that are named in a line."""
Names = tuple[str, str]


def difference_lines(difference: RunDifference, subject: str) -> Iterator[str]:
    """Lines about the first difference of `subject`, and the results of repeating both runs, without the notes."""
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
FATES = {"fresh": "fresh", "repeated": "stale", "damaged": "damaged", "lost": "lost", "open": "under way"}
"""The result of a frame at a robot, by the kind of its mark."""
IGNORED = "ignored"


class Line(NamedTuple):
    """A line of the list of frames. `fate`: of a frame from a host, at the robots; `special`: it is always listed."""

    tick: int
    direction: str
    sender: str
    text: str
    fate: str
    special: bool


class Fates:
    """The result of each of the hosts' frames in `sent` at each robot, from the marks of the air up to `to_tick` (None:
    all).
    """

    def __init__(
        self,
        sent: Sequence[Transmission],
        marks: Sequence[LinkMark],
        delays: Sequence[int],
        to_tick: int | None,
    ) -> None:
        self._kinds: dict[tuple[int, int], dict[int, str]] = {}
        self._ticks: dict[int, list[int]] = {}
        for transmission in sent:
            self._ticks.setdefault(transmission.network, []).append(transmission.tick)
        for mark in marks:
            if mark.robot is not None and mark.kind in FATES:
                network, slot = mark.robot
                kinds = self._kinds.setdefault((network, mark.start_tick - delays[network]), {})
                over = to_tick is None or mark.end_tick <= to_tick
                kinds[slot] = FATES[mark.kind if over else "open"]

    def of(self, row: DecodedRow) -> str:
        """In a word, or robot by robot where it is not the same for all."""
        if isinstance(row.event, Damaged):
            return IGNORED if row.event.reason in (Reason.NO_SYNC, Reason.CUT_SHORT) else "damaged"
        begins = self._ticks[row.network]
        tick = begins[bisect_right(begins, row.event.start_tick) - 1]
        by_robot = self._kinds.get((row.network, tick), {})
        words = set(by_robot.values())
        if len(words) > 1:
            return ", ".join(f"{word} at {slot}" for slot, word in by_robot.items())
        return words.pop() if words else ""


def stop_lines(marks: Sequence[LinkMark], several: bool) -> list[Line]:
    """Lines about stops by the failsafe; robots stopped in the same way share a line."""
    alike: dict[tuple[int, int, str], list[str]] = {}
    for mark in marks:
        if mark.robot is not None and mark.kind in STOPS:
            network, slot = mark.robot
            alike.setdefault((mark.start_tick, network, f"failsafe: {mark.text}"), []).append(f"{slot}")
    return [
        Line(
            tick,
            "",
            f"{f'net{network} ' if several else ''}robot{'s' * (len(robots) > 1)} {', '.join(robots)}",
            text,
            "",
            True,
        )
        for (tick, network, text), robots in alike.items()
    ]


def frame_tables(
    job: Job, replayed: Sequence[Period], everything: bool, to_tick: int | None, marks: Sequence[LinkMark]
) -> Iterator[Table | str]:
    """The recorded frames up to `to_tick` (None: all); for a stream the sent frames. `marks`: of the air, with the
    results of the frames and the stops by the failsafe.
    """
    networks = job.spec.robot_scenario.networks
    sent = transmissions_of(job.recorded or replayed)
    delays = [ticks(network.radio.latency_s) for network in networks]
    fates = Fates(
        [transmission for transmission in sent if transmission.direction == DOWN], marks, delays, to_tick
    )
    several = len(networks) > 1
    frames = []
    for row in rows(sent, lambda network: networks[network].robots):
        sender = "host" if row.direction == DOWN else "robot ?"
        if isinstance(row.message, TelemetryFrame):
            sender = f"robot {row.message.slot}"
        fate = fates.of(row) if row.direction == DOWN else ""
        special = fate not in ("", "fresh")
        place = f"net{row.network} {sender}" if several else sender
        frames.append(Line(row.event.start_tick, row.direction, place, frame_text(row), fate, special))
    frames = sorted(_before(frames, to_tick), key=attrgetter("tick"))
    stops = _before(stop_lines(marks, several), to_tick)
    listed = frames if everything else _listed(frames)
    table = plain_table("tick", "t [s]", justify="right")
    for name in ("", "from", "frame", "at the robots"):
        table.add_column(name)
    for line in sorted([*listed, *(stops if everything else stops[:SHOWN])], key=attrgetter("tick")):
        table.add_row(f"{line.tick}", f"{seconds(line.tick):.4f}", *line[1:5])
    yield table
    if len(listed) < len(frames):
        yield f"{len(frames) - len(listed)} more of {len(frames)} frames; --all lists them"
    counts = Counter(line.fate for line in frames if line.fate)
    if counts:
        yield f"from the host: {', '.join(f'{count} {fate}' for fate, count in counts.most_common())}"
    if stops:
        yield f"the failsafe acted {amount(len(stops), 'time')}, first at {seconds(stops[0].tick):.4f} s"


def _before(lines: Sequence[Line], to_tick: int | None) -> list[Line]:
    return [line for line in lines if to_tick is None or line.tick < to_tick]


def _listed(frames: Sequence[Line]) -> list[Line]:
    """The first frames that are not fresh, and other frames up to the limit, in the order of time."""
    special = [line for line in frames if line.special][:SHOWN]
    usual = [line for line in frames if not line.special][: SHOWN - len(special)]
    return sorted([*special, *usual], key=attrgetter("tick"))


def response_table(replayed: Sequence[Period]) -> Table:
    """The robots' reactions to a stream, for which there is no recording to compare with."""
    names = (
        "robot",
        "accepted",
        "rejected",
        "stale",
        "commands",
        "left [counts]",
        "right [counts]",
        "moved [cm]",
    )
    table = plain_table(*names, justify="right")
    for index, robot in enumerate(replayed[-1].robots):
        records = [period.robots[index] for period in replayed]
        commands = sum(len(record.left.commands) + len(record.right.commands) for record in records)
        counters = [
            str(count) if count is not None else "?"
            for count in (robot.accepted, robot.rejected, robot.stale)
        ]
        positions = (str(robot.left.real_position), str(robot.right.real_position))
        begin, end = records[0].truth, robot.truth
        moved_cm = 100.0 * math.hypot(end.x_m - begin.x_m, end.y_m - begin.y_m)
        table.add_row(f"{robot.slot}", *counters, str(commands), *positions, f"{moved_cm:.2f}")
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
