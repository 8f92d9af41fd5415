"""A DHT11 or a DHT22 (AM2302): humidity and temperature over one wire, as pulses of two lengths.

         start         answer       40 bits, the highest first              end
data  ~~|____|~30~|__80__|~~80~~|_50_|~26~|_50_|~~~70~~~|_ ..  ~|_50_|~~~~~~
      DHT11: 18 ms, DHT22: 0.8 ms      0         1

    dht11: humidity, 0, degrees, 0, sum             percent and degrees, whole
    dht22: humidity (2), degrees (2), sum           tenths; the highest bit of degrees is the sign

What it sends was measured at the end of the answer before, or a second after power-on: who wants to know what is now
asks twice. Asked within that second, or within 1 s (DHT22: 2 s) of the last answer, it does not answer and counts it in
`refused` (chosen: the sheets say only that it may fail).
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta

from miro_exact.state import TICK
from miro_robot.parts.keys import LOW, OPEN_DRAIN, RELEASED, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_NEVER = 1 << 62
_BEGIN_US = 1e6  # after power-on
# T_go, T_rel, T_LOW, T_H0, T_H1
_WAIT_US, _ANSWER_US, _LOW_US, _ZERO_US, _ONE_US = 30.0, 80.0, 50.0, 26.0, 70.0
_LAST_STEP = 84  # odd ones pull the wire low; 1 and 2 are the answer, 3 to 82 the bits, 83 and 84 the end
_BROKEN = ("none", "missing", "sum")
_MISSING, _SUM = 1, 2


class Dht11(PartKeys, frozen=True, kw_only=True, tag="dht11"):
    """A DHT11: humidity and temperature over one wire, in whole percent and degrees."""

    PINS = (Pin("data", OPEN_DRAIN),)
    PUTS: ClassVar[dict[str, Any]] = {
        "temperature_c": Annotated[float, Meta(ge=0.0, le=50.0)],
        "humidity_percent": Annotated[float, Meta(ge=20.0, le=90.0)],
        "broken": Literal["none", "missing", "sum"],
    }
    READS = {
        "temperature_c": "of the place where it is",
        "humidity_percent": "there",
        "answers": "answers begun",
        "refused": "how often it was asked too soon",
        "broken": "none, missing, sum (the last byte is wrong)",
    }
    SHEET = "Aosong, DHT11 product manual: 5 communication process, 9 notes"
    START_MS: ClassVar[float] = 18.0
    INTERVAL_S: ClassVar[float] = 1.0
    IS_FINE: ClassVar[bool] = False

    def make(self, place: Place) -> Part:
        return DhtPart(self, place)


class Dht22(Dht11, frozen=True, kw_only=True, tag="dht22"):
    """A DHT22 (AM2302): a DHT11 that tells tenths of degrees and percent, below zero, too. Else see dht11."""

    PUTS: ClassVar[dict[str, Any]] = {
        **Dht11.PUTS,
        "temperature_c": Annotated[float, Meta(ge=-40.0, le=80.0)],
        "humidity_percent": Annotated[float, Meta(ge=0.0, le=100.0)],
    }
    SHEET = "Aosong, AM2302 product manual: 7.2 single-bus communication protocol, 7.3 table 7"
    START_MS: ClassVar[float] = 0.8
    INTERVAL_S: ClassVar[float] = 2.0
    IS_FINE: ClassVar[bool] = True


class DhtPart(Part):
    """`step`: of its answer, 0 while it listens. `bits`: the 40 that it sends next."""

    STATE = {
        "step": ("i", 0, _LAST_STEP),
        "bits": ("q", 0, (1 << 40) - 1),
        "fall_tick": TICK,
        "ready_tick": TICK,
        "answers": TICK,
        "refused": TICK,
        "temperature_c": ("d", -40.0, 80.0),
        "humidity_percent": ("d", 0.0, 100.0),
        "broken": ("i", 0, _SUM),
    }
    NOT_STATE = ("is_fine", "start_ticks", "interval_ticks", "step_ticks")

    def __init__(self, keys: Dht11, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.is_fine = 1 if keys.IS_FINE else 0
        self.start_ticks = self.ticks(1000.0 * keys.START_MS)
        self.interval_ticks = self.ticks(1e6 * keys.INTERVAL_S)
        self.step_ticks = [self.ticks(us) for us in (_WAIT_US, _ANSWER_US, _LOW_US, _ZERO_US, _ONE_US)]
        self.temperature_c, self.humidity_percent = 20.0, 50.0
        self.step = self.bits = self.fall_tick = self.ready_tick = 0
        self.answers = self.refused = self.broken = 0

    def start(self, tick: int) -> None:
        """Starts the sensor; the first measurement is at `ready_tick`."""
        self.step = 0
        self.fall_tick = tick
        self.next_tick = self.ready_tick = tick + self.ticks(_BEGIN_US)
        self.drive(0, RELEASED)

    def changed(self, pins: int, tick: int) -> None:
        if not self.levels & 1:
            self.fall_tick = tick
        elif self.step == 0 and tick - self.fall_tick >= self.start_ticks and self.broken != _MISSING:
            if tick < self.ready_tick:
                self.refused += 1
                return
            self.answers += 1
            self.ready_tick = tick + self.interval_ticks
            self.step = 1
            self.next_tick = tick + self.step_ticks[0]

    def due(self, tick: int) -> None:
        step = self.step
        self.next_tick = _NEVER
        if step == 0 or step == _LAST_STEP:
            self.step = 0
            self.drive(0, RELEASED)
            self._measure()
            return
        self.step += 1
        if step & 1:
            self.drive(0, LOW)
            self.next_tick = tick + self.step_ticks[1 if step == 1 else 2]
            return
        self.drive(0, RELEASED)
        bits = self.bits ^ (0xFF if self.broken == _SUM else 0)
        is_one = bits >> (_LAST_STEP - 2 - step >> 1) & 1
        self.next_tick = tick + self.step_ticks[1 if step == 2 else 3 + is_one]

    def _measure(self) -> None:
        """Humidity, degrees and their sum, for the next answer."""
        scale, shift = (10.0, 0) if self.is_fine else (1.0, 8)
        humidity = int(self.humidity_percent * scale + 0.5) << shift
        degrees = int(abs(self.temperature_c) * scale + 0.5) << shift
        if degrees and self.temperature_c < 0.0:
            degrees |= 0x8000
        check = (humidity >> 8) + humidity + (degrees >> 8) + degrees & 0xFF
        self.bits = humidity << 24 | degrees << 8 | check

    def put(self, name: str, value: Any, tick: int) -> None:
        """Sets the climate, which is measured later; a sensor that was missing starts as after power-on."""
        if name != "broken":
            setattr(self, name, value)
            return
        was_missing = self.broken == _MISSING
        self.broken = _BROKEN.index(value)
        if was_missing or self.broken == _MISSING:
            self.start(tick)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        return _BROKEN[self.broken] if name == "broken" else Part.read(self, name, tick)
