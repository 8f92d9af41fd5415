"""The orders to the wheels of a robot, as records of a moment, and the monitors that go by them."""

from __future__ import annotations

from typing import Literal

import msgspec

from miro_protocol.table import VELOCITY_SATURATION
from miro_robot.lm629.orders import WheelOrder
from miro_sim.world.events import SIDES, Event
from mirotwin.verify.checks.interface import C_co, Monitor, Subject


def saturated(word: int) -> int:
    """A velocity as firmware cuts it off."""
    return max(-VELOCITY_SATURATION, min(VELOCITY_SATURATION, word))


class Order(msgspec.Struct, frozen=True):
    """An order to a wheel at `tick`: "off", "stop", or "drive" with this velocity (16.16 counts per sample).

    `acceleration` (16.16 counts per sample^2) is the one last loaded, which counts from this order on. `abrupt`: a stop
    without a ramp.
    """

    tick: int
    side: str
    what: Literal["off", "stop", "drive"]
    velocity: int = 0
    acceleration: int = 0
    abrupt: bool = False

    @property
    def moves(self) -> bool:
        return self.what == "drive" and self.velocity != 0

    @property
    def word(self) -> int | None:
        """The velocity as the radio carries it, in 1/256 count per sample; None where it is no such number."""
        return None if self.velocity & 0xFF else self.velocity >> 8


class Orders:
    """The orders to both wheels of a robot, from its `command` events. `last`: the one in force, by side."""

    def __init__(self) -> None:
        self.wheels = {side: WheelOrder() for side in SIDES}
        self.last = {side: Order(0, side, "off") for side in SIDES}

    def take(self, event: Event) -> Order | None:
        """The order that this command gives, if it gives one."""
        wheel = self.wheels[event.side]
        if not wheel.take(event.opcode, event.data):
            return None
        order = Order(event.tick, event.side, wheel.what, wheel.velocity, wheel.acceleration, wheel.abrupt)
        self.last[event.side] = order
        return order

    def words(self) -> tuple[int, int]:
        """The velocities of both wheels as the radio carries them, a number that no frame holds where it cannot."""
        return self.wheels["left"].word(), self.wheels["right"].word()


class OrdersMonitor(Monitor[C_co]):
    """The orders to the wheels; whoever receives a command adds it here."""

    def __init__(self, check: C_co, subject: Subject) -> None:
        super().__init__(check, subject)
        self.orders = Orders()

    def restarted(self, tick: int) -> None:
        self.until(tick)
        self.orders = Orders()
