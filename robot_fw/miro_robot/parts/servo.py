"""A hobby servo: the length of a pulse says to which angle it turns.

pwm  |~~|_________________|~~~|______    0.5 ms: 0 degrees .. 2.5 ms: 180 degrees
     |<->| pulse                         between two pulses the shaft moves on towards the angle, as fast as it can
     |<--- frame, 20 ms ->|

What is on its horn (`horn = "neck.horn"`) turns with it, and looks ahead in the middle. `longer_turns`: to which side a
longer pulse turns it, seen from above. Servos differ; left is chosen.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import IN, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_SHORTEST_US, _LONGEST_US = 300.0, 3000.0  # what else comes is no pulse for a servo: chosen
_HOLD_US = 50_000.0
"""Time in microseconds for which an analog servo drives its motor after a pulse; then it stands without torque until
the next.
"""


class Servo(PartKeys, frozen=True, kw_only=True, tag="servo"):
    """A servo that goes from 0 at `min_us` to `range_deg` at `max_us`, at `deg_per_s` at most.

    Pulses from 0.3 to 3 ms count, those beyond `min_us` and `max_us` go to the stops; frames may be as short as two
    such pulses and as long as 50 ms. It begins in the middle.
    """

    PINS = (Pin("pwm", IN), Pin("horn", STRONG, optional=True))
    READS = {
        "angle_deg": "where it is",
        "target_deg": "where it goes to, by the last pulse that counted",
        "pulse_us": "the last pulse, whatever its length; 0 before the first",
        "frame_hz": "of the last two pulses; 0 without two, and 50 ms after the last",
    }
    SHEET = (
        "Tower Pro SG90 data sheet: 0.12 s for 60 degrees at 4.8 V; 0.5 to 2.5 ms for 180 degrees: measured"
    )

    min_us: Annotated[float, Meta(ge=_SHORTEST_US, le=_LONGEST_US)] = 500.0
    max_us: Annotated[float, Meta(ge=_SHORTEST_US, le=_LONGEST_US)] = 2500.0
    range_deg: Annotated[float, Meta(gt=0.0, le=3600.0)] = 180.0
    deg_per_s: Annotated[float, Meta(gt=0.0, le=1e6)] = 500.0
    longer_turns: Literal["left", "right"] = "left"

    def __post_init__(self) -> None:
        if self.min_us >= self.max_us:
            raise ValueError(f"min_us {self.min_us:g} is not below max_us {self.max_us:g}")

    def make(self, place: Place) -> Part:
        return ServoPart(self, place)


class ServoPart(Part):
    """`angle_deg` at `from_tick`, the end of the last pulse that counted; from there it goes to `target_deg`."""

    STATE = {
        "is_high": FLAG,
        "has_risen": FLAG,
        "rise_tick": TICK,
        "pulse_ticks": TICK,
        "frame_ticks": TICK,
        "from_tick": TICK,
        "angle_deg": ("d", 0.0, 3600.0),
        "target_deg": ("d", 0.0, 3600.0),
    }
    NOT_STATE = (
        "shortest_ticks",
        "longest_ticks",
        "hold_ticks",
        "low_us",
        "deg_per_us",
        "range_deg",
        "deg_per_tick",
        "way",
    )

    def __init__(self, keys: Servo, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.shortest_ticks, self.longest_ticks = self.ticks(_SHORTEST_US), self.ticks(_LONGEST_US)
        self.hold_ticks = self.ticks(_HOLD_US)
        self.low_us = keys.min_us
        self.deg_per_us = keys.range_deg / (keys.max_us - keys.min_us)
        self.range_deg = keys.range_deg
        self.deg_per_tick = keys.deg_per_s / self.crystal_hz
        self.way = 1.0 if keys.longer_turns == "left" else -1.0
        self.is_high = self.has_risen = 0
        self.rise_tick = self.pulse_ticks = self.frame_ticks = self.from_tick = 0
        self.angle_deg = self.target_deg = 0.5 * keys.range_deg

    def supply(self, on: int, tick: int) -> None:
        """Without supply it stands where it is."""
        self.angle_deg = self.target_deg = self._angle(tick)
        self.from_tick = tick
        self.is_high = self.has_risen = 0
        self.pulse_ticks = self.frame_ticks = 0

    def changed(self, pins: int, tick: int) -> None:
        if self.level(0):
            self.frame_ticks = tick - self.rise_tick if self.has_risen else 0
            self.is_high = self.has_risen = 1
            self.rise_tick = tick
        elif self.is_high:
            self.is_high = 0
            self.pulse_ticks = tick - self.rise_tick
            if self.shortest_ticks <= self.pulse_ticks <= self.longest_ticks:
                self._aim(tick)

    def turned_deg(self, tick: int) -> float:
        """Angle of the horn from the middle, counter-clockwise from above, in degrees."""
        return self.way * (self._angle(tick) - 0.5 * self.range_deg)

    def _aim(self, tick: int) -> None:
        self.angle_deg = self._angle(tick)
        self.from_tick = tick
        us = 1e6 * self.pulse_ticks / self.crystal_hz
        self.target_deg = min(max((us - self.low_us) * self.deg_per_us, 0.0), self.range_deg)

    def _angle(self, tick: int) -> float:
        """Its angle at `tick`, which must not be before `from_tick`."""
        reach = self.deg_per_tick * min(tick - self.from_tick, self.hold_ticks)
        if self.target_deg >= self.angle_deg:
            return min(self.angle_deg + reach, self.target_deg)
        return max(self.angle_deg - reach, self.target_deg)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "angle_deg":
            return self._angle(tick)
        if name == "target_deg":
            return self.target_deg
        if name == "pulse_us":
            return 1e6 * self.pulse_ticks / self.crystal_hz
        lasts = self.frame_ticks > 0 and tick - self.rise_tick <= self.hold_ticks
        return self.crystal_hz / self.frame_ticks if lasts else 0.0
