"""A relay with its driver: a coil that a pin switches, and a contact that follows some milliseconds later.

coil     ~~~~|_____________________|~~~~~~~     active low
contact  ____________|~~~~~~~~~~~~~~~~~|___     closed; open at rest
             |10 ms->|             |5->|

Its contact leads from the pin `contact` to ground or VCC, as that of a button does.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from miro_exact.state import FLAG, TICK
from miro_robot.parts.button import Button, ButtonPart
from miro_robot.parts.keys import IN, RELEASED, STRONG, Pin, Place
from miro_robot.parts.part import Part

_NEVER = 1 << 62
_COIL = 1
_STUCK = ("none", "open", "closed")


class Relay(Button, frozen=True, kw_only=True, tag="relay"):
    """A relay with its driver: a coil that a pin switches, and a contact that follows some milliseconds later.

    `active`: the level of `coil` that pulls it in. `operate_ms`, `release_ms`: what the sheet has at most.

    `to`: where the contact leads. `rest`: what it is without current. `bounce_ms`: as of a button, after each move.
    A coil that is switched back before the armature has moved moves nothing. Without supply the coil has no current.
    """

    PINS = (Pin("contact", STRONG, optional=True), Pin("coil", IN))
    PUTS = {"stuck": Literal["none", "open", "closed"]}
    READS = {
        "energized": "whether the coil has current",
        "closed": "whether the contact is closed",
        "switched": "how often the armature has moved, to either side",
        "stuck": "none, or what the contact is whatever the armature does",
    }
    SHEET = "Songle, Relay SRD, 8. Performance: operation time 10 ms, release time 5 ms at most"

    active: Literal["low", "high"] = "low"
    operate_ms: Annotated[float, Meta(ge=0.0, le=1000.0)] = 10.0
    release_ms: Annotated[float, Meta(ge=0.0, le=1000.0)] = 5.0

    def pin_kind(self, number: int) -> int:
        return IN if number == _COIL else Button.pin_kind(self, number)

    @property
    def pulled_up(self) -> tuple[str, ...]:
        return ("coil",) if self.active == "low" else ()

    def make(self, place: Place) -> Part:
        return RelayPart(self, place)


class RelayPart(ButtonPart):
    """`pressed`: where the armature is; `armature_tick`: when it moves. `bounce_tick`: of the contact's next edge."""

    STATE = {"energized": FLAG, "stuck": ("i", 0, 2), "armature_tick": TICK, "bounce_tick": TICK}
    NOT_STATE = ("active", "operate_ticks", "release_ticks")

    def __init__(self, keys: Relay, place: Place) -> None:
        ButtonPart.__init__(self, keys, place)
        self.active = 1 if keys.active == "high" else 0
        self.operate_ticks = max(1, self.ticks(1000.0 * keys.operate_ms))
        self.release_ticks = max(1, self.ticks(1000.0 * keys.release_ms))
        self.energized = self.stuck = 0
        self.armature_tick = self.bounce_tick = _NEVER

    def supply(self, on: int, tick: int) -> None:
        self._energize(1 if on and self.level(_COIL) == self.active else 0, tick)
        self._contact(self.closed)

    def changed(self, pins: int, tick: int) -> None:
        self._energize(1 if self.level(_COIL) == self.active else 0, tick)

    def _energize(self, energized: int, tick: int) -> None:
        if energized == self.energized:
            return
        self.energized = energized
        self.armature_tick = _NEVER
        if energized != self.pressed:
            self.armature_tick = tick + (self.operate_ticks if energized else self.release_ticks)
        self.next_tick = min(self.armature_tick, self.bounce_tick)

    def due(self, tick: int) -> None:
        if self.bounce_tick <= tick:
            ButtonPart.due(self, tick)
            self.bounce_tick = self.next_tick
        if self.armature_tick <= tick:
            self.armature_tick = self.next_tick = _NEVER
            self._press(self.energized, tick)
            self.bounce_tick = self.next_tick
        self.next_tick = min(self.armature_tick, self.bounce_tick)

    def _contact(self, closed: int) -> None:
        self.closed = closed
        self.drive(0, self.made if self._is_closed() else RELEASED)

    def _is_closed(self) -> int:
        return self.stuck - 1 if self.stuck else self.closed

    def put(self, name: str, value: Any, tick: int) -> None:
        self.stuck = _STUCK.index(value)
        self._contact(self.closed)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "stuck":
            return _STUCK[self.stuck]
        if name == "switched":
            return self.changes
        return bool(self._is_closed() if name == "closed" else self.energized)
