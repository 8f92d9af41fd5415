"""The world: every robot, radio and pilot of a scenario, or a board on a wire, moved on by one integer clock.

Order on the tick of a camera frame: networks by index; within one, all robots are exposed (slot order), all pilots
compute, the station composes its frame. Then everything runs piece by piece from rendezvous to rendezvous: the end of
the control period, where the caller wants to stop, an action. In a piece the transmitters put on the air what
may come up before its end, the air of all networks is settled a little beyond it, each robot runs alone to it (networks
by index, slot order), and the PC's receivers hear what came back. At the end of the period the state is hashed.
How a run is cut into pieces does not change a bit of it.
"""

from __future__ import annotations

import hashlib
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from miro_exact.clock import NEVER_TICK
from miro_exact.domain import MAX_SEED
from miro_exact.engine import check_arithmetic
from miro_exact.state import TICK, Flat, Octets
from miro_protocol.actions import Action, Power, RadioState, Reseed, Reset, ScriptItem
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.faults import FirmwareFault
from miro_robot.image import Image
from miro_sim.periods import PartValues, Period, RobotPeriod
from miro_sim.radio.params import LinkState
from miro_sim.scenario.board import MOST_PERIODS, BoardScenario
from miro_sim.world.actions import SETTLE_TICKS
from miro_sim.world.conditions import Condition
from miro_sim.world.device import Device
from miro_sim.world.events import Event
from miro_sim.world.machine import Feature, no_network
from miro_sim.world.medium import Medium
from miro_sim.world.saved import Identity, opened, sealed
from miro_sim.world.waits import Waits
from miro_sim.world.wire import Wire

if TYPE_CHECKING:  # a board alone needs none of these, which take longer to import than all the rest
    from miro_sim.scenario.keys import Scenario
    from miro_sim.world.bodies import Bodies, Pair
    from miro_sim.world.network import Network
    from miro_sim.world.robot import Robot


class Mark(NamedTuple):
    """A moment of a world: its state, and the records of the period under way, which are no state."""

    state: bytes
    records: list[Any]
    touching: list[Pair]


