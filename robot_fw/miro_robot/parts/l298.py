"""An L298: two H-bridges, each with an enable.

ena, in1, in2 --[A]-- out1, out2      en in1 in2 | outputs            mode
enb, in3, in4 --[B]-- out3, out4       0   x   x | let go             coast
                                       1   0   0 | both low           brake
                                       1   1   1 | both high          brake
                                       1   1   0 | as in1 and in2     forward, or backward: see `forward`
                                       1   0   1 | as in1 and in2     the other way
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import IN, RELEASED, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_NEVER = 1 << 62
_COAST, _BRAKE, _FORWARD, _BACKWARD = range(4)
_MODES = ("coast", "brake", "forward", "backward")
_ALL = 0x3F  # inputs
_EN_A, _EN_B, _OUT_1, _OUT_3 = 0, 3, 6, 8  # pins; the inputs follow their enable, the outputs each other


class Forward(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Which input of each channel drives forward."""

    a: Literal["in1", "in2"] = "in1"
    b: Literal["in3", "in4"] = "in3"


class L298(PartKeys, frozen=True, kw_only=True, tag="l298"):
    """An L298: two H-bridges, each with an enable. `forward`: the inputs that drive forward when they are high.

    `duty`: of the last PWM period, which begins when it begins to drive, and ends when it begins again to drive the
    same way: time driven forward less time driven backward, over the period. The PWM may be on the enable or on inputs.
    A level counts as constant, with a duty of 0, 1 or -1, two periods after the last edge, `still_ms` at most.
    """

    PINS = (
        *(Pin("ena", IN, optional=True), Pin("in1", IN), Pin("in2", IN)),
        *(Pin("enb", IN, optional=True), Pin("in3", IN, optional=True), Pin("in4", IN, optional=True)),
        *(Pin(f"out{number}", STRONG, optional=True) for number in range(1, 5)),
    )
    READS = {
        f"{channel}.{key}": words
        for channel in "ab"
        for key, words in {
            "duty": "-1 to 1, backward below 0, over the last PWM period",
            "frequency_hz": "of the PWM; 0 without one",
            "mode": "coast, brake, forward or backward, now",
        }.items()
    }
    SHEET = (
        "ST L298 data sheet, DS0218: pin functions, 'Input stage', figure 6 (bidirectional DC motor control)"
    )

    forward: Forward = Forward()
    still_ms: Annotated[float, Meta(ge=0.1, le=10_000.0)] = 50.0

    def make(self, place: Place) -> Part:
        return L298Part(self, place)


class L293d(L298, frozen=True, kw_only=True, tag="l293d"):
    """An L293D: two H-bridges with diodes inside. 1,2EN and 3,4EN are `ena` and `enb`, 1A to 4A `in1` to `in4`."""

    SHEET = "TI L293x data sheet, SLRS008D: 8.4 'Device functional modes'"


class Channel:
    """The output of one channel, and its duty in a PWM period.

    `direction`: 1 forward, -1 backward, 0 neither, since `edge_tick`. `driven_ticks`: forward less backward up to then.
    `begun_ticks`, `begun_driven`: when it last began to drive backward, and forward, and `driven_ticks` then; -1: not
    since the level was constant. `last_ticks`, `last_driven`: of the last period; 0 while the level counts as constant,
    and is `steady`. It will at `still_tick`.
    """

    STATE = {
        "direction": ("i", -1, 1),
        "steady": ("i", -1, 1),
        "edge_tick": TICK,
        "driven_ticks": ("q", -_NEVER, _NEVER),
        "begun_ticks": ("2q", -1, _NEVER),
        "begun_driven": ("2q", -_NEVER, _NEVER),
        "last_ticks": TICK,
        "last_driven": ("q", -_NEVER, _NEVER),
        "still_tick": TICK,
    }
    NOT_STATE = ("longest_ticks",)

    def __init__(self, longest_ticks: int) -> None:
        self.longest_ticks = longest_ticks
        self.edge_tick = self.driven_ticks = 0
        self.begun_ticks = [-1] * 2
        self.begun_driven = [0] * 2
        self.settle(0)

    def settle(self, direction: int) -> None:
        """The level counts as constant."""
        self.direction = self.steady = direction
        self.begun_ticks[0] = self.begun_ticks[1] = -1
        self.last_ticks = self.last_driven = 0
        self.still_tick = _NEVER

    def turn(self, direction: int, tick: int) -> None:
        """From `tick` on it drives another way."""
        self.driven_ticks += self.direction * (tick - self.edge_tick)
        self.edge_tick = tick
        self.direction = direction
        if direction != 0:
            self._begin_period(1 if direction > 0 else 0, tick)
        wait = self.longest_ticks
        if self.last_ticks > 0:
            wait = min(wait, 2 * self.last_ticks)
        self.still_tick = tick + wait

    def _begin_period(self, way: int, tick: int) -> None:
        if 0 <= self.begun_ticks[way] < tick:
            self.last_ticks = tick - self.begun_ticks[way]
            self.last_driven = self.driven_ticks - self.begun_driven[way]
        self.begun_ticks[way] = tick
        self.begun_driven[way] = self.driven_ticks

    def duty(self) -> float:
        return self.last_driven / self.last_ticks if self.last_ticks > 0 else 1.0 * self.steady


