"""An HC-SR04: an ultrasonic ranger, asked by a pulse and answering by the length of another.

           >= 10 us
trig  _____|~~~|________________________________________________
                    eight periods of 40 kHz, and its own time
echo  ______________________________|~~~~~~~~~~~~~~~~|__________
               |<---- 450 us ------>|<- 58 us a cm ->|             no echo: 38 ms, or no pulse at all
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import HIGH, IN, LOW, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_NEVER = 1 << 62
_TRIG, _ECHO = 0, 1
_IDLE, _SENDING, _LISTENING = range(3)
_NORMAL, _NONE, _LOW, _HIGH = range(4)
_ECHOES = ("normal", "none", "low", "high")
_TRIG_US = 10.0
_BURST_US = 450.0  # after trig falls: measured on modules, no sheet states it
_NO_ECHO_US = 38_000.0
_US_PER_CM = 58.0
_NEAREST_CM, _FARTHEST_CM = 2.0, 400.0


class HcSr04(PartKeys, frozen=True, kw_only=True, tag="hc_sr04"):
    """A ranger. `no_echo`: what it answers without an echo: 38 ms, or, as some clones do, nothing.

    `noise_cm`: standard deviation of a measured distance; it depends on the seed, the part's name and the number of the
    measurement only.

    The measurement begins when `trig` falls after at least 10 us; until its answer is over, `trig` is not looked at.
    All times are rounded to the next tick, half up.
    """

    PINS = (Pin("trig", IN), Pin("echo", STRONG))
    PUTS = {
        "distance_cm": Annotated[float, Meta(ge=_NEAREST_CM, le=_FARTHEST_CM)],
        "echo": Literal["normal", "none", "low", "high"],
    }
    READS = {
        "distance_cm": "of the obstacle",
        "echo": "normal, none (no obstacle), or the level at which its output is stuck",
        "pings": "measurements begun since power-on",
    }
    SHEET = "ElecFreaks, Ultrasonic Ranging Module HC-SR04, electric parameters, timing diagram; 38 ms: user's manual"

    no_echo: Literal["38ms", "low"] = "38ms"
    noise_cm: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0

    def make(self, place: Place) -> Part:
        return HcSr04Part(self, place)


class HcSr04Part(Part):
    """`phase`: idle, sending, listening. `rise_tick`: of `trig`, while it is high and was seen to rise."""

    STATE = {
        "phase": ("i", 0, _LISTENING),
        "is_asked": FLAG,
        "rise_tick": TICK,
        "pings": TICK,
        "distance_cm": ("d", _NEAREST_CM, _FARTHEST_CM),
        "echo": ("i", 0, len(_ECHOES) - 1),
    }
    NOT_STATE = ("is_silent", "noise_cm")

    def __init__(self, keys: HcSr04, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.is_silent = 1 if keys.no_echo == "low" else 0
        self.noise_cm = keys.noise_cm
        self.phase = _IDLE
        self.is_asked = self.rise_tick = self.pings = 0
        self.distance_cm = 100.0
        self.echo = _NORMAL

    def start(self, tick: int) -> None:
        """A `trig` that is high from the beginning, as ports are, counts from now on."""
        self.phase = _IDLE
        self.pings = 0
        self.is_asked = self.level(_TRIG)
        self.rise_tick = tick
        self.next_tick = _NEVER
        self._answer(LOW)

    def changed(self, pins: int, tick: int) -> None:
        if not pins & 1:
            return
        asked = self.is_asked
        self.is_asked = 0
        if self.phase != _IDLE:
            return
        if self.level(_TRIG):
            self.is_asked = 1
            self.rise_tick = tick
        elif asked and tick - self.rise_tick >= self.ticks(_TRIG_US):
            self.phase = _SENDING
            self.next_tick = tick + self.ticks(_BURST_US)

    def due(self, tick: int) -> None:
        if self.phase == _SENDING:
            self.pings += 1
            us = self._echo_us()
            if us > 0.0:
                self.phase = _LISTENING
                self.next_tick = tick + self.ticks(us)
                self._answer(HIGH)
                return
        self.phase = _IDLE
        self.next_tick = _NEVER
        self._answer(LOW)

    def _echo_us(self) -> float:
        """How long this answer is."""
        if self.echo == _NONE:
            return 0.0 if self.is_silent else _NO_ECHO_US
        cm = self.distance_cm
        if self.noise_cm > 0.0:
            cm = cm + self.noise_cm * self.place.noise.gauss(self.pings)
        return _US_PER_CM * min(max(cm, _NEAREST_CM), _FARTHEST_CM)

    def _answer(self, level: int) -> None:
        self.drive(_ECHO, LOW if self.echo == _LOW else HIGH if self.echo == _HIGH else level)

    def put(self, name: str, value: Any, tick: int) -> None:
        """A distance, or that there is no echo, holds from the next measurement on; a stuck output at once."""
        if name == "echo":
            self.echo = _ECHOES.index(value)
            self._answer(HIGH if self.phase == _LISTENING else LOW)
        else:
            self.distance_cm = value

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "echo":
            return _ECHOES[self.echo]
        return self.pings if name == "pings" else self.distance_cm
