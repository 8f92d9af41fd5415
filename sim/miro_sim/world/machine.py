"""The interface of a machine for links, steps and waits: a `World`, or robots at a port of this PC.

A condition or a step declares what it `needs` of a machine; a machine declares what it `lacks`, and why. Features of a
twin only (memory, digests, saved states) are in `World`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Protocol

from miro_protocol.actions import Action
from miro_sim.periods import Period

if TYPE_CHECKING:
    from miro_robot.image import Image
    from miro_sim.scenario.keys import NetworkSpec, Scenario
    from miro_sim.world.conditions import Condition
    from miro_sim.world.device import Device
    from miro_sim.world.events import Event, HostLog
    from miro_sim.world.robot import Robot
    from miro_sim.world.waits import Waits

Feature = Literal["bad stop", "inside", "switch", "save"]
"""A character with a bad stop bit, the inside of a robot, its switches and those of radios, saving the state."""


class NotObservable(Exception):
    """An operation or observation that this machine does not support."""


class MachineLine(Protocol):
    """One line of a machine. `devices`: those whose inside it shows; `first_slot`: of all devices on it."""

    @property
    def index(self) -> int: ...
    @property
    def log(self) -> HostLog: ...
    @property
    def devices(self) -> Sequence[Device]: ...
    @property
    def first_slot(self) -> int: ...


class MachineNetwork(MachineLine, Protocol):
    """One network of a machine. `robots`: those whose inside it shows."""

    @property
    def spec(self) -> NetworkSpec: ...
    @property
    def robots(self) -> Sequence[Robot]: ...


class Machine(Protocol):
    """See `World`, which has all of these. `lacks`: by feature, the words behind "not observable".

    `clock`: ticks per second; `image`: None where it is not known what the robots run.
    """

    scenario: Scenario
    waits: Waits
    observers: list[Callable[[Period], object]]
    in_period: bool
    stopped: bool

    @property
    def lacks(self) -> Mapping[Feature, str]: ...
    @property
    def image(self) -> Image | None: ...
    @property
    def lines(self) -> Sequence[MachineLine]: ...
    @property
    def networks(self) -> Sequence[MachineNetwork]: ...
    @property
    def devices(self) -> Sequence[Device]: ...
    @property
    def robots(self) -> Sequence[Robot]: ...
    @property
    def clock(self) -> int: ...
    @property
    def tick(self) -> int: ...
    @property
    def finished(self) -> bool: ...
    @property
    def earliest_action_tick(self) -> int: ...

    def device(self, network: int = 0, slot: int = 0) -> Device: ...
    def robot(self, network: int = 0, slot: int = 0) -> Robot: ...
    def run_to(self, tick: int) -> None: ...
    def run_for(self, ticks: int) -> None: ...
    def run_until(self, condition: Condition | Sequence[Condition], within: int | None = None) -> Event: ...
    def earliest_tick(self, network: int = 0) -> int: ...
    def inject(
        self, data: bytes, network: int = 0, at_tick: int | None = None, bad_stop: Sequence[int] = ()
    ) -> int: ...
    def do(self, action: Action) -> int: ...

    # Pieces of a control period, for `Waits`. A machine whose time only goes on has nothing to go back to.

    @property
    def period_end(self) -> int: ...
    def begin_period(self) -> None: ...
    def rendezvous(self, tick: int) -> int: ...
    def run_piece(self, tick: int) -> None: ...
    def end_period(self) -> None: ...
    def mark(self) -> Any: ...
    def go_back(self, mark: Any) -> None: ...


def why_not(machine: Machine, wanted: object, needs: Feature | None) -> str:
    """The line that says why the machine cannot show or do what is `wanted`, "" if it can."""
    why = "" if needs is None else machine.lacks.get(needs, "")
    return why and f"{wanted}: not observable {why}"


def require(machine: Machine, wanted: object, needs: Feature | None) -> None:
    """Raises NotObservable for what the machine cannot show or do."""
    if why := why_not(machine, wanted, needs):
        raise NotObservable(why)


def no_network(index: int, count: int) -> str:
    """Why network `index` is refused where there are `count`."""
    return f"network {index} does not exist; there {'is' if count == 1 else 'are'} {count}, numbered from 0"
