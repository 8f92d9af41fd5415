"""Describes a failed wait of a test: the awaited event, the begin of the wait, and the events meanwhile."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any, ParamSpec, TypeVar

import msgspec

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import TICKS_PER_SECOND
from miro_protocol.decoder import Decoder, Received, Scanner, TelemetryDecoder
from miro_protocol.frames import ContentError, TeamFrame, describe
from miro_sim.world.events import PC, Event
from miro_sim.world.machine import Machine
from miro_sim.world.waits import WaitExpired
from mirotwin.verify.checks.happens import expect_of
from mirotwin.verify.checks.interface import at

P = ParamSpec("P")
T = TypeVar("T")
LAST_LINES = 6
CHARACTERS = ("heard", "received", "transmitted")
NETWORK_SIZES = (3, 5)


class WaitFailed(AssertionError):
    """An awaited event did not come, or a forbidden one came.

    `expect`: the equivalent check, as in `[expect]`; None if there is none.
    """

    def __init__(
        self,
        reason: str,
        begun_tick: int,
        tick: int,
        seen: Sequence[Event],
        expect: Mapping[str, Any] | None = None,
        machine: Machine | None = None,
    ) -> None:
        self.begun_tick = begun_tick
        self.tick = tick
        self.seen = list(seen)
        self.expect = expect
        clock = TICKS_PER_SECOND if machine is None else machine.clock
        times = f"from {at(begun_tick, clock)} to {at(tick, clock)}"
        happened = "\n".join(f"  {line}" for line in in_words(seen, machine)[-LAST_LINES:]) or "  nothing"
        count = f", {amount(len(seen), 'event')}" if len(seen) > LAST_LINES else ""
        super().__init__(f"{reason}, {times}; meanwhile{count}:\n{happened}")

    @classmethod
    def of(
        cls,
        expired: WaitExpired,
        machine: Machine,
        reason: str = "",
        begun_tick: int | None = None,
        before: Sequence[Event] = (),
        judged: bool = True,
    ) -> WaitFailed:
        """Describes an expired wait of the world. `reason`: the missing event, default: the conditions themselves.

        `begun_tick`: begin of a wait that was continued several times; `before`: the events up to its last part.
        `judged`: an equivalent check exists.
        """
        begun_tick = expired.begun_tick if begun_tick is None else begun_tick
        reason = reason or f"no {' or '.join(map(str, expired.conditions))}"
        reason += f", found {expired.found}" if expired.found else ""
        why = f": {why_ended(machine)}" if machine.finished else ""
        seen = [event for event in (*before, *expired.seen) if event.tick >= begun_tick]
        seen.sort(key=lambda event: event.tick)
        expect = None
        if judged and len(expired.conditions) == 1:
            alone = not machine.networks
            expect = expect_of("happens", expired.conditions[0], begun_tick, expired.tick, alone)
        return cls(f"{reason}{why}", begun_tick, expired.tick, seen, expect, machine)


def why_ended(machine: Machine) -> str:
    """Why a machine goes no further."""
    if machine.stopped:
        fault = next(fault for device in machine.devices for fault in device.board.faults)
        return f"the run was stopped by a firmware fault: {fault}"
    return (
        f"the limit of virtual time was reached, duration_s = {machine.scenario.end_tick / machine.clock:g}"
    )


def in_words(events: Sequence[Event], machine: Machine | None = None) -> list[str]:
    """One line each; the characters of a frame are shown as the frame, other consecutive characters on one wire as one
    line.
    """
    if machine is not None and not machine.networks:  # a wire: the PC receives what a board sends
        events = [event for event in events if event.what != "transmitted"]
    keyed: list[tuple[object, Event]] = [
        (_place(event) if event.what in CHARACTERS and event.frame is None else number, event)
        for number, event in enumerate(_with_frames(events))
    ]
    return [_line([event for _, event in run], machine) for _, run in groupby(keyed, key=itemgetter(0))]


def _with_frames(events: Sequence[Event]) -> list[Event]:
    """The events with each valid frame, at its last character, in place of its characters."""
    wires: dict[tuple[str, int, int], list[int]] = {}
    for index, event in enumerate(events):
        if event.what in CHARACTERS:
            wires.setdefault(_place(event), []).append(index)
    replaced: dict[int, Event | None] = {}
    for (kind, _, _), wire in wires.items():
        decoders: list[Scanner] = [Decoder(3), Decoder(5)] if kind == "received" else [TelemetryDecoder()]
        for decoder in decoders:
            start = 0
            symbols = [(each.value, each.good_stop, each.tick) for each in map(events.__getitem__, wire)]
            for decoded in [*decoder.feed_symbols(symbols), *decoder.flush()]:
                characters = wire[start : start + len(decoded.data)]
                start += len(decoded.data)
                if isinstance(decoded, Received):
                    replaced.update(dict.fromkeys(characters))
                    last = characters[-1]
                    replaced[last] = msgspec.structs.replace(events[last], frame=decoded)
    all_ = (replaced.get(index, event) for index, event in enumerate(events))
    return [each for each in all_ if each is not None]


def _frame_text(event: Event) -> str:
    """`received team seq=3 ..` for the last event of a frame."""
    frame = event.frame
    assert frame is not None
    for robots in NETWORK_SIZES:
        try:
            message = frame.message(robots)
        except ContentError:
            continue
        pairs = message.velocities if isinstance(message, TeamFrame) else ()
        speeds = "".join(f" {slot}: {left:+d}/{right:+d}" for slot, (left, right) in enumerate(pairs))
        return f"{event.what} {describe(message)}{speeds}"
    return f"{event.what} a frame of unknown content, seq={frame.seq}"


def _sent_text(event: Event) -> str:
    """`team seq=3 ..`, or the characters."""
    for decoder in (Decoder(3), Decoder(5)):
        for decoded in decoder.feed(event.data, event.tick):
            if isinstance(decoded, Received) and event.good_stop:
                return _frame_text(msgspec.structs.replace(event, frame=decoded)).partition(" ")[2]
    return event.data.hex(" ").upper()


def _place(event: Event) -> tuple[str, int, int]:
    return (event.what, event.network, event.slot)


def _line(run: Sequence[Event], machine: Machine | None) -> str:
    first, when = run[0], "tick"
    _, where, text = f"{first}".split(": ", 2)
    clock = TICKS_PER_SECOND if machine is None else machine.clock
    if machine is not None and not machine.networks:
        where = "PC" if first.slot == PC else "board"
    if first.frame is not None:
        text = _frame_text(first)
    elif first.what == "sent":
        text += f": {_sent_text(first)}"
    elif len(run) > 1:
        values = " ".join(f"{character.value:02X}{'' if character.good_stop else '!'}" for character in run)
        text, when = f"{first.what} {values}", "from tick"
    return f"{first.tick * 1000 / clock:10.3f} ms {where}: {text} ({when} {first.tick})"


def shown_where_it_was_called(function: Callable[P, T]) -> Callable[P, T]:
    """Decorator for methods of fixtures: an exception for a test is shown at the test's own line."""

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        __tracebackhide__ = True
        try:
            return function(*args, **kwargs)
        except (WaitFailed, BadInput, ValueError) as error:
            raise error.with_traceback(None) from None

    return wrapped