class L298Part(Part):
    """Two channels. `is_on`: whether it has its supply."""

    STATE = {"is_on": FLAG, "channels": [Channel]}
    NOT_STATE = ("modes",)

    def __init__(self, keys: L298, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.is_on = 0
        self.channels = [Channel(self.ticks(1000.0 * keys.still_ms)) for _ in "ab"]
        self.modes = [_COAST] * 16  # by channel, enable, second and first input
        for at, is_first in ((4, keys.forward.a == "in1"), (12, keys.forward.b == "in3")):
            self.modes[at] = self.modes[at + 3] = _BRAKE
            self.modes[at + 1] = _FORWARD if is_first else _BACKWARD  # its first input alone
            self.modes[at + 2] = _BACKWARD if is_first else _FORWARD
        self.reach_tick = _NEVER  # outputs follow the inputs at once

    def supply(self, on: int, tick: int) -> None:
        self.is_on = on
        self.changed(_ALL, tick)
        for bridge in self.channels:
            bridge.settle(bridge.direction)
        self.next_tick = _NEVER

    def changed(self, pins: int, tick: int) -> None:
        for channel in range(2):
            if pins >> (_EN_B if channel else _EN_A) & 7:
                self._follow(channel, tick)
        self._plan(self.next_tick)  # an event too early costs less than one that moves with each edge

    def _follow(self, channel: int, tick: int) -> None:
        """Outputs as the inputs say."""
        mode = self._mode(channel)
        direction = (mode == _FORWARD) - (mode == _BACKWARD)
        bridge: Channel = self.channels[channel]
        if direction != bridge.direction:
            bridge.turn(direction, tick)
        for number in range(2):
            level = self.level((_EN_B if channel else _EN_A) + 1 + number)
            self.drive((_OUT_3 if channel else _OUT_1) + number, RELEASED if mode == _COAST else level)

    def _mode(self, channel: int) -> int:
        inputs = self.levels >> (_EN_B if channel else _EN_A) & 7  # enable lowest
        number = 8 * channel + 4 * (inputs & 1) + (inputs >> 1)
        return self.modes[number] if self.is_on else _COAST

    def due(self, tick: int) -> None:
        for channel in range(2):
            bridge: Channel = self.channels[channel]
            if bridge.still_tick <= tick:
                bridge.settle(bridge.direction)
        self._plan(_NEVER)

    def _plan(self, latest: int) -> None:
        a: Channel = self.channels[0]
        b: Channel = self.channels[1]
        self.next_tick = min(latest, a.still_tick, b.still_tick)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        channel = "ab".index(name[0])
        bridge: Channel = self.channels[channel]
        if name.endswith("mode"):
            return _MODES[self._mode(channel)]
        if name.endswith("duty"):
            return bridge.duty()
        return self.crystal_hz / bridge.last_ticks if bridge.last_ticks > 0 else 0.0
