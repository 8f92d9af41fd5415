"""A PCF8591: four analog inputs and one analog output, eight bits each, on an I2C bus.

          ┌──────┐
    ain0 ─┤1   16├─ VCC           ain0 .. ain3, vref are voltages that a test puts, no nets
    ain1 ─┤2   15├─ aout
    ain2 ─┤3   14├─ vref
    ain3 ─┤4   13├─ agnd
      a0 ─┤5   12├─ EXT
      a1 ─┤6   11├─ OSC
      a2 ─┤7   10├─ scl
     GND ─┤8    9├─ sda
          └──────┘

    start  1001 a2 a1 a0 0  control byte  output, output, ..  stop
    start  1001 a2 a1 a0 1  80h or the last result, results ..  no ack, stop

    control: 0  output on  mode (2 bits)  0  auto-increment  channel (2 bits)

A conversion begins when SCL falls after an acknowledge, and while its result is found the one before it is sent: the
first byte of a read is old. Its result is what a comparator finds, the whole steps below the voltage (chosen: the sheet
draws it and gives no threshold). The internal oscillator's start-up, which asks for an output that is on while channels
count up, spoils no result here.
"""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import Meta

from miro_exact.state import TICK
from miro_robot.parts.i2c import I2C_PINS, I2cTarget
from miro_robot.parts.keys import IN, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_ADDRESS_PINS = 2  # the first one's number
_OUTPUT, _COUNTS = 0x40, 0x04
_AFTER_POWER_ON = 0x80
_MODES = (
    ((0, -1), (1, -1), (2, -1), (3, -1)),
    ((0, 3), (1, 3), (2, 3)),
    ((0, -1), (1, -1), (2, 3)),
    ((0, 1), (2, 3)),
)
"""By mode and channel: the input, and which one is taken off (-1: analog ground)."""
_INPUTS = ("ain0_v", "ain1_v", "ain2_v", "ain3_v")
Volts = Annotated[float, Meta(ge=-0.5, le=6.5)]


class Pcf8591(PartKeys, frozen=True, kw_only=True, tag="pcf8591"):
    """Four analog inputs and an output. `vref_v`: what 256 steps are, from analog ground (0 V) on."""

    PINS = (
        *I2C_PINS,
        Pin("a0", IN, optional=True, level=0),
        Pin("a1", IN, optional=True, level=0),
        Pin("a2", IN, optional=True, level=0),
    )
    PUTS = dict.fromkeys(_INPUTS, Volts)
    READS = {
        **dict.fromkeys(_INPUTS, "voltage at this input"),
        "aout_v": "voltage at the output, 0 while it is off",
        "aout_on": "whether the output is on",
        "control": "the control byte; its channel counts on",
        "conversions": "conversions so far",
        "short_clocks": "levels of SCL shorter than 4.7 us low, 4 us high",
    }
    SHEET = "NXP PCF8591: addressing, control byte, D/A conversion, A/D conversion, characteristics of the I2C-bus"

    vref_v: Annotated[float, Meta(gt=0.0, le=6.0)] = 5.0

    def make(self, place: Place) -> Part:
        return Pcf8591Part(self, place)


class Pcf8591Part(I2cTarget):
    """`result`: of the last conversion. `taken`: bytes of this write."""

    STATE = {
        "control": ("i", 0, 0xFF),
        "output": ("i", 0, 0xFF),
        "result": ("i", 0, 0xFF),
        "taken": ("i", 0, 1),
        "conversions": TICK,
        "volts": ("4d", -0.5, 6.5),
    }
    NOT_STATE = ("step_v",)
    LEAST_LOW_NS, LEAST_HIGH_NS = 4700, 4000

    def __init__(self, keys: Pcf8591, place: Place) -> None:
        I2cTarget.__init__(self, keys, place)
        self.step_v = keys.vref_v / 256.0
        self.volts = [0.0] * 4
        self.control = self.output = self.taken = 0
        self.result = _AFTER_POWER_ON
        self.conversions = 0

    def start(self, tick: int) -> None:
        I2cTarget.start(self, tick)
        self.control = self.output = self.taken = 0
        self.result = _AFTER_POWER_ON

    def addressed(self, byte: int, tick: int) -> int:
        self.taken = 0
        return 1 if byte >> 4 == 0b1001 and not (byte >> 1 ^ self.levels >> _ADDRESS_PINS) & 0b111 else 0

    def received(self, byte: int, tick: int) -> int:
        if self.taken:
            self.output = byte
        else:
            self.control = byte & 0x77
            self.taken = 1
        return 1

    def transmit(self, tick: int) -> int:
        """The result of before, and the next conversion."""
        before = self.result
        channels = _MODES[self.control >> 4 & 3]
        channel = min(self.control & 3, len(channels) - 1)
        plus, minus = channels[channel]
        self.result = self._code(plus, minus)
        self.conversions += 1
        if self.control & _COUNTS:
            self.control = self.control & ~3 | (channel + 1) % len(channels)
        return before

    def _code(self, plus: int, minus: int) -> int:
        if minus < 0:
            return int(min(max(self.volts[plus] / self.step_v, 0.0), 255.0))
        steps = min(max((self.volts[plus] - self.volts[minus]) / self.step_v, -128.0), 127.0)
        return int(steps + 128.0) - 128 & 0xFF  # two's complement

    def put(self, name: str, value: Any, tick: int) -> None:
        """A voltage holds from the next conversion on."""
        self.volts[_INPUTS.index(name)] = value

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name in _INPUTS:
            return self.volts[_INPUTS.index(name)]
        is_on = self.powered and self.control & _OUTPUT
        if name == "aout_v":
            return self.output * self.step_v if is_on else 0.0
        return bool(is_on) if name == "aout_on" else I2cTarget.read(self, name, tick)
