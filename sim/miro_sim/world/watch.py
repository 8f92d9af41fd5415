"""What has to be watched for the conditions of one wait: marked addresses, pins, predicates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec

from miro_exact.clock import CYCLE_TICKS
from miro_protocol.toml_text import struct_of
from miro_sim.world.conditions import CONDITIONS, Condition, Edge, Reached, WheelSpeeds, When
from miro_sim.world.events import PC, Event
from miro_sim.world.machine import no_network

if TYPE_CHECKING:
    from miro_sim.world.machine import Machine
    from miro_sim.world.pin_watch import PinWatch

EDGES, _TRUE = 1 << 40, 1 << 41
"""Serial numbers of what is in no log: an edge adds the place of its pin, since at one tick there is one of each."""
Entry = tuple[tuple[int, int, int, int], Event]
"""An event and what it is sorted by: (tick, network, slot, serial number in its log)."""


class Watch:
    """A context: within it the robots of a machine look out for `conditions`.

    Raises ValueError for a network, slot or symbol that is not there. `conditions`: each with network and slot.
    """

    def __init__(self, world: Machine, conditions: Sequence[Condition]) -> None:
        self.world = world
        self.conditions = [
            (self._robot_id(condition), self._with_address(condition)) for condition in conditions
        ]
        self.pins: list[PinWatch] = []

    def __enter__(self) -> Watch:
        for robot_id, condition in self.conditions:
            if isinstance(condition, Reached):
                assert condition.address is not None
                device = self.world.device(*robot_id)
                device.marks = (*device.marks, condition.address)
            elif isinstance(condition, When | WheelSpeeds):
                self.world.device(*robot_id).asked.append((condition.predicate, condition.at))
        self.pick_up()
        return self

    def __exit__(self, *raised: object) -> None:
        for device in self.world.devices:
            device.marks = ()
            device.asked = []
        self._close_pins()

    def wants(self, event: Event) -> bool:
        """Whether one of the conditions is met by `event`."""
        for robot_id, condition in self.conditions:
            if (event.network, event.slot) == robot_id and condition.met_by(event):
                return True
        return False

    # Pins

    def pick_up(self) -> None:
        """Picks the pins up where the world is now."""
        self._close_pins()
        pins: dict[tuple[int, int], set[str]] = {}
        for robot_id, condition in self.conditions:
            if isinstance(condition, Edge):
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
            self.world.device(condition.network, slot)
        return condition.network, slot

    def _with_address(self, condition: Condition) -> Condition:
        """The condition with the address that its symbol has."""
        if not isinstance(condition, Reached) or condition.symbol is None:
            return condition
        image = self.world.image
        assert image is not None  # a machine with an inside
        return msgspec.structs.replace(condition, symbol=None, address=image.code_address(condition.symbol))
