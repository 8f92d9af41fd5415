"""The medium between devices and a PC: the base class of the radio network and of the wire.

     outbox ──> send ──> devices' RXD      the host's transmissions, as soon as they must be known
PC <── hear <─────────── devices' TXD      what the devices sent
     actions ──────────> RST, supply       what somebody does to the devices
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from miro_exact.clock import CYCLE_TICKS
from miro_exact.domain import MAX_SEED
from miro_exact.state import TICK, Rows
from miro_protocol.actions import Action, Fault, Put, RadioState, Reseed, Reset, ScriptItem
from miro_protocol.decoder import Symbol
from miro_protocol.transmission import DOWN, Transmission, check_bad_stop
from miro_sim.periods import PartValues, RobotPeriod
from miro_sim.world.actions import SETTLE_TICKS, Actions
from miro_sim.world.device import Device
from miro_sim.world.events import HostLog
from miro_sim.world.outbox import LATEST_TICK, LONGEST_BYTES, Outbox

LONGEST_TRANSMISSION_TICKS = 1 << 40
"""Twelve hours: no saved transmission ends later than so long after now."""


class Medium:
    """Line `index` of a world, with `devices` in the order of their slots.

    `sent`, `seen`, `heard`: the host's transmissions, robots, and characters from the devices, in the period that is
    under way. `latency`: ticks from the host to the devices.
    """

    STATE: dict[str, Any] = {
        "devices": [Device],
        "outbox": Outbox,
        "actions": Actions,
        "heard": Rows(1 << 20, "B", "?", TICK),
    }
    NOT_HASHED: tuple[str, ...] = ("outbox", "actions", "heard")
    """They depend on when input was announced and where the world stopped."""
    NOT_STATE: tuple[str, ...] = ("index", "host", "latency", "log", "sent", "seen")

    def __init__(
        self, index: int, host: str, devices: list[Any], outbox: Outbox, log: HostLog, latency: int = 0
    ) -> None:
        self.index = index
        self.host = host
        self.devices = devices
        self.latency = latency
        self.actions = Actions(index)
        self.outbox = outbox
        self.log = log
        self.heard: list[Symbol] = []
        self.sent: list[Transmission] = []
        self.seen: list[RobotPeriod] = []

    @property
    def first_slot(self) -> int:
        """The slot of its first device."""
        return int(self.devices[0].slot)

    def device(self, slot: int) -> Device:
        """The device in `slot`. Raises ValueError where there is none."""
        for device in self.devices:
            if device.slot == slot:
                wanted: Device = device
                return wanted
        there = ", ".join(str(device.slot) for device in self.devices)
        raise ValueError(f"net{self.index} has no robot in slot {slot}; there is {there}")

    # Pieces of a control period

    def begin_period(self, tick: int) -> None:
        """Called at the begin of a control period."""
        self.sent = []

    def send_due(self, rendezvous_tick: int) -> None:
        """Sends what comes up before the line is settled at the next rendezvous, and no more.

        What can still be announced there must not be in its state, whenever it was announced.
        """
        # A bit is heard `latency` after it leaves: later ones change nothing that is about to be settled.
        for sent in self.outbox.due(rendezvous_tick + SETTLE_TICKS - self.latency):
            self.send(sent)
            self.sent.append(sent)
            self.log.note(sent)

    def send(self, sent: Transmission) -> None:
        """Puts a transmission on the line."""
        raise NotImplementedError

    def settle(self, rendezvous_tick: int) -> None:
        """All lines have sent: RXD is known up to where the devices stop next."""
        raise NotImplementedError

    def run(self, tick: int) -> bool:
        """Runs every device to `tick`, one after the other; true when one of them stops the world."""
        raise NotImplementedError

    def hear(self, tick: int) -> None:
        """The PC hears what the devices sent up to `tick`."""
        raise NotImplementedError

    def end_period(self) -> list[Transmission]:
        """The host's transmissions and receptions in the period that has ended."""
        raise NotImplementedError

    def part_values(self, tick: int) -> Sequence[PartValues]:
        """The values of the parts of its boards, at `tick`."""
        return ()

    # Input

    def free_tick(self) -> int:
        """Tick at which the transmitter has sent everything."""
        raise NotImplementedError

    def earliest_tick(self, now: int) -> int:
        """The earliest first start bit of characters that are injected at tick `now`."""
        # `send_due` has sent what comes before this. `max`: a long latency would give a tick below 0.
        return max(0, now + SETTLE_TICKS + self.outbox.lead_ticks - self.latency)

    def inject(self, data: bytes, at_tick: int | None, now: int, bad_stop: tuple[int, ...]) -> int:
        """See `World.inject`."""
        earliest = self.earliest_tick(now)
        if not 0 < len(data) <= LONGEST_BYTES:
            raise ValueError(f"net{self.index}: {len(data)} characters; give 1 to {LONGEST_BYTES}")
        if at_tick is not None and not earliest <= at_tick <= LATEST_TICK:
            limits = f"the earliest is {earliest}, the latest {LATEST_TICK} (a day)"
            raise ValueError(f"net{self.index}: tick {at_tick} is out of range; {limits}")
        free_tick = self.free_tick()
        # Behind what waits too: two calls at one tick would otherwise collide.
        tick = max(earliest, self.outbox.end_tick(free_tick)) if at_tick is None else at_tick
        try:
            check_bad_stop(bad_stop, len(data))
            self.outbox.inject(Transmission(tick, DOWN, bytes(data), self.index, bad_stop), free_tick)
        except ValueError as error:
            raise ValueError(f"net{self.index}: {error}") from None
        return tick

    def check_action(self, action: Action) -> None:
        """Raises ValueError for an action that cannot be done here."""
        if isinstance(action, RadioState):
            raise ValueError(f"net{self.index}: is a wire, which has no radio")
        # Before the slot is looked at: a seed is of the whole line, and slot 0 may have no robot.
        if isinstance(action, Reseed):
            if not 0 <= action.seed <= MAX_SEED:
                raise ValueError(f"net{self.index}: seed {action.seed}; give 0 to {MAX_SEED}")
            return
        device = self.device(action.slot)
        if isinstance(action, Put):
            device.check_put(action.path, action.value)
            return
        if isinstance(action, Fault):
            device.check_fault(action.what)
            return
        level = action.level if isinstance(action, Reset) else action.on
        if level not in (0, 1):
            raise ValueError(f"net{self.index}/robot{action.slot}: level {level!r}; give 0 or 1")

    def set_radio(self, state: int, up: bool) -> None:
        """Another state of the link, up or down; only a radio has one."""

    def reseed(self, seed: int, tick: int, up: bool) -> None:
        """The noise of another seed from `tick` on: of what is settled ahead of the devices, or (`up`) of the rest."""
        raise NotImplementedError

    def set_rxd(self, slot: int, state: int) -> None:
        """A fault of the wire from the radio to a robot's RXD, of `RXD_STATES`; only a radio network has one."""

    # For the summary

    def link_counts(self) -> tuple[int, int]:
        """Number of the host's transmissions, and of wrong bits in both directions, so far."""
        raise NotImplementedError

    def vision_counts(self) -> dict[str, int]:
        """Counts of this network's camera (`Sight.counts`); empty without one that can lose anything."""
        return {}

    # Going back, and loading

    def records(self) -> list[Any]:
        """Lists that observers take and that no snapshot contains; `put_back` restores them."""
        devices = [device.records() for device in self.devices]
        # Copies: the piece that follows appends to both.
        return [list(self.sent), list(self.actions.done), self.log.end, devices]

    def put_back(self, records: list[Any]) -> None:
        """Takes back what `records` gave; nothing but more of the same may have happened since."""
        sent, done, log_end, devices = records
        # A copy again: a wait goes back to one mark more than once.
        self.sent = list(sent)
        self.actions.done = list(done)
        self.log.cut(log_end)
        for device, saved in zip(self.devices, devices, strict=True):
            device.put_back(saved)

    def check_times(self, earliest_tick: int, tick: int) -> None:
        """Raises ValueError unless the restored parts are at `tick`, or behind it, not before `earliest_tick`.

        A part that is far behind would need hours to catch up.
        """
        # RADIO_DOWN waits 120 ticks before its action: at tick 0 it may be due at -120.
        if self.actions.next_tick < tick - SETTLE_TICKS:
            raise ValueError(f"an action waits for tick {self.actions.next_tick}, at tick {tick}")
        for reseed in self.actions.reseeds:
            if reseed.tick > tick:
                raise ValueError(f"the noise of tick {reseed.tick} is there at tick {tick}")
        self.actions.check(self.devices)
        free_tick = self.free_tick()
        if free_tick > tick + LONGEST_TRANSMISSION_TICKS:
            raise ValueError(f"the transmitter is busy until tick {free_tick}, at tick {tick}")
        # The outbox does not know what is on the air: it would send into another character.
        if self.outbox.waiting and self.outbox.waiting[0].sent.tick < free_tick:
            raise ValueError(f"characters wait, but the transmitter is busy until tick {free_tick}")
        for device in self.devices:
            cpu = device.board.cpu
            # Further ahead than one instruction the CPU has read levels that were not settled.
            if not earliest_tick <= cpu.cycles * CYCLE_TICKS <= tick + SETTLE_TICKS:
                raise ValueError(f"a CPU is at cycle {cpu.cycles}, at tick {tick}")

    def check_rxd(self, settled_tick: int) -> None:
        """Raises ValueError unless RXD of all devices is settled up to there, with no edge beyond."""
        for device in self.devices:
            rxd = device.board.cpu.rxd
            if rxd.settled_tick != settled_tick or rxd.last_tick() >= max(settled_tick, 1):
                raise ValueError(
                    f"RXD is settled up to tick {rxd.settled_tick}, the radio up to {settled_tick}"
                )


def sent_to(index: int, script: Sequence[ScriptItem] | None) -> list[Transmission] | None:
    """The transmissions of a script on line `index`."""
    # Not []: an empty script silences the station, none lets it send.
    if script is None:
        return None
    return [item for item in script if isinstance(item, Transmission) and item.network == index]
