"""A push button or a switch: one contact between the pin and ground, or VCC.

pin --o/ o-- ground    needs something that pulls up: a port but P0 does by itself, P0 wants `pull_ups`
pin --o/ o-- VCC       needs a resistor to ground: `pull_downs`
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import HIGH, LOW, OPEN_DRAIN, RELEASED, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_NEVER = 1 << 62
_MOST_BOUNCES = 6


class Button(PartKeys, frozen=True, kw_only=True, tag="button"):
    """A button. `to`: where the contact leads. `rest`: what it is while nobody presses.

    `bounce_ms`: for so long it bounces after each change, with 2 to 12 edges at random ticks that depend on the seed,
    the button's name and the number of the change only; 0: never. A switch is a button that is left pressed.
    """

    PINS: ClassVar[tuple[Pin, ...]] = (Pin("pin", STRONG),)
    PUTS = {"pressed": bool}
    READS = {"pressed": "whether it is pressed", "closed": "whether its contact is closed"}
    SHEET = (
        "J. G. Ganssle, A Guide to Debouncing (2004): 18 switches, 1.6 ms on average, 6.2 ms but for outliers"
    )

    to: Literal["ground", "vcc"] = "ground"
    rest: Literal["open", "closed"] = "open"
    bounce_ms: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0

    def pin_kind(self, number: int) -> int:
        return STRONG if self.to == "vcc" else OPEN_DRAIN

    @property
    def never_low(self) -> tuple[str, ...]:
        return (self.PINS[0].name,) if self.to == "vcc" else ()

    def make(self, place: Place) -> Part:
        return ButtonPart(self, place)


class ButtonPart(Part):
    """`pressed`: what a finger does. `closed`: of the contact. `changes`: of `pressed`. `bounces`: edges to come."""

    STATE = {
        "pressed": FLAG,
        "closed": FLAG,
        "changes": TICK,
        "bounces": ("i", 0, 2 * _MOST_BOUNCES),
        "settles_tick": TICK,
    }
    NOT_STATE = ("made", "rest", "bounce_ticks")

    def __init__(self, keys: Button, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.made = LOW if keys.to == "ground" else HIGH
        self.rest = 1 if keys.rest == "closed" else 0
        self.bounce_ticks = self.ticks(1000.0 * keys.bounce_ms)
        self.pressed = self.changes = self.bounces = self.settles_tick = 0
        self.closed = self.rest

    def supply(self, on: int, tick: int) -> None:
        """A contact needs no supply."""
        self._contact(self.closed)

    def _contact(self, closed: int) -> None:
        self.closed = closed
        self.drive(0, self.made if closed else RELEASED)

    def put(self, name: str, value: Any, tick: int) -> None:
        self._press(1 if value else 0, tick)

    def _press(self, pressed: int, tick: int) -> None:
        """A press that is as before changes nothing; one during a bounce ends that bounce."""
        if pressed == self.pressed:
            return
        self.pressed = pressed
        self.changes += 1
        self._contact(pressed ^ self.rest)
        if self.bounce_ticks > 0:
            self.settles_tick = tick + self.bounce_ticks
            self.bounces = 2 * (1 + self.place.noise.u32(16 * self.changes) % _MOST_BOUNCES)
            self._bounce_on(tick)

    def due(self, tick: int) -> None:
        self._contact(1 - self.closed)
        self.bounces -= 1
        self._bounce_on(tick)

    def _bounce_on(self, tick: int) -> None:
        """The next edge is somewhere in its share of the time that is left: each is later than the one before."""
        self.next_tick = _NEVER
        if self.bounces > 0:
            share = (self.settles_tick - tick) // self.bounces
            drawn = self.place.noise.u32(16 * self.changes + self.bounces)
            self.next_tick = tick + 1 + drawn % max(1, share)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        return bool(self.pressed if name == "pressed" else self.closed)
