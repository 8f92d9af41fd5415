"""Actions on the devices and the radio of a line at a tick: reset pins, supplies, radio on and off, the values of a
board's parts, and hardware faults.

An action takes effect before anything else happens at its tick. The radio is settled a little ahead of the robots, so
its band down changes `SETTLE_TICKS` earlier than the rest, for the same tick: RADIO_DOWN and RADIO_UP are two entries,
and so are RESEED_DOWN and RESEED_UP, and RXD and FAULT. Streams of random numbers have no state: a load reseeds them
again.
What waits is saved, but no part of the digest: a run does not depend on when an action was announced.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from miro_exact.clock import NEVER_TICK
from miro_exact.state import Rows
from miro_protocol.actions import (
    PUT_BYTES,
    Action,
    Fault,
    Power,
    Put,
    RadioState,
    Reseed,
    Reset,
    fault_text,
    put_of,
)
from miro_sim.radio.params import LINK_STATES, RXD_STATES
from miro_sim.world.events import PC, Event

if TYPE_CHECKING:
    from miro_sim.world.device import Device
    from miro_sim.world.medium import Medium

SETTLE_TICKS = 120
"""The line must be known this far beyond a robot's stop, in ticks: an instruction may overrun by four machine
cycles.
"""
RESET, POWER, RADIO_DOWN, RADIO_UP, PUT, RESEED_DOWN, RESEED_UP, RXD, FAULT = range(9)
_EVENTS = {
    RESET: "reset", POWER: "power", RADIO_UP: "radio", PUT: "put", RESEED_UP: "reseed", FAULT: "hardware",
}  # fmt: skip
_LIMITS = {RADIO_DOWN: len(LINK_STATES) - 1, RADIO_UP: len(LINK_STATES) - 1, RXD: len(RXD_STATES) - 1}
DIP = b"power dip"
"""A fault that restarts everything, and is logged as a power dip for checks; the supply returns."""
_MOST_WAITING = 1 << 16


class WaitingAction(NamedTuple):
    """An action that waits for `tick`. `slot`: 0 for the radio's; `value`: a level, or the number of a link's state.

    `text`: of a put, `PART.KEY = VALUE` in UTF-8; the digits of a new seed; the words of a fault.
    """

    tick: int
    what: int
    slot: int
    value: int
    text: bytes = b""


_ROWS = Rows(
    *(
        _MOST_WAITING,
        ("q", -SETTLE_TICKS, NEVER_TICK),
        ("B", RESET, FAULT),
        ("B", 0, 255),
        ("B", 0, len(RXD_STATES) - 1),
        ("s", PUT_BYTES),
    ),
    split=tuple,
    make=lambda cells: WaitingAction(*cells),
    ordered=True,
)


class Actions:
    """The actions of one line. `done`: those of the control period that is under way, a record.

    `reseeds`: those that were done; `drawn`: those whose seeds the streams have, which a load may leave behind.
    """

    STATE = {"waiting": _ROWS, "reseeds": _ROWS}
    NOT_STATE = ("network", "done", "drawn")

    def __init__(self, network: int) -> None:
        self.network = network
        self.waiting: list[WaitingAction] = []
        self.reseeds: list[WaitingAction] = []
        self.drawn: list[WaitingAction] = []
        self.done: list[Action] = []

    @property
    def next_tick(self) -> int:
        """Tick of the next action."""
        return self.waiting[0].tick if self.waiting else NEVER_TICK

    def next_after(self, tick: int) -> int:
        """Tick of the next action that is not due at `tick`."""
        for action in self.waiting:
            if action.tick > tick:
                return action.tick
        return NEVER_TICK

    def announce(self, action: Action) -> None:
        """Behind the actions of the same tick that were announced before."""
        waiting = len(self.waiting) + len(self.reseeds)  # each reseed that waits is kept when it is done
        if waiting + 2 > _MOST_WAITING:
            raise ValueError(f"net{self.network}: {waiting} actions wait; at most {_MOST_WAITING}")
        if isinstance(action, RadioState):
            value = LINK_STATES.index(action.state)
            self.waiting.append(WaitingAction(action.tick - SETTLE_TICKS, RADIO_DOWN, 0, value))
            self.waiting.append(WaitingAction(action.tick, RADIO_UP, 0, value))
        elif isinstance(action, Reseed):
            text = str(action.seed).encode()
            self.waiting.append(WaitingAction(action.tick - SETTLE_TICKS, RESEED_DOWN, 0, 0, text))
            self.waiting.append(WaitingAction(action.tick, RESEED_UP, 0, 0, text))
        elif isinstance(action, Put):
            self.waiting.append(WaitingAction(action.tick, PUT, action.slot, 0, action.text.encode()))
        elif isinstance(action, Fault):
            words = fault_text(action.what)
            if words.startswith("rxd "):
                value = RXD_STATES.index(words[4:])
                self.waiting.append(WaitingAction(action.tick - SETTLE_TICKS, RXD, action.slot, value))
            self.waiting.append(WaitingAction(action.tick, FAULT, action.slot, 0, words.encode()))
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
            if action.what == RXD:
                medium.set_rxd(action.slot, action.value)
                continue
            if action.what in (RESEED_DOWN, RESEED_UP):
                self._reseed(medium, action)
                self.reseeds.append(action)
                self.drawn = list(self.reseeds)
            if action.what == RESEED_DOWN:
                continue
            slot = PC if action.what in (RADIO_UP, RESEED_UP) else action.slot
            self.done.append(self._do(medium, action))
            event = Event(
                tick=action.tick,
                what="power" if action.text == DIP else _EVENTS[action.what],
                network=self.network,
                slot=slot,
                value=1 if action.text == DIP else action.value,
                data=action.text,
            )
            medium.log.note(event)

    def _do(self, medium: Medium, action: WaitingAction) -> Action:
        done = self._action(action)
        if isinstance(done, RadioState):
            medium.set_radio(action.value, up=True)
        elif not isinstance(done, Reseed):
            device = medium.device(action.slot)
            if isinstance(done, Put):
                device.put(done.path, done.value, action.tick)
            elif isinstance(done, Fault):
                device.break_hardware(done.what)
            elif isinstance(done, Reset):
                device.board.set_reset(action.value)
            else:
                device.board.set_power(action.value)
        return done

    def announced(self) -> list[Action]:
        """Actions that wait."""
        return [self._action(waiting) for waiting in self.waiting if waiting.what in _EVENTS]

    def _action(self, action: WaitingAction) -> Action:
        if action.what == RADIO_UP:
            return RadioState(action.tick, self.network, LINK_STATES[action.value])
        if action.what == RESEED_UP:
            return Reseed(action.tick, self.network, int(action.text))
        if action.what == PUT:
            return self._put(action)
        if action.what == FAULT:
            return Fault(action.tick, self.network, action.slot, action.text.decode())
        kind = Reset if action.what == RESET else Power
        return kind(action.tick, self.network, action.slot, action.value)

    def _put(self, action: WaitingAction) -> Put:
        return put_of(action.tick, self.network, action.slot, action.text.decode())

    def _reseed(self, medium: Medium, action: WaitingAction) -> None:
        up = action.what == RESEED_UP
        medium.reseed(int(action.text), action.tick if up else action.tick + SETTLE_TICKS, up)

    def draw_again(self, medium: Medium, seed: int) -> None:
        """After a load: gives the streams the seeds that they had. `seed`: the world's own."""
        if self.drawn == self.reseeds:
            return
        for up in (False, True):
            medium.reseed(seed, 0, up)
        for action in self.reseeds:
            self._reseed(medium, action)
        self.drawn = list(self.reseeds)

    def check(self, devices: Sequence[Device]) -> None:
        """Raises ValueError for a device that is not there, a level other than 0 and 1, and what no part takes."""
        slots = [device.slot for device in devices]
        for action in self.waiting:
            if action.what == PUT and action.slot in slots:
                put = self._put(action)
                devices[slots.index(action.slot)].check_put(put.path, put.value)
                continue
            if action.what == FAULT and action.slot in slots:
                devices[slots.index(action.slot)].check_fault(action.text.decode())
                continue
            of_device = action.what in (RESET, POWER, PUT, RXD, FAULT)
            if (of_device and action.slot not in slots) or action.value > _LIMITS.get(action.what, 1):
                raise ValueError(
                    f"an action waits for slot {action.slot} with level {action.value}, at tick {action.tick}"
                )

    def take(self) -> tuple[Action, ...]:
        """The actions of the period that is over."""
        taken, self.done = tuple(self.done), []
        return taken

    def __repr__(self) -> str:
        return f"Actions(net{self.network}, {self.waiting})"
