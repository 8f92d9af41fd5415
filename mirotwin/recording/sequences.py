"""The events of a run in order, with ticks: LM629 commands and characters on the air."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.actions import Action, Fault, Put, RadioState, Reseed, Reset
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.lm629.commands import BY_OPCODE
from miro_sim.periods import Period

SAME_TICKS = CONTROL_PERIOD_TICKS // 2
"""Two alike that are no farther apart are one that came at another time; others came once each."""


class LogEntry(NamedTuple):
    """Something with a tick; `text` says all of it but when. `item`: the object itself."""

    tick: int
    text: str
    item: Any = None

    def __str__(self) -> str:
        return f"{self.text} at tick {self.tick}"


Pair = tuple[LogEntry | None, LogEntry | None]


def commands(periods: Sequence[Period], index: int, side: str, answers: bool) -> list[LogEntry]:
    """Complete commands to one LM629 of the robot at `index`; `answers`: with the data read back.

    Data such as a position depends on the time of reading.
    """
    logged = (command for period in periods for command in getattr(period.robots[index], side).commands)
    return [LogEntry(tick, _command(opcode, data, answers)) for tick, opcode, data in logged]


def transmissions(periods: Sequence[Period], network: int, sent: bool) -> list[LogEntry]:
    """The transmissions `on_air`."""
    return [
        LogEntry(transmission.tick, _text(transmission)) for transmission in on_air(periods, network, sent)
    ]


def characters(periods: Sequence[Period], network: int) -> list[LogEntry]:
    """Characters from its robots, one by one: the pauses between them do not matter."""
    entries = []
    for transmission in on_air(periods, network, False):
        for value, stop_good, tick in transmission.symbols():
            entries.append(LogEntry(tick, f"{value:02x}{'' if stop_good else ' with a bad stop bit'}"))
    return entries


def _command(opcode: int, data: str, answers: bool) -> str:
    known = BY_OPCODE.get(opcode)
    if known is None:
        return f"{opcode:02X}h {data}".rstrip()
    shown = "" if known.words_out and not answers else data
    return f"{known.name} {opcode:02X}h {shown}".rstrip()


def actions(periods: Sequence[Period], network: int) -> list[LogEntry]:
    """The actions on a network's robots and its radio."""
    logged = (action for period in periods for action in period.actions if action.network == network)
    return [LogEntry(action.tick, _action(action)) for action in logged]


def _action(action: Action) -> str:
    if isinstance(action, RadioState):
        return f"radio {action.state}"
    if isinstance(action, Reseed):
        return f"reseed {action.seed}"
    if isinstance(action, Put):
        return action.text
    if isinstance(action, Fault):
        return f"robot {action.slot} {action.what}"
    name, level = ("reset", action.level) if isinstance(action, Reset) else ("power", action.on)
    return f"robot {action.slot} {name} {level}"


def on_air(periods: Sequence[Period], network: int, sent: bool) -> Iterator[Transmission]:
    """Transmissions of a network: `sent` by its host, or else received by the PC from its robots."""
    for period in periods:
        for transmission in period.wire:
            if transmission.network == network and (transmission.direction == DOWN) == sent:
                yield transmission


def _text(transmission: Transmission) -> str:
    bad = f", bad stop bits at {', '.join(map(str, transmission.bad_stop))}," if transmission.bad_stop else ""
    return f"{transmission.data.hex(' ')}{bad}"


def unlike(entries: Sequence[LogEntry], others: Sequence[LogEntry], within_ticks: int) -> Iterator[Pair]:
    """The pairs that differ: entries that are alike have equal texts and are at most `within_ticks` apart."""
    for here, there in pairs(entries, others, within_ticks):
        if (
            here is None
            or there is None
            or here.text != there.text
            or abs(here.tick - there.tick) > within_ticks
        ):
            yield here, there


def pairs(
    entries: Sequence[LogEntry], others: Sequence[LogEntry], within_ticks: int, same_ticks: int = SAME_TICKS
) -> Iterator[Pair]:
    """Pairs the entries of both sides in the order of time; None if one side has no partner. Entries with equal text
    are a pair if they are at most `same_ticks` apart. After an unequal pair the comparison continues: a missing entry
    on one side does not shift the others.
    """
    first = second = 0
    while first < len(entries) and second < len(others):
        here, there = entries[first], others[second]
        apart = abs(here.tick - there.tick)
        alike = here.text == there.text and apart <= same_ticks
        if alike and apart > within_ticks:  # unless the later one is the next on the earlier side
            early = (entries, first, there) if here.tick < there.tick else (others, second, here)
            alike = not _follows(*early, within_ticks)
        if alike or apart <= within_ticks:
            yield here, there
            first, second = first + 1, second + 1
        elif here.tick < there.tick:
            yield here, None
            first += 1
        else:
            yield None, there
            second += 1
    yield from ((here, None) for here in entries[first:])
    yield from ((None, there) for there in others[second:])


def _follows(entries: Sequence[LogEntry], index: int, wanted: LogEntry, within_ticks: int) -> bool:
    """True if an entry behind `index` has the text of `wanted`, at its time."""
    for place in range(index + 1, len(entries)):
        if entries[place].tick > wanted.tick + within_ticks:
            return False
        if entries[place].text == wanted.text and entries[place].tick >= wanted.tick - within_ticks:
            return True
    return False
