"""The common base of robot and board fixtures: memory of a processor, breakpoints, reset and supply."""

from __future__ import annotations

from typing import Any

from miro_exact.clock import ms
from miro_protocol.actions import Fault, fault_text
from miro_robot.faults import FirmwareFault
from miro_robot.inspect.values import read_value, write_value
from miro_sim.world.conditions import Condition, Reached, When
from miro_sim.world.events import Event
from miro_sim.world.waits import WaitExpired, Waits
from miro_sim.world.world import World
from mirotwin.shell.firmware_image import is_up
from mirotwin.testing.waiting import WaitFailed, shown_where_it_was_called
from mirotwin.verify.effect import Proof

RESET_TICKS = ms(1)
"""An AT89C52 needs its pin high for two machine cycles, 24 ticks; both LM629 are reset by the firmware."""
UP_TICKS = ms(267)


class DeviceUnderTest:
    """The device in `slot` of `network`.

    `written`: the test has written to its memory; `proofs`: that the faults of the test changed something.
    """

    def __init__(self, world: World, network: int, slot: int) -> None:
        self.world = world
        self.network = network
        self.slot = slot
        self.written = False
        self.proofs: list[Proof] = []
        self._device: Any = world.device(network, slot)
        self._waits = Waits(world)

    @property
    def faults(self) -> list[FirmwareFault]:
        """The firmware faults so far."""
        return list(self._device.board.faults)

    @shown_where_it_was_called
    def read(self, name: str, as_type: str = "") -> Any:
        """The firmware's variable `name` by its C type: `read("last_left")`, `read("motion:state")`, `read("body[3]")`,
        `read("pt.x")`. An array is a list, a struct a dict. `as_type`, `int16` or `uint8[4]`, is for images without
        .cdb. Raises BadInput with similar names.
        """
        return read_value(self._device.board.cpu, self.world.image, name, as_type)

    @shown_where_it_was_called
    def write(self, name: str, value: Any, as_type: str = "") -> None:
        """Changes a variable in internal RAM. No recording holds that: a failure after it leaves no case."""
        self.written = True
        write_value(self._device.board.cpu, self.world.image, name, value, as_type)

    @shown_where_it_was_called
    def break_at(self, place: int | str, within: int | None = None) -> Event:
        """Runs on until the instruction at `place`, an address or a symbol, is the next. `within`: ticks from now;
        None: the limit of virtual time. Raises WaitFailed, and BadInput for a symbol that is not there.
        """
        symbol, address = (place, None) if isinstance(place, str) else (None, place)
        condition = Reached(symbol=symbol, address=address, network=self.network, slot=self.slot)
        return self._until(condition, within, f"{place} was not reached")

    def _until(self, condition: Condition, within: int | None, wanted: str) -> Event:
        try:
            return self._waits.until([condition], within)
        except WaitExpired as expired:
            limit = "" if within is None else f" within {1000 * within / self.world.clock:g} ms"
            raise WaitFailed.of(expired, self.world, f"{wanted}{limit}") from None

    # Its switches

    @shown_where_it_was_called
    def reset(self, for_ticks: int = RESET_TICKS) -> None:
        """Holds the processor in reset for `for_ticks`, then releases it.

        Use `wait_until_up` to wait for the firmware.
        """
        self.world.run_to(self.world.set_reset(1, self.network, self.slot))
        self.world.run_for(for_ticks)
        self.world.run_to(self.world.set_reset(0, self.network, self.slot))

    @shown_where_it_was_called
    def fault(self, hardware: str) -> None:
        """Breaks or repairs hardware: "encoder left lost", as in the `fault` of steps. A test in which the fault
        changes nothing is not judged, and fails. Raises ValueError for an unknown fault.
        """
        fault = Fault(self.world.earliest_action_tick, self.network, self.slot, fault_text(hardware))
        Proof.begin(self.proofs, self.world, f"fault {hardware}", fault)
        self.world.run_to(self.world.do(fault))

    def power_off(self) -> None:
        """Switches its supply off: its memory is lost; wheels roll out."""
        self.world.run_to(self.world.set_power(0, self.network, self.slot))

    def power_on(self) -> None:
        """Switches the supply on again; the device starts from reset."""
        self.world.run_to(self.world.set_power(1, self.network, self.slot))

    @shown_where_it_was_called
    def wait_until_up(self, within: int = UP_TICKS) -> int:
        """Runs on until the firmware has turned its serial receiver on, and returns the tick. Raises WaitFailed."""
        up = When(predicate=lambda robot: is_up(robot.board.cpu), network=self.network, slot=self.slot)
        return self._until(up, within, "the firmware has not turned its serial receiver on").tick
