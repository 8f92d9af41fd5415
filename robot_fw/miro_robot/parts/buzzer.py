"""A buzzer, behind its transistor: it sounds by itself while it is on, or needs a tone.

pin --[R]--|< PNP     active low: current flows while the pin is low
"""

from __future__ import annotations

from typing import Literal

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import IN, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_SLOWEST_HZ = 20  # what is slower is no tone but clicks


class Buzzer(PartKeys, frozen=True, kw_only=True, tag="buzzer"):
    """A buzzer. `active`: the level at which current flows.

    `kind`: an active one sounds while current flows; a passive one sounds with the tone that its pin is given, from the
    second pulse on that comes within 50 ms until twice its period after the last.
    """

    PINS = (Pin("pin", IN),)
    READS = {
        "on": "whether it sounds",
        "frequency_hz": "of a passive one: over the last period; 0 when it is silent, and of an active one",
        "sounded_ms": "for how long it has sounded in all",
    }
    SHEET = "TDK PS1240 (passive) and Murata PKB24SPCH3601-B0 (active, own oscillator), product sheets: drive"

    kind: Literal["active", "passive"] = "active"
    active: Literal["low", "high"] = "low"

    def make(self, place: Place) -> Part:
        return BuzzerPart(self, place)


class BuzzerPart(Part):
    """`flows`: current, since `flowed_tick` or last then. `period_ticks`: of a tone. `sounded_ticks`: before it."""

    STATE = {
        "flows": FLAG,
        "has_flowed": FLAG,
        "flowed_tick": TICK,
        "period_ticks": TICK,
        "sounded_ticks": TICK,
    }
    NOT_STATE = ("is_passive", "flow_level", "longest_ticks")

    def __init__(self, keys: Buzzer, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.is_passive = 1 if keys.kind == "passive" else 0
        self.flow_level = 1 if keys.active == "high" else 0
        self.longest_ticks = self.crystal_hz // _SLOWEST_HZ
        self.flows = self.has_flowed = self.flowed_tick = self.period_ticks = self.sounded_ticks = 0

    def supply(self, on: int, tick: int) -> None:
        self.sounded_ticks += self._since(tick)
        self.flows = self.has_flowed = self.period_ticks = 0
        if on:
            self.changed(1, tick)

    def changed(self, pins: int, tick: int) -> None:
        flows = 1 if self.level(0) == self.flow_level else 0
        if flows == self.flows:
            return
        if flows or not self.is_passive:
            self.sounded_ticks += self._since(tick)
        self.flows = flows
        if flows:
            period_ticks = tick - self.flowed_tick if self.has_flowed else 0
            self.period_ticks = period_ticks if period_ticks <= self.longest_ticks else 0
            self.has_flowed = 1
            self.flowed_tick = tick

    def _since(self, tick: int) -> int:
        """For how long it has sounded since the beginning of the last pulse."""
        since = tick - self.flowed_tick
        if self.is_passive:
            return min(since, 2 * self.period_ticks)
        return since if self.flows else 0

    def read(self, name: str, tick: int) -> float | int | bool | str:
        sounds = self.flows != 0
        if self.is_passive:
            sounds = tick - self.flowed_tick < 2 * self.period_ticks
        if name == "on":
            return sounds
        if name == "frequency_hz":
            return self.crystal_hz / self.period_ticks if self.is_passive and sounds else 0.0
        return 1000.0 * (self.sounded_ticks + self._since(tick)) / self.crystal_hz
