"""What an LM629 has been told to do: its commands as orders to a wheel.

The control word of LTRJ (LM629 data sheet, table "trajectory control word"): bits 8 to 10 turn the motor off, stop
abruptly, stop smoothly; bit 11 is velocity mode, bit 12 forward; bits 5, 3, 1 announce acceleration, velocity and
position, bits 4, 2, 0 make them relative to what was loaded before.
"""

from __future__ import annotations

from typing import Literal

import msgspec

from miro_robot.lm629.commands import BY_NAME
from miro_sim.world.events import SIDES, Event

_RESET, _STT, _LTRJ = (BY_NAME[name].opcode for name in ("RESET", "STT", "LTRJ"))
_OFF, _STOPS, _ABRUPT = 0x0100, 0x0600, 0x0200
_VELOCITY_MODE, _FORWARD = 0x0800, 0x1000
_ACCELERATION, _ACCELERATION_RELATIVE, _VELOCITY, _VELOCITY_RELATIVE = 0x20, 0x10, 0x08, 0x04


class Order(msgspec.Struct, frozen=True):
    """A wheel is told at `tick`: "off", "stop", or "drive" with this velocity (16.16 counts per sample).

    `word`: the velocity as the radio carries it, in 1/256 count per sample; None where it is no such number.
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
        return None if self.velocity & 0xFF else self.velocity >> 8


class _Loaded:
    """What one chip's trajectory buffer holds."""

    def __init__(self) -> None:
        self.control = 0
        self.velocity = 0
        self.acceleration = 0

    def load(self, data: bytes) -> None:
        self.control = int.from_bytes(data[:2], "big")
        at = 2
        if self.control & _ACCELERATION:
            value = int.from_bytes(data[at : at + 4], "big", signed=True)
            relative = self.control & _ACCELERATION_RELATIVE
            self.acceleration = self.acceleration + value if relative else value
            at += 4
        if self.control & _VELOCITY:
            value = int.from_bytes(data[at : at + 4], "big", signed=True)
            self.velocity = self.velocity + value if self.control & _VELOCITY_RELATIVE else value

    def start(self, tick: int, side: str) -> Order:
        if self.control & _OFF:
            return Order(tick, side, "off", acceleration=self.acceleration)
        if self.control & _STOPS:
            abrupt = bool(self.control & _ABRUPT)
            return Order(tick, side, "stop", acceleration=self.acceleration, abrupt=abrupt)
        backward = self.control & _VELOCITY_MODE and not self.control & _FORWARD
        velocity = -self.velocity if backward else self.velocity
        return Order(tick, side, "drive", velocity, self.acceleration)


class Orders:
    """The orders to both wheels of a robot, from its `command` events. `last`: the one in force, by side."""

    def __init__(self) -> None:
        self.loaded = {side: _Loaded() for side in SIDES}
        self.last = {side: Order(0, side, "off") for side in SIDES}

    def take(self, event: Event) -> Order | None:
        """The order that this command gives, if it gives one."""
        if event.opcode == _LTRJ:
            self.loaded[event.side].load(event.data)
            return None
        if event.opcode == _RESET:
            self.loaded[event.side] = _Loaded()
            order = Order(event.tick, event.side, "off")
        elif event.opcode == _STT:
            order = self.loaded[event.side].start(event.tick, event.side)
        else:
            return None
        self.last[event.side] = order
        return order

    def moving(self) -> list[str]:
        """The sides whose wheel is told to turn."""
        return [side for side in SIDES if self.last[side].moves]
