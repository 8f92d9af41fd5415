"""Reflectance sensors over a line: an infrared LED and a phototransistor each (TCRT5000), and a comparator.

    s1  s2  s3  ..      each looks straight down at its place of the car
    ~~~~####~~~~        over dark floor its output has the level `dark`, over light floor the other one

A sensor sees a point. All look at once, every millisecond from power-on on, and when the car is put elsewhere; looks
before which nothing can have changed, by the speed of the motors without load, are left out.

`places`: [cm ahead, cm to the left] of the car's middle, for each. What is put for a sensor it sees until it is put
`seen`. Without a car all floor is light.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from miro_exact.plugins import PluginError
from miro_exact.state import FLAG
from miro_robot.parts.keys import HIGH, IN, LOW, OPEN_DRAIN, RELEASED, PartKeys, Pin, Place
from miro_robot.parts.part import Part
from miro_sim.plant.car import CarPart, OnCar

_NEVER = 1 << 62
_BODY = 0
_MOST = 8
_LOOK_US = 1000.0
_LONGEST = 1000  # looks that are left out at most
_SAFE = 0.999  # of the time in which nothing can change
_LIGHT, _DARK, _SEEN = range(3)
_FLOORS = ("light", "dark", "seen")
_NAMES = [f"s{number}" for number in range(1, _MOST + 1)]
_Place = Annotated[float, Meta(ge=-1e3, le=1e3)]


class LineSensors(PartKeys, frozen=True, kw_only=True, tag="line_sensors"):
    """One to eight sensors. `dark`: the level of an output over dark floor."""

    PINS = (
        Pin("body", IN, optional=True),
        Pin("s1", OPEN_DRAIN),
        *(Pin(name, OPEN_DRAIN, optional=True) for name in _NAMES[1:]),
    )
    PUTS = dict.fromkeys(_NAMES, Literal["seen", "dark", "light"])
    READS = {
        "pattern": "of all sensors from s1 on, 1 over dark floor",
        **dict.fromkeys(_NAMES, "dark or light"),
    }
    SHEET = "Vishay TCRT5000, 83760: a reflective sensor; its modules have an LM393 (open collector, 10 kohm to VCC)"

    places: Annotated[tuple[tuple[_Place, _Place], ...], Meta(min_length=1, max_length=_MOST)] = (
        (8.0, 1.5),
        (8.0, 0.0),
        (8.0, -1.5),
    )
    dark: Literal["low", "high"] = "high"

    @property
    def pulled_up(self) -> tuple[str, ...]:
        return tuple(_NAMES)

    def make(self, place: Place) -> Part:
        return LineSensorsPart(self, place)


class LineSensorsPart(OnCar):
    """`floors`: bit per sensor, dark. `held`: by sensor, what was put: light, dark, or what is seen."""

    STATE = {"is_on": FLAG, "floors": ("i", 0, 255), "held": ("8i", _LIGHT, _SEEN)}
    NOT_STATE = ("car", "count", "ahead_cm", "left_cm", "dark_level", "look_ticks")

    def __init__(self, keys: LineSensors, place: Place) -> None:
        OnCar.__init__(self, keys, place)
        self.count = len(keys.places)
        self.ahead_cm, self.left_cm = [0.0] * 8, [0.0] * 8
        for number, (ahead_cm, left_cm) in enumerate(keys.places):
            self.ahead_cm[number], self.left_cm[number] = ahead_cm, left_cm
        self.dark_level = HIGH if keys.dark == "high" else LOW
        self.look_ticks = self.ticks(_LOOK_US)
        self.car: Any = None  # CarPart, from the first start on
        self.is_on = self.floors = 0
        self.held = [_SEEN] * 8

    def supply(self, on: int, tick: int) -> None:
        last = max(self.place.connected)
        if last > self.count:
            raise PluginError(f"s{last} has no place", f"give {last} places, or leave the pin out")
        if self.car is None and _BODY in self.place.connected:
            self.car = self._car()
        self.is_on = on
        OnCar.supply(self, 0, tick)
        self.displaced(tick)

    def _car(self) -> CarPart:
        car = self.source(_BODY)
        if not isinstance(car, CarPart):
            raise PluginError("no car at pin body", 'give body = "CAR.body"')
        return car

    def displaced(self, tick: int) -> None:
        if self.is_on:
            self.due(tick)

    def due(self, tick: int) -> None:
        self.floors = 0
        self.next_tick = _NEVER
        if self.car is not None:
            self._look(tick)
        for number in range(self.count):
            held = self.held[number]
            if held != _SEEN:
                self.floors = self.floors & ~(1 << number) | held << number
            is_dark = self.floors >> number & 1
            level = self.dark_level if is_dark else 1 - self.dark_level
            self.drive(number + 1, RELEASED if level == HIGH else LOW)

    def _look(self, tick: int) -> None:
        """Looks at the floor below all sensors, and plans the next look at which one of them may see another one."""
        car = self.car
        car.look(tick)
        looks = 1.0 * _LONGEST
        for number in range(self.count):
            away_cm = car.edge_cm(self.ahead_cm[number], self.left_cm[number])
            if away_cm <= 0.0:
                self.floors |= 1 << number
            most_cm = car.top_speed(self.ahead_cm[number], self.left_cm[number]) * self.look_ticks
            if most_cm * looks > _SAFE * abs(away_cm):
                looks = _SAFE * abs(away_cm) / most_cm
        self.next_tick = tick + self.look_ticks * max(int(looks), 1)

    def put(self, name: str, value: Any, tick: int) -> None:
        self.held[_NAMES.index(name)] = _FLOORS.index(value)
        self.displaced(tick)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "pattern":
            return "".join(str(self.floors >> number & 1) for number in range(self.count))
        return _FLOORS[self.floors >> _NAMES.index(name) & 1]
