"""A wait of a test that failed, in words: what was awaited, since when, and what happened meanwhile.

What belongs here: the error, and how events read. What does not: waiting (`miro_sim.world.waits`).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

from miro_exact.bad_input import BadInput
from miro_sim.world.events import Event
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from mirotwin.cases.waits import expect_of_wait

P = ParamSpec("P")
T = TypeVar("T")
LAST_EVENTS = 6


class WaitFailed(AssertionError):
    """What a test waited for did not come, or what should not come did. `expect`: the check that says the same, as in
    `[expect]`; None where no check can.
    """

    def __init__(
        self,
        what: str,
        begun_tick: int,
        tick: int,
        seen: Sequence[Event],
        expect: Mapping[str, Any] | None = None,
    ) -> None:
        self.begun_tick = begun_tick
        self.tick = tick
        self.seen = list(seen)
        self.expect = expect
        times = f"from {at(begun_tick)} to {at(tick)}"
        happened = "\n".join(f"  {one}" for one in in_words(seen[-LAST_EVENTS:])) or "  nothing"
        count = f", {len(seen)} events" if len(seen) > LAST_EVENTS else ""
        super().__init__(f"{what}, {times}; meanwhile{count}:\n{happened}")

    @classmethod
    def of(cls, expired: WaitExpired, world: World) -> WaitFailed:
        """In words, a wait of the world that a test has not caught."""
        wanted = " or ".join(map(str, expired.conditions))
        seen = [event for event in expired.seen if event.tick >= expired.begun_tick]
        why = f": {why_ended(world)}" if world.finished else ""
        expect = expect_of_wait(expired, expired.begun_tick)
        return cls(f"no {wanted}{why}", expired.begun_tick, expired.tick, seen, expect)


def why_ended(world: World) -> str:
    """Why a world goes no further."""
    if world.stopped:
        return f"the run was stopped by a firmware fault: {world.faults[0]}"
    return f"the limit of virtual time was reached, duration_s = {world.scenario.duration_s:g}"


def at(tick: int) -> str:
    """A tick for people."""
    return f"tick {tick} ({tick / 24_000:.3f} ms)"


def in_words(events: Sequence[Event]) -> list[str]:
    """One line each; characters that follow each other on one wire are one."""
    lines: list[str] = []
    run: list[Event] = []
    for event in [*events, None]:
        if run and (event is None or _place(event) != _place(run[0])):
            lines.append(_line(run))
            run = []
        if event is not None:
            run.append(event)
            if event.what not in ("heard", "received", "transmitted"):
                lines.append(_line(run))
                run = []
    return lines


def _place(event: Event) -> tuple[str, int, int]:
    return (event.what, event.network, event.slot)


def _line(run: Sequence[Event]) -> str:
    first = run[0]
    time = f"{first.tick / 24_000:10.3f} ms "
    if len(run) == 1:
        return time + str(first).partition(": ")[2] + f" (tick {first.tick})"
    values = " ".join(f"{one.value:02X}{'' if one.good_stop else '!'}" for one in run)
    return time + f"{str(first).split(': ')[1]}: {first.what} {values} (from tick {first.tick})"


def shown_where_it_was_called(function: Callable[P, T]) -> Callable[P, T]:
    """For the methods of fixtures: what they raise for a test is shown at the test's own line."""

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        __tracebackhide__ = True
        try:
            return function(*args, **kwargs)
        except (WaitFailed, BadInput, ValueError) as error:
            raise error.with_traceback(None) from None

    return wrapped
