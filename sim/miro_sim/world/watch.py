"""The observations needed for the conditions of one wait: marked addresses, pins, values, text, predicates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from miro_exact.clock import CYCLE_TICKS
from miro_protocol.toml_text import struct_of
from miro_sim.world.conditions import (
    CONDITIONS,
    Condition,
    Edge,
    Followed,
    OfPin,
    Reached,
    Text,
    Value,
    WheelSpeeds,
    When,
)
from miro_sim.world.events import PC, Event
from miro_sim.world.followers import Change, Follower, TextFollower
from miro_sim.world.machine import no_network

if TYPE_CHECKING:
    from miro_sim.world.changes import Changes
    from miro_sim.world.machine import Machine
    from miro_sim.world.pin_watch import PinWatch

EDGES, _TRUE, FOLLOWED = 1 << 40, 1 << 41, 1 << 42
"""Serial numbers of what is in no log: an edge adds the place of its pin, since at one tick there is one of each; what
a follower found adds its number.
"""
Entry = tuple[tuple[int, int, int, int], Event]
"""An event and what it is sorted by: (tick, network, slot, serial number in its log)."""


class Followers(NamedTuple):
    """A follower and its condition. `changes`: of the board, where it keeps those of its nets and values; None: the
    follower gets edges and characters that a wait has as events.
    """

    condition: Followed | Text
    robot_id: tuple[int, int]
    follower: Follower
    changes: Changes | None = None


class Watch:
    """A context: within it the devices of a machine look out for `conditions`.

    Raises ValueError for a network, slot, pin, value or symbol that is not there. `conditions`: each with network and
    slot. `after_tick`: of the event with which the wait before ended; `after_pins`: of waits that ended on that tick.
    """

    def __init__(
        self,
        world: Machine,
        conditions: Sequence[Condition],
        after_tick: int = -1,
        after_pins: Sequence[str] = (),
    ) -> None:
        self.world = world
        self.conditions = [
            (self._robot_id(condition), self._with_address(condition)) for condition in conditions
        ]
        self.after_tick = after_tick
        self.after_pins = after_pins
        self.pins: list[PinWatch] = []
        self.followers: list[Followers] = []
        self.tapped: list[
            tuple[int, int, str]
        ] = []  # pins of boards without nets, by the number of their follower
        self.read: list[int] = []  # by follower: the serial number of the next change

    def __enter__(self) -> Watch:
        for robot_id, condition in self.conditions:
            if isinstance(condition, Reached):
                assert condition.address is not None
                device = self.world.device(*robot_id)
                device.marks = (*device.marks, condition.address)
            elif isinstance(condition, When | WheelSpeeds):
                self.world.device(*robot_id).asked.append((condition.predicate, condition.at))
        self.pick_up()
        for robot_id, condition in self.conditions:
            if isinstance(condition, Text):
                follower: Follower = TextFollower(condition, robot_id, self.world.clock)
                self.followers.append(Followers(condition, robot_id, follower))
            elif isinstance(condition, Followed):
                self._follow(condition, robot_id)
        self.read += [0] * (len(self.followers) - len(self.read))
        return self

    def __exit__(self, *raised: object) -> None:
        for device in self.world.devices:
            device.marks = ()
            device.asked = []
        self._close_pins()

    def wants(self, event: Event) -> bool:
        """True if one of the conditions is met by `event`."""
        for robot_id, condition in self.conditions:
            if (event.network, event.slot) == robot_id and condition.met_by(event):
                return True
        return False

    # Pins of boards without nets

    def pick_up(self) -> None:
        """Picks the pins up where the world is now."""
        self._close_pins()
        pins: dict[tuple[int, int], set[str]] = {}
        for robot_id, condition in self.conditions:
            if isinstance(condition, OfPin) and changes_of(self.world, robot_id) is None:
                pins.setdefault(robot_id, set()).add(condition.pin)
        if not pins:
            return
        from miro_sim.world.pin_watch import (
            PinWatch,  # with it the robot's board, which another one does not need
        )

        self.pins = [PinWatch(robot_id, self.world.device(*robot_id), pins[robot_id]) for robot_id in pins]

    def edges(self, beyond: bool = False) -> list[Entry]:
        """The edges up to where the world is that were not taken yet.

        `beyond`: also those that the CPU has made already, in the instruction with which it went past that tick.
        """
        entries: list[Entry] = []
        for pins in self.pins:
            entries += pins.take(pins.board.cpu.cycles * CYCLE_TICKS if beyond else self.world.tick)
        return entries

    def _close_pins(self) -> None:
        for pins in self.pins:
            pins.close()
        self.pins = []

    # Followers

    def _follow(self, condition: Followed, robot_id: tuple[int, int]) -> None:
        """Begins with the level of the pin, or with the value, of now: or of the tick at which the last wait ended."""
        tick, clock = self.world.tick, self.world.clock
        changes, source = self.world.device(*robot_id).source(condition.source)
        if changes is None:
            if not isinstance(condition, Edge):  # an edge is an event as it stands
                assert isinstance(condition, OfPin)
                (level,) = (pins.shown[condition.pin] for pins in self.pins if pins.robot_id == robot_id)
                self.tapped.append((*robot_id, condition.pin))
                follower = condition.follower(len(self.tapped) - 1, 0, clock, tick, level)
                self.followers.append(Followers(condition, robot_id, follower))
            return
        if isinstance(condition, OfPin):
            place = changes.find(source)
            on_last_tick = tick - 1 == self.after_tick and condition.pin not in self.after_pins
            level, serial = changes.level_before(place.net, tick - on_last_tick)
            flip = int(place.inverted)
            follower = condition.follower(place.net, flip, clock, tick, level ^ flip)
        else:
            value, serial = changes.watch_value(source, tick), changes.values.end
            follower = condition.follower(source, 0, clock, tick, value)
        self.followers.append(Followers(condition, robot_id, follower, changes))
        self.read.append(serial)

    def matches(self, entries: Iterable[Entry]) -> list[Entry]:
        """Matches of the followers in the new `entries`, and in the entries stored by their boards."""
        if not self.followers:
            return []
        pins: list[Change] = []
        text: list[Change] = []
        serials: dict[tuple[int, Any], int] = {}
        for key, event in entries:
            if event.what == "edge":
                place = (event.network, event.slot, event.pin)
                pins += [
                    (event.tick, number, event.value)
                    for number, tap in enumerate(self.tapped)
                    if tap == place
                ]
            elif event.what == "heard":
                source = event.network, event.slot
                text.append((event.tick, source, event.value))
                serials[event.tick, source] = key[3]
        matches: list[Entry] = []
        tick = self.world.tick
        for number, (condition, robot_id, follower, changes) in enumerate(self.followers):
            new = text if isinstance(condition, Text) else pins
            if changes is not None:
                of_value = isinstance(condition, Value)
                log = changes.values if of_value else changes.edges
                new = log.since(self.read[number], tick + of_value)  # a value of this tick is known
                self.read[number] = max(self.read[number], log.first) + len(new)
            for when, measured in follower.feed(new, tick):
                serial = serials.get((when, follower.source), FOLLOWED + number)
                matches.append(((when, *robot_id, serial), _event(condition, when, robot_id, measured)))
        return matches

    def save(self) -> Any:
        """State of the followers, for `load`."""
        return list(self.read), [watch.follower.save() for watch in self.followers]

    def load(self, saved: Any) -> None:
        self.read = list(saved[0])
        for watch, state in zip(self.followers, saved[1], strict=True):
            watch.follower.load(state)

    def found(self) -> str:
        """The state that the followers observed instead of the wanted one."""
        texts = [
            f"{f'{watch.condition.source}: ' if isinstance(watch.condition, OfPin) else ''}{watch.follower.found()}"
            for watch in self.followers
        ]
        return "; ".join(dict.fromkeys(texts))

    # Predicates

    def true_now(self) -> list[Entry]:
        """Predicates that are true before anything moves."""
        tick = self.world.tick
        return [
            ((tick, network, slot, _TRUE), Event(tick=tick, what="true", network=network, slot=slot))
            for (network, slot), condition in self.conditions
            if isinstance(condition, When | WheelSpeeds)
            and condition.predicate(self.world.device(network, slot))
        ]

    # What the conditions mean

    def _robot_id(self, condition: Condition) -> tuple[int, int]:
        """Network and slot at which it happens. Raises ValueError for values that no file may give."""
        if type(condition) in CONDITIONS.values():
            struct_of(msgspec.to_builtins(condition), type(condition))
        lines = self.world.lines
        if not 0 <= condition.network < len(lines):
            raise ValueError(no_network(condition.network, len(lines)))
        slot = condition.at_slot(lines[condition.network].first_slot)
        if isinstance(condition, WheelSpeeds):
            self.world.robot(condition.network, slot)
        elif slot != PC:
            device = self.world.device(condition.network, slot)
            if isinstance(condition, OfPin):
                device.check_pin(condition.pin)
            elif isinstance(condition, Value):
                device.value(condition.of)
        return condition.network, slot

    def _with_address(self, condition: Condition) -> Condition:
        """The condition with the address that its symbol has."""
        if not isinstance(condition, Reached) or condition.symbol is None:
            return condition
        image = self.world.image
        assert image is not None  # a machine with an inside
        return msgspec.structs.replace(condition, symbol=None, address=image.code_address(condition.symbol))


def changes_of(world: Machine, robot_id: tuple[int, int]) -> Changes | None:
    """The changes of a device's nets and values; None if its board does not record any."""
    changes: Changes | None = world.device(*robot_id).changes
    return changes


def _event(condition: Followed | Text, tick: int, robot_id: tuple[int, int], measured: Any) -> Event:
    network, slot = robot_id
    event = Event(tick=tick, what=condition.what, network=network, slot=slot, measured=measured)
    if isinstance(condition, Text):
        return msgspec.structs.replace(event, data=condition.key)
    if isinstance(condition, Edge):
        return msgspec.structs.replace(event, pin=condition.source, value=measured, measured=None)
    return msgspec.structs.replace(event, pin=condition.source, value=getattr(condition, "level", 0))
