"""An HC-SR04: an ultrasonic ranger, asked by a pulse and answering by the length of another.

           >= 10 us
trig  _____|~~~|________________________________________________
                    eight periods of 40 kHz, and its own time
echo  ______________________________|~~~~~~~~~~~~~~~~|__________
               |<---- 450 us ------>|<- 58 us a cm ->|             no echo: 38 ms, or no pulse at all

On a car (`body = "car.body"`) it stands `ahead_cm`, `left_cm` of the car's middle, turned `turned_deg` to the left and
as a servo is (`horn = "neck.horn"`). It measures to the nearest place of a wall in its beam of 15 degrees; one that it
meets at more than 45 degrees from the perpendicular sends no echo. A put distance holds until `sees = "walls"` is put.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from miro_exact.plugins import PluginError
from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import HIGH, IN, LOW, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_NEVER = 1 << 62
_TRIG, _ECHO, _BODY, _HORN = range(4)
_IDLE, _SENDING, _LISTENING = range(3)
_NORMAL, _NONE, _LOW, _HIGH = range(4)
_ECHOES = ("normal", "none", "low", "high")
_TRIG_US = 10.0
_BURST_US = 450.0  # after trig falls: measured on modules, no sheet states it
_NO_ECHO_US = 38_000.0
_US_PER_CM = 58.0
_NEAREST_CM, _FARTHEST_CM = 2.0, 400.0
_SEES = ("put", "walls")
_Place = Annotated[float, Meta(ge=-1e3, le=1e3)]


class HcSr04(PartKeys, frozen=True, kw_only=True, tag="hc_sr04"):
    """A ranger. `no_echo`: what it answers without an echo: 38 ms, or, as some clones do, nothing.

    `noise_cm`: standard deviation of a measured distance; it depends on the seed, the part's name and the number of the
    measurement only.

    The measurement begins when `trig` falls after at least 10 us; until its answer is over, `trig` is not looked at.
    All times are rounded to the next tick, half up.
    """

    PINS = (
        *(Pin("trig", IN), Pin("echo", STRONG)),
        *(Pin("body", IN, optional=True), Pin("horn", IN, optional=True)),
    )
    PUTS = {
        "distance_cm": Annotated[float, Meta(ge=_NEAREST_CM, le=_FARTHEST_CM)],
        "echo": Literal["normal", "none", "low", "high"],
        "sees": Literal["put", "walls"],
    }
    READS = {
        "distance_cm": "of the obstacle; above 400 there is no echo",
        "echo": "normal, none (no obstacle), or the level at which its output is stuck",
        "sees": "walls of the car's plane, or what was put",
        "pings": "measurements begun since power-on",
    }
    SHEET = "ElecFreaks, Ultrasonic Ranging Module HC-SR04, electric parameters, timing diagram; 38 ms: user's manual"

    no_echo: Literal["38ms", "low"] = "38ms"
    noise_cm: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0
    ahead_cm: _Place = 0.0
    left_cm: _Place = 0.0
    turned_deg: Annotated[float, Meta(ge=-360.0, le=360.0)] = 0.0

    def make(self, place: Place) -> Part:
        return HcSr04OnCar(self, place) if _BODY in place.connected else HcSr04Part(self, place)


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
    NOT_STATE: tuple[str, ...] = ("is_silent", "noise_cm")

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
            us = self._echo_us(self._obstacle_cm(tick))
            if us > 0.0:
                self.phase = _LISTENING
                self.next_tick = tick + self.ticks(us)
                self._answer(HIGH)
                return
        self.phase = _IDLE
        self.next_tick = _NEVER
        self._answer(LOW)

    def _obstacle_cm(self, tick: int) -> float:
        return self.distance_cm

    def _echo_us(self, cm: float) -> float:
        """Length of this answer in microseconds."""
        if self.echo == _NONE or cm > _FARTHEST_CM:
            return 0.0 if self.is_silent else _NO_ECHO_US
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
        elif name == "distance_cm":
            self.distance_cm = value

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "echo":
            return _ECHOES[self.echo]
        if name == "sees":
            return _SEES[0]
        return self.pings if name == "pings" else self._obstacle_cm(tick)


class HcSr04OnCar(HcSr04Part):
    """A ranger on a car. `sees_walls`: it measures the walls until a distance is put."""

    STATE = {"sees_walls": FLAG}
    NOT_STATE = ("car", "servo", "ahead_cm", "left_cm", "turned_deg")

    def __init__(self, keys: HcSr04, place: Place) -> None:
        HcSr04Part.__init__(self, keys, place)
        self.ahead_cm, self.left_cm, self.turned_deg = keys.ahead_cm, keys.left_cm, keys.turned_deg
        self.car: Any = None  # from the first start on: has `echo_cm`
        self.servo: Any = None  # has `turned_deg`
        self.sees_walls = 1

    def start(self, tick: int) -> None:
        if self.car is None:
            self.car = self.source(_BODY)
            if not hasattr(self.car, "echo_cm"):
                raise PluginError("no car at pin body", 'give body = "CAR.body"')
            if _HORN in self.place.connected:
                self.servo = self.source(_HORN)
                if not hasattr(self.servo, "turned_deg"):
                    raise PluginError("no servo at pin horn", 'give horn = "SERVO.horn"')
        HcSr04Part.start(self, tick)

    def _obstacle_cm(self, tick: int) -> float:
        if not self.sees_walls:
            return self.distance_cm
        turned_deg = self.turned_deg
        if self.servo is not None:
            turned_deg = turned_deg + self.servo.turned_deg(tick)
        cm: float = self.car.echo_cm(tick, self.ahead_cm, self.left_cm, turned_deg)
        return cm if cm >= 0.0 else 2.0 * _FARTHEST_CM

    def put(self, name: str, value: Any, tick: int) -> None:
        if name != "echo":
            self.sees_walls = 1 if value == "walls" else 0
        HcSr04Part.put(self, name, value, tick)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        return _SEES[self.sees_walls] if name == "sees" else HcSr04Part.read(self, name, tick)
