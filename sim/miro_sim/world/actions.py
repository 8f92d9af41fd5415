"""What somebody does to the robots and the radio of a network at a tick: reset pins, supplies, radio on and off.

An action takes effect before anything else happens at its tick. The radio is settled a little ahead of the robots, so
its band down changes `SETTLE_TICKS` earlier than the rest, for the same tick: RADIO_DOWN and RADIO_UP are two entries.
What waits is saved, but no part of the digest: a run does not depend on when an action was announced.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from miro_exact.clock import NEVER_TICK
from miro_exact.state import Rows
from miro_protocol.actions import Action, Power, RadioState, Reset
from miro_sim.radio.params import LINK_STATES
from miro_sim.world.events import PC, Event

if TYPE_CHECKING:
    from miro_sim.world.medium import Medium

SETTLE_TICKS = 120
"""How far beyond a robot's stop the line must be known: an instruction may overrun by four machine cycles."""
RESET, POWER, RADIO_DOWN, RADIO_UP = range(4)
_EVENTS = {RESET: "reset", POWER: "power", RADIO_UP: "radio"}
_MOST_WAITING = 1 << 16


class WaitingAction(NamedTuple):
    """An action that waits for `tick`. `slot`: 0 for the radio's; `value`: a level, or the number of a link's state."""

    tick: int
    what: int
    slot: int
    value: int


class Actions:
    """The actions of one line. `done`: those of the control period that is under way, a record."""

    STATE = {
        "waiting": Rows(
            *(
                _MOST_WAITING,
                ("q", -SETTLE_TICKS, NEVER_TICK),
                ("B", RESET, RADIO_UP),
                ("B", 0, 255),
                ("B", 0, 2),
            ),
            split=tuple,
            make=lambda cells: WaitingAction(*cells),
            ordered=True,
        )
    }
    NOT_STATE = ("network", "done")

    def __init__(self, network: int) -> None:
        self.network = network
        self.waiting: list[WaitingAction] = []
        self.done: list[Action] = []

    @property
    def next_tick(self) -> int:
        """When the next one is due."""
        return self.waiting[0].tick if self.waiting else NEVER_TICK

    def next_after(self, tick: int) -> int:
        """When the next one is due that is not due at `tick`."""
        for action in self.waiting:
            if action.tick > tick:
                return action.tick
        return NEVER_TICK

    def announce(self, action: Action) -> None:
        """Behind the actions of the same tick that were announced before."""
        if len(self.waiting) + 2 > _MOST_WAITING:
            raise ValueError(f"net{self.network}: {len(self.waiting)} actions wait; at most {_MOST_WAITING}")
        if isinstance(action, RadioState):
            value = LINK_STATES.index(action.state)
            self.waiting.append(WaitingAction(action.tick - SETTLE_TICKS, RADIO_DOWN, 0, value))
            self.waiting.append(WaitingAction(action.tick, RADIO_UP, 0, value))
        elif isinstance(action, Reset):
            self.waiting.append(WaitingAction(action.tick, RESET, action.slot, action.level))
        else:
            self.waiting.append(WaitingAction(action.tick, POWER, action.slot, action.on))
        self.waiting.sort(key=lambda waiting: waiting.tick)

    def do_due(self, medium: Medium, tick: int) -> None:
        """Does what is due at `tick`, and notes what robots and PC can notice."""
        while self.waiting and self.waiting[0].tick <= tick:
            action = self.waiting.pop(0)
            if action.what == RADIO_DOWN:
                medium.set_radio(action.value, up=False)
                continue
            slot = PC if action.what == RADIO_UP else action.slot
            self.done.append(self._do(medium, action))
            event = Event(
                tick=action.tick,
                what=_EVENTS[action.what],
                network=self.network,
                slot=slot,
                value=action.value,
            )
            medium.log.note(event)

    def _do(self, medium: Medium, action: WaitingAction) -> Action:
        if action.what == RADIO_UP:
            medium.set_radio(action.value, up=True)
            return RadioState(action.tick, self.network, LINK_STATES[action.value])
        board = medium.device(action.slot).board
        if action.what == RESET:
            board.set_reset(action.value)
            return Reset(action.tick, self.network, action.slot, action.value)
        board.set_power(action.value)
        return Power(action.tick, self.network, action.slot, action.value)

    def check(self, slots: Sequence[int]) -> None:
        """Raises ValueError for a robot that is not in `slots`, and a level other than 0 and 1."""
        for action in self.waiting:
            if action.what in (RESET, POWER) and (action.slot not in slots or action.value > 1):
                raise ValueError(
                    f"an action waits for slot {action.slot} with level {action.value}, at tick {action.tick}"
                )

    def take(self) -> tuple[Action, ...]:
        """The actions of the period that is over."""
        taken, self.done = tuple(self.done), []
        return taken

    def __repr__(self) -> str:
        return f"Actions(net{self.network}, {self.waiting})"
