"""Waiting in virtual time: moves a world to the first tick at which a condition is true.

The world runs in pieces that end before the control period does. If the condition came true inside one, the world
goes back to the piece's begin and runs again to the tick of the event: a run gives the same bits however it is cut, so
nothing is lost and nothing is changed. Events after that tick are left to the next wait.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from typing import Any

import msgspec

from miro_exact.clock import NEVER_TICK
from miro_exact.state import Flat
from miro_protocol.decoder import Decoder, Received
from miro_robot.inspect.watcher import Inspector
from miro_sim.world.conditions import Condition
from miro_sim.world.events import PC, Cursor, Event
from miro_sim.world.machine import Machine, require
from miro_sim.world.watch import FOLLOWED, Entry, Watch

Before = tuple[int, list[int], list[bytes], Any, Any]
FIRST_PIECE_TICKS = 24_000
"""1 ms. Pieces double up to the end of the control period: most waits are short, and a piece costs a snapshot."""
SEEN_AT_MOST = 1000


class WaitExpired(TimeoutError):
    """The wait that began at `begun_tick` ran out. `seen`: the last events meanwhile, at most 1000; `found`: what pins,
    values and text were instead, in words.
    """

    def __init__(
        self,
        conditions: Sequence[Condition],
        begun_tick: int,
        tick: int,
        why: str,
        seen: Sequence[Event],
        state: str = "",
    ) -> None:
        self.conditions = tuple(conditions)
        self.begun_tick = begun_tick
        self.tick = tick
        self.seen = list(seen)
        self.found = state
        wanted = " or ".join(map(str, conditions))
        last = (
            f"; the last of {len(self.seen)} events: {self.seen[-1]}" if self.seen else "; nothing happened"
        )
        super().__init__(f"tick {tick}: {why} without {wanted}{last}")


class Waits:
    """The waits of one machine, and what happened since the last one ended.

    `backlog`: events that no wait has consumed. `cursors`: by network and slot, on its log.
    `reached`: the number of the instruction at which a wait ended before it was executed.
    """

    def __init__(self, world: Machine) -> None:
        self.world = world
        self.forget()

    def forget(self) -> None:
        """The world was put somewhere else: nothing that happened before counts."""
        self.backlog: list[Entry] = []
        self.cursors: dict[tuple[int, int], Cursor] = {}
        self.reached: dict[tuple[int, int], int] = {}
        self.decoders: dict[tuple[int, int], Decoder] = {}  # made by the first wait
        self.states: list[Flat] = []
        self.ended_tick = -1  # of the event with which the last wait ended
        self.ended_pins: list[str] = []  # of the waits that ended there
        for index, line in enumerate(self.world.lines):
            self.cursors[index, PC] = Cursor(line.log)
            for device in line.devices:
                self.cursors[index, device.slot] = Cursor(device.log)

    def collect(self) -> None:
        """Copies new log entries before the ring overwrites them. Call it after moving the world without a wait."""
        self._gather(Watch(self.world, ()))

    def pass_over(self) -> None:
        """Drops collected events before the present tick, so that the next wait does not see them."""
        self.backlog = [entry for entry in self.backlog if entry[0][0] >= self.world.tick]
        self.ended_tick = -1

    def until(self, conditions: Sequence[Condition], within: int | None) -> Event:
        """See `World.run_until`. Raises NotObservable for what the machine does not show."""
        world = self.world
        for condition in conditions:
            require(world, condition, condition.needs)
        if within is not None and not isinstance(within, int):
            raise ValueError(f"{within!r} is no whole number of ticks; mirotwin.ms(40) gives one")
        if within is not None and within < 0:
            raise ValueError(f"within {within}: give a number of ticks that is not negative")
        begun_tick = world.tick
        deadline = NEVER_TICK if within is None else world.tick + within
        events: list[Event] = []
        with Watch(world, conditions, self.ended_tick, self.ended_pins) as watch:
            self.backlog += watch.true_now()
            self.backlog.sort(key=itemgetter(0))
            # Followers go forward in time: what is left of earlier waits before what `_gather` reads now.
            self.backlog += watch.matches(self.backlog)
            self._gather(watch)
            # Before anything runs: an event that is waiting already ends the wait where the world stands.
            event = self._consume(watch, world.tick, events)
            piece = FIRST_PIECE_TICKS
            while event is None:
                if world.finished or world.tick >= deadline:
                    why = "the run ended" if world.finished else f"{within} ticks passed"
                    self._forget_followed()
                    raise WaitExpired(conditions, begun_tick, world.tick, why, events, watch.found())
                self._run_piece(watch, min(deadline, world.tick + piece))
                # Here, because a world saved with its period open at the period's end is refused by `load`.
                if world.in_period and (world.tick == world.period_end or world.stopped):
                    world.end_period()
                event = self._consume(watch, world.tick, events)
                piece *= 2
            # The CPU ran past the tick: its edges there would be lost when the watch on the pins closes.
            self.backlog += watch.edges(beyond=True)
            self._forget_followed()
        if event.tick != self.ended_tick:
            self.ended_tick, self.ended_pins = event.tick, []
        # A second wait for this pin at this tick must not end with the same edge.
        self.ended_pins.append(event.pin)
        return event

    def _forget_followed(self) -> None:
        """Drops matches that followers found beyond the end of a wait: the next wait's followers find them again."""
        self.backlog = [entry for entry in self.backlog if entry[0][3] < FOLLOWED and entry[1].what != "text"]

    def _run_piece(self, watch: Watch, until_tick: int) -> None:
        """Runs to `until_tick`, the end of the control period, or the first event that is wanted."""
        world = self.world
        # Before the mark: going back would undo the camera's exposure, and `run_piece` does not repeat it.
        world.begin_period()
        until_tick = world.rendezvous(until_tick)
        read = [cursor.next for cursor in self.cursors.values()]
        states = [state.save() for state in self.states]
        before = len(self.backlog), read, states, watch.save(), world.mark()
        inspectors = self._inspectors()
        for inspector in inspectors:
            # The piece may run several times, and these must see each instruction once: in its last run.
            inspector.pause()
        try:
            end_tick, reached = self._end_of_piece(watch, before, until_tick)
        finally:  # a part may raise
            for inspector in inspectors:
                inspector.resume()
        if inspectors:
            self._again_to(watch, before, end_tick)
        # Only now: `_again_to` has cut the backlog.
        self.backlog += reached

    def _end_of_piece(self, watch: Watch, before: Before, until_tick: int) -> tuple[int, list[Entry]]:
        """Runs to the end of the piece, which is returned, with the event that the logs will not show."""
        begun_tick = self.world.tick
        self.world.run_piece(until_tick)
        self._gather(watch)
        wanted = [entry for entry in self.backlog if watch.wants(entry[1])]
        if not wanted:
            return until_tick, []
        first, event = min(wanted, key=itemgetter(0))
        # The last instruction ran past the piece: the event is found when the world has come to its tick.
        if first[0] >= until_tick:
            return until_tick, []
        tick = max(first[0], begun_tick)
        self._again_to(watch, before, tick)
        # A run to tick t executes only cycles that begin before t: an event of a cycle that begins at t needs t + 1.
        if any(key == first for key, _ in self.backlog):
            return tick, []
        if event.what == "reached":  # the CPU stands before it and has not looked at it again
            return tick, [(first, event)]
        self._again_to(watch, before, tick + 1)  # it happens with the cycle that begins there
        return tick + 1, []

    def _inspectors(self) -> list[Inspector]:
        """Inspectors with watchers that must see each instruction exactly once."""
        inspectors = [device.board.cpu.inspector for line in self.world.lines for device in line.devices]
        return [inspector for inspector in inspectors if isinstance(inspector, Inspector) and inspector.once]

    def _again_to(self, watch: Watch, before: Before, tick: int) -> None:
        """Goes back and runs the piece again, to `tick`."""
        count, read, states, followers, mark = before
        self.world.go_back(mark)
        del self.backlog[count:]
        for cursor, serial in zip(self.cursors.values(), read, strict=True):
            cursor.next = serial
        for state, saved in zip(self.states, states, strict=True):
            state.load(saved)
        watch.load(followers)
        # After the load: the pins' first levels are those that they have there.
        watch.pick_up()
        self.world.run_piece(tick)
        self._gather(watch)

    def _consume(self, watch: Watch, until_tick: int, events: list[Event]) -> Event | None:
        """Takes events out of the backlog, in order, up to `until_tick` or the first that is wanted."""
        # By key alone and stable: events cannot be compared, and a frame stays behind its last character.
        self.backlog.sort(key=lambda entry: entry[0])
        wanted = None
        count = 0
        for key, event in self.backlog:
            # Seen already, because a CPU ran ahead; left for a wait that comes to it.
            if key[0] > until_tick:
                break
            count += 1
            if event.what == "reached":
                # The CPU still stands before it: going on notes it a second time.
                self.reached[event.network, event.slot] = event.value
            if watch.wants(event):
                wanted = event
                break
            events.append(event)
        del self.backlog[:count]
        del events[:-SEEN_AT_MOST]
        return wanted

    # What happened

    def _gather(self, watch: Watch) -> None:
        """Reads what is new in all logs; a frame is an event right after its last character."""
        if not self.decoders:
            for index, line in enumerate(self.world.lines):
                for device in line.devices if line.log.robots else ():
                    self.decoders[index, device.slot] = Decoder(line.log.robots)
            self.states = [Flat(decoder) for decoder in self.decoders.values()]
        new: list[Entry] = []
        for source, cursor in self.cursors.items():
            for serial, event in cursor.read():
                if event.what == "reached" and self.reached.get(source) == event.value:
                    continue  # a wait has ended before this instruction already
                # Tick, then network and slot: without them two robots' events of one tick come in any order.
                key = (event.tick, *source, serial)
                new.append((key, event))
                if event.what != "received" or source not in self.decoders:
                    continue
                symbol = (event.value, event.good_stop, event.tick)
                for result in self.decoders[source].feed_symbols([symbol]):
                    if isinstance(result, Received):
                        frame = msgspec.structs.replace(event, what="frame", value=0, frame=result)
                        new.append((key, frame))
        new += watch.edges()
        self.backlog += new
        self.backlog += watch.matches(new)