class World:
    """A deterministic machine: same scenario, same firmware, same seed, same bits.

    `lines` have the devices on them: radio networks with robots, or a wire with a board. `period_ticks`: of a control
    period; `clock`: ticks per second.

    `script` replaces the stations' frames (replay): transmissions of the hosts, which must not overlap on one network,
    and actions (`do`). Raises ValueError for those that do, that are of no host, or of a network or robot that the
    scenario does not have.
    `observers` are called at the end of each control period, with what it left behind; they change nothing.
    """

    STATE = {
        "tick": TICK,
        "index": ("q", 0, MOST_PERIODS),
        "in_period": "?",
        "stopped": "?",
        "chain": Octets(32),
        "lines": [Medium],
    }
    NOT_STATE = (
        "scenario", "seed", "image", "periods", "clock", "period_ticks", "last", "bodies", "waits", "observers",
        "_state", "_own", "_opened",
    )  # fmt: skip

    def __init__(
        self,
        scenario: Scenario | BoardScenario,
        seed: int,
        image: Image,
        script: Sequence[ScriptItem] | None = None,
    ) -> None:
        check_arithmetic()  # again: a plug-in that was loaded since the start may have changed it
        if not 0 <= seed <= MAX_SEED:
            raise ValueError(f"seed {seed} is out of range: 0 to {MAX_SEED}")
        self.scenario: Any = scenario
        self.seed = seed
        self.image = image
        self.periods = scenario.periods
        self.clock = scenario.clock
        self.period_ticks = scenario.period_ticks
        _check_senders(script or (), 1 if isinstance(scenario, BoardScenario) else len(scenario.networks))
        self.bodies: Bodies | None = None
        if isinstance(scenario, BoardScenario):
            wire = Wire
            if scenario.others:
                from miro_sim.world.bus import Bus as wire
            self.lines: list[Medium] = [wire(scenario, seed, 0, image, script)]
        else:
            from miro_sim.world.bodies import Bodies
            from miro_sim.world.network import networks_of

            self.lines = [*networks_of(scenario, seed, image, script)]
            self.bodies = Bodies(self.robots)
        self.tick = 0
        self.index = 0
        self.in_period = False
        self.stopped = False
        self.chain = b""
        self.last: Period | None = None
        self.waits = Waits(self)
        self.observers: list[Callable[[Period], object]] = []
        self._state: Flat | None = None
        self._own: Identity | None = None
        self._opened: tuple[bytes, bytes] | None = None  # a saved world that is whole, and its state
        for item in script or ():
            if not isinstance(item, Transmission):
                # From tick 0 on, not 120: nothing is settled before the first instruction.
                self._announce(item, 0)

    @property
    def digest(self) -> str:
        """SHA-256 in hex over the state at the end of the last control period, which holds the digest before."""
        return self.chain.hex()

    @property
    def lacks(self) -> Mapping[Feature, str]:
        """Nothing: a twin shows everything (`Machine.lacks`)."""
        return {}

    @property
    def finished(self) -> bool:
        """True if the scenario's duration has passed, or a firmware fault has stopped the run."""
        return self.stopped or self.index >= self.periods

    @property
    def networks(self) -> list[Network]:
        """The lines that are radio networks."""
        from miro_sim.world.network import Network

        return [line for line in self.lines if isinstance(line, Network)]

    @property
    def devices(self) -> list[Device]:
        """By line and slot."""
        return [device for line in self.lines for device in line.devices]

    @property
    def robots(self) -> list[Robot]:
        """The devices that are robots."""
        from miro_sim.world.robot import Robot

        return [device for device in self.devices if isinstance(device, Robot)]

    @property
    def bit_ticks(self) -> int:
        """Length of the bits that the host of a board sends; 0 where that is not known yet, and for robots."""
        line = self.lines[0]
        return line.bit_ticks if isinstance(line, Wire) else 0

    @property
    def faults(self) -> list[FirmwareFault]:
        """Firmware faults of all devices, in their order."""
        return [fault for device in self.devices for fault in device.board.faults]

    def step(self) -> Period:
        """Runs to the end of the control period that is under way and returns what it left behind."""
        self.run_to((self.index + 1) * self.period_ticks)
        assert self.last is not None
        return self.last

    def run_to(self, tick: int) -> None:
        """Moves everything on to `tick`, or to the control period in which a firmware fault stops the run.

        Raises ValueError for what is no whole number.
        """
        # Clipped here: the compiled twin would raise OverflowError beyond 64 bits, the uncompiled one not.
        self._run_to(max(0, min(_whole(tick), NEVER_TICK)))

    def _run_to(self, tick: int) -> None:
        while self.tick < tick and not self.stopped:
            self.begin_period()
            self.run_piece(self.rendezvous(tick))
            # A fault ends it early: its records and its link in the digest would be missing.
            if self.stopped or self.tick == (self.index + 1) * self.period_ticks:
                self.end_period()

    def run_for(self, ticks: int) -> None:
        """Advances everything by `ticks`, like `run_to`. Raises ValueError for a negative number."""
        if ticks < 0:
            raise ValueError(f"ticks = {ticks}: time does not go back")
        self.run_to(self.tick + ticks)

    def run_until(self, condition: Condition | Sequence[Condition], within: int | None = None) -> Event:
        """Moves everything on to the first tick at which `condition`, or one of several, is true.

        Returns the event; the world stands at its tick, or one behind it where the event belongs to the machine cycle
        that begins there (an edge of TXD on the boundary of two cycles). What happens later, also on the same tick, is
        left to the next wait; so is what happened since the last wait, as far as the logs hold it (2048 events a
        robot). Only where the run stops depends on a wait. `within`: ticks after which WaitExpired is raised, with
        the events meanwhile; default: the end of the scenario. Raises ValueError for a network, robot, pin or
        symbol that is not there, and for what can never be.

            world.run_until(conditions.Answer(slot=0), within=ticks(0.040))
        """
        conditions = [condition] if isinstance(condition, Condition) else list(condition)
        return self.waits.until(conditions, None if within is None else _whole(within))

    def inject(
        self, data: bytes, network: int = 0, at_tick: int | None = None, bad_stop: Sequence[int] = ()
    ) -> int:
        """Puts characters on the air of `network`; returns the tick of the first start bit.

        Without `at_tick` they queue after what is being sent, as in the FIFO of a serial port. Key-up and radio
        apply as for the station's own; a frame of the station that meets a busy transmitter is dropped and counted.
        `bad_stop`: indices of the characters whose stop bit is to be bad: space for three quarters of a bit.
        Raises ValueError for a network that is not there, a tick before `earliest_tick`, a transmitter that is busy
        then, and indices of no characters.
        """
        at_tick = None if at_tick is None else _whole(at_tick)
        return self._line(network).inject(data, at_tick, self.tick, tuple(bad_stop))

    def earliest_tick(self, network: int = 0) -> int:
        """The earliest tick for the first start bit of what is injected now."""
        return self._line(network).earliest_tick(self.tick)

    def _line(self, index: int) -> Medium:
        if not 0 <= index < len(self.lines):
            raise ValueError(no_network(index, len(self.lines)))
        return self.lines[index]

    def device(self, network: int = 0, slot: int = 0) -> Device:
        """The device in `slot` of line `network`. Raises ValueError where there is none."""
        return self._line(network).device(slot)

    def robot(self, network: int = 0, slot: int = 0) -> Robot:
        """The robot in `slot` of `network`. Raises ValueError where there is none."""
        from miro_sim.world.robot import Robot

        device = self.device(network, slot)
        if not isinstance(device, Robot):
            raise ValueError(f"net{network} is a wire with a board, and no robot")
        return device

    def do(self, action: Action) -> int:
        """Announces what is done at a tick, before all else: `Reset`, `Power`, `RadioState`, `Put`, `Reseed`; returns
        the tick.

        Raises ValueError for a tick before `earliest_action_tick`, a network, robot, part or key that is not there, a
        value that the part does not take, and for levels other than 0 and 1.
        """
        self._announce(action, self.earliest_action_tick)
        return action.tick

    @property
    def earliest_action_tick(self) -> int:
        """The earliest tick for an action that is announced now: the radio is settled up to there."""
        return self.tick + SETTLE_TICKS

    def set_reset(self, level: int, network: int = 0, slot: int | None = None) -> int:
        """Sets the reset pin of a robot's processor, 1 for reset, as soon as possible; returns the tick.

        `slot`: default, the first robot of the network.
        """
        return self.do(Reset(self.earliest_action_tick, network, self._slot(network, slot), level))

    def set_power(self, on: int, network: int = 0, slot: int | None = None) -> int:
        """Switches a robot's supply on (1) or off (0) as soon as possible; returns the tick. `slot` as above."""
        return self.do(Power(self.earliest_action_tick, network, self._slot(network, slot), on))

    def set_radio(self, state: LinkState, network: int = 0) -> int:
        """Lets a radio work ("up"), be off ("down") or give "noise", as soon as possible; returns the tick."""
        return self.do(RadioState(self.earliest_action_tick, network, state))

    def reseed(self, seed: int, network: int = 0) -> int:
        """Gives a line the noise of another seed as soon as possible; returns the tick.

        What is drawn once a seed (wheels, calibration) stays.
        """
        return self.do(Reseed(self.earliest_action_tick, network, seed))

    def _slot(self, network: int, slot: int | None) -> int:
        return self._line(network).first_slot if slot is None else slot

    def _announce(self, action: Action, earliest_tick: int) -> None:
        line = self._line(action.network)
        _whole(action.tick)
        if not earliest_tick <= action.tick < NEVER_TICK:
            raise ValueError(
                f"net{action.network}: tick {action.tick} of an action; the earliest is {earliest_tick}"
            )
        line.check_action(action)
        line.actions.announce(action)

    # Pieces of a control period, for `run_to` and `waits`

    @property
    def period_end(self) -> int:
        """Tick at which the control period ends that is under way, or begins now."""
        return (self.index + 1) * self.period_ticks

    def begin_period(self) -> None:
        """The camera frame, unless the period has begun already."""
        if not self.in_period:
            for line in self.lines:
                line.begin_period(self.tick)
            self.in_period = True

    def rendezvous(self, tick: int) -> int:
        """The next tick on the way to `tick` at which all parts of the world meet."""
        next_tick = min(tick, (self.index + 1) * self.period_ticks)
        for line in self.lines:
            if line.actions.waiting:
                # Not `next_tick`: RADIO_DOWN of an action at tick 0 waits at -120, and time would go back.
                action_tick = line.actions.next_after(self.tick)
                next_tick = min(next_tick, action_tick)
        return next_tick

    def run_piece(self, tick: int) -> None:
        """Everything on to `tick`, which is no later than the end of the period."""
        for line in self.lines:
            if line.actions.waiting:
                # Before `settle`: a radio that goes down must not settle its next 120 ticks as if up.
                line.actions.do_due(line, self.tick)
        for line in self.lines:
            # All send before one settles: on one frequency a network hears its neighbours' carriers.
            line.send_due(tick)
        for line in self.lines:
            line.settle(tick)
        bodies = self.bodies
        if bodies is not None and bodies.pairs:
            # Before the robots run: they note where they are only from the tick that this gives them.
            bodies.begin(self.tick, tick)
        self.tick = tick
        for line in self.lines:
            # Not `self.stopped or ..`: the lines after the one that stops would stay behind its tick.
            self.stopped = line.run(tick) or self.stopped
        for line in self.lines:
            line.hear(tick)
        if bodies is not None and bodies.pairs:
            for touch_tick, robot, other in bodies.look():
                there = (other.network, other.slot)
                touch = Event(
                    tick=touch_tick, what="touch", network=robot.network, value=robot.slot, other=there
                )
                self.lines[robot.network].log.note(touch)

    def end_period(self) -> None:
        """The records of the period that is over, and its link in the digest chain."""
        wire: list[Transmission] = []
        robots: list[RobotPeriod] = []
        for line in self.lines:
            wire += line.end_period()
            robots += line.seen
        index = self.index
        self.in_period = False
        self.index += 1
        # After the index has moved on: the digest is that of a world between two periods, as `load` finds it.
        # The state holds the chain so far, so one digest stands for all periods before it.
        self.chain = hashlib.sha256(self.state.hashed()).digest()
        actions: list[Action] = []
        values: list[PartValues] = []
        for line in self.lines:
            actions += line.actions.take()
            values += line.part_values(self.tick)
        begun = index * self.period_ticks
        records = tuple(robots), tuple(wire), self.chain.hex(), tuple(actions), tuple(values)
        self.last = Period(index, begun, *records)
        for observer in self.observers:
            observer(self.last)

    def mark(self) -> Mark:
        """A mark of the present state, to go back to within the same period."""
        records = [line.records() for line in self.lines]
        return Mark(self.state.save(), records, [] if self.bodies is None else self.bodies.touching)

    def go_back(self, mark: Mark) -> None:
        """To where `mark` was given."""
        self.state.load(mark.state)
        for line, records in zip(self.lines, mark.records, strict=True):
            line.put_back(records)
        if self.bodies is not None:
            self.bodies.start_again(mark.touching)

    def counters(self) -> dict[str, dict[str, int | None]]:
        """The `link` and `vision` parts of the summary, and the counted part of `firmware`, over all robots."""
        devices = self.devices
        cpus = [device.board.cpu for device in devices]
        counts = [line.vision_counts() for line in self.lines]  # by cameras of one kind
        links = [line.link_counts() for line in self.lines]
        return {
            "link": {
                "frames_sent": _total([sent for sent, _ in links]),
                "frames_accepted": _total([device.counter(0) for device in devices]),
                "frames_rejected": _total([device.counter(1) for device in devices]),
                "frames_stale": _total([device.counter(2) for device in devices]),
                "bit_errors": _total([errors for _, errors in links]),
            },
            "vision": {name: _total([part[name] for part in counts]) for name in counts[0]},
            "firmware": {
                "instructions": _total([cpu.instructions for cpu in cpus]),
                "machine_cycles": _total([cpu.cycles for cpu in cpus]),
                "idle_cycles": _total([cpu.idle_cycles for cpu in cpus]),
                "faults": _total([device.board.fault_count for device in devices]),
            },
        }

    @property
    def state(self) -> Flat:
        """Everything that can change in a run, as flat bytes: to save, load, compare and name differences."""
        if self._state is None:
            self._state = Flat(self)
        return self._state

    def save(self) -> bytes:
        """The whole state as bytes, to go on from with `load`: at any tick, also in the middle of a byte."""
        return sealed(self.identity(), self.state.save())

    def load(self, saved: bytes) -> None:
        """Goes on from what `save` gave.

        Raises ValueError, and stays as it is, for anything else: a world of another scenario, seed, firmware or version
        of this program, one that is damaged, and one whose values cannot be.
        """
        # By identity: who loads one saved world again and again pays for its checksum once.
        if self._opened is None or self._opened[0] is not saved:
            self._opened = (saved, opened(saved, self.identity()))
        self.go_on_from(self._opened[1])

    def go_on_from(self, flat: bytes) -> None:
        """Goes on from what `state.save` gave of this world; it has no seal to check."""
        # First, because it may refuse: waits and touches are forgotten only when the world has moved.
        self.state.load(flat)
        if self.bodies is not None:
            self.bodies.start_at(self.tick)
        self.waits.forget()
        for device in self.devices:
            if device.changes is not None:
                device.changes.restart(self.tick)

    def after_load(self) -> None:
        """Raises ValueError unless all parties stand where the world does."""
        begun = self.index * self.period_ticks
        # A fault may have ended the period anywhere in it: then the world stands before `begun`.
        first = begun - self.period_ticks if self.stopped else begun
        last = begun + self.period_ticks - 1 if self.in_period or self.stopped else begun
        if not first <= self.tick <= last:
            raise ValueError(f"the world is at tick {self.tick}, but period {self.index} begins at {begun}")
        if len(self.chain) != (hashlib.sha256().digest_size if self.index else 0):
            raise ValueError(f"the digest has {len(self.chain)} bytes after {self.index} periods")
        for line in self.lines:
            line.check_times(begun - self.period_ticks, self.tick)
            # A stream's seed is no state: without this the noise would go on with the seed of before the load.
            line.actions.draw_again(line, self.seed)

    def identity(self) -> Identity:
        """The identity that a saved world must have so that this one can load it."""
        if self._own is None:
            from miro_sim.scenario.keys import without_expectations

            # `[expect]` changes no bit: a world saved before a check was added can still be loaded.
            bare = without_expectations(self.scenario)
            scenario = hashlib.sha256(msgspec.json.encode(bare, order="sorted")).hexdigest()
            firmware = self.image.sha256 or hashlib.sha256(self.image.code).hexdigest()  # "": not from a file
            self._own = Identity(self.state.tables(), scenario, firmware, self.seed)
        return self._own

    def __repr__(self) -> str:
        return f"World({self.scenario.name}, seed={self.seed}, tick={self.tick}, digest={self.digest[:12]})"


def _check_senders(script: Sequence[ScriptItem], hosts: int) -> None:
    """Raises ValueError for a transmission of no host."""
    for item in script:
        if isinstance(item, Transmission):
            if item.direction != DOWN:
                raise ValueError(f"tick {item.tick}: no host sends {item.direction!r}; give {DOWN!r}")
            if not 0 <= item.network < hosts:
                raise ValueError(f"tick {item.tick}: {no_network(item.network, hosts)}")


def _total(values: Sequence[int | None]) -> int | None:
    """The sum, or None when one of the parts is not known."""
    total = 0
    for value in values:
        if value is None:
            return None
        total += value
    return total


def _whole(ticks: int) -> int:
    try:
        # `operator.index(True)` is 1, and `run_to(True)` would pass unnoticed.
        if isinstance(ticks, bool):
            raise TypeError
        return operator.index(ticks)
    except TypeError:
        raise ValueError(f"{ticks!r} is no whole number of ticks") from None
