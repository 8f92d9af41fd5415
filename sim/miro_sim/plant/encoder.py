"""An encoder on the shaft of a motor: two channels a quarter of a line apart, or one.

shaft ---(disc)--- a   forward: (a, b) goes 00, 10, 11, 01
              \\___ b   not connected: a slotted or Hall disc with one channel
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from miro_exact.plugins import PluginError
from miro_exact.state import FLAG
from miro_robot.parts.keys import IN, LOW, RELEASED, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part
from miro_sim.plant.dc_motor import DcMotorPart, OnShaft

_NEVER = 1 << 62
_SHAFT, _A, _B = range(3)
_FAR = 1e15  # ticks
_BROKEN = ("low", "high", "none")  # as LOW, HIGH, RELEASED
_Broken = Literal["none", "low", "high"]


class Encoder(PartKeys, frozen=True, kw_only=True, tag="encoder"):
    """An encoder. `lines`: of the disc, or pairs of poles, for each turn of the gear's shaft.

    It begins in the middle of a quarter of a line. An edge is on the first tick at which the shaft is beyond it.
    """

    PINS = (Pin("shaft", IN), Pin("a", STRONG), Pin("b", STRONG, optional=True))
    PUTS = {"a.broken": _Broken, "b.broken": _Broken}
    READS = {
        "counts": "quarters of a line, forward less backward",
        "a.broken": "none, or the level at which channel a is stuck",
        "b.broken": "the same of channel b",
    }
    SHEET = (
        "Agilent HEDS-9000 data sheet: definitions, output waveforms; slotted disc of the TT motor: 20 lines"
    )

    lines: Annotated[int, Meta(ge=1, le=100_000)] = 20

    def make(self, place: Place) -> Part:
        return EncoderPart(self, place)


class EncoderPart(OnShaft):
    """`count`: what its outputs show. `broken`: by channel, the level at which it is stuck, or RELEASED."""

    STATE = {
        "is_on": FLAG,
        "count": ("q", -_NEVER, _NEVER),
        "broken_a": ("i", LOW, RELEASED),
        "broken_b": ("i", LOW, RELEASED),
    }
    NOT_STATE = ("motor", "counts_per_turn")

    def __init__(self, keys: Encoder, place: Place) -> None:
        OnShaft.__init__(self, keys, place)
        self.counts_per_turn = 4.0 * keys.lines
        self.motor: Any = None  # DcMotorPart, from the first supply on
        self.is_on = self.count = 0
        self.broken_a = self.broken_b = RELEASED

    def supply(self, on: int, tick: int) -> None:
        if self.motor is None:
            self.motor = self._motor()
        self.is_on = 0
        OnShaft.supply(self, 0, tick)
        if on:
            self.is_on = 1
            self.due(tick)

    def _motor(self) -> DcMotorPart:
        motor = self.source(_SHAFT)
        if not isinstance(motor, DcMotorPart):
            raise PluginError("no motor at pin shaft", 'give shaft = "MOTOR.shaft"')
        return motor

    def due(self, tick: int) -> None:
        self.count = self._count_at(tick)
        self._show()
        self._plan(tick)

    def speed_changed(self, tick: int) -> None:
        if self.is_on:
            self._plan(tick)

    def _position_at(self, tick: int) -> float:
        position: float = self.motor.turns_at(tick) * self.counts_per_turn + 0.5
        return position

    def _count_at(self, tick: int) -> int:
        position = self._position_at(tick)
        count = int(position)
        return count - 1 if count > position else count

    def _plan(self, tick: int) -> None:
        """The first tick from `tick` on with another count, if it comes before the motor's speed changes again."""
        last_tick = self.motor.next_tick
        pace = self.motor.turns_per_tick() * self.counts_per_turn
        self.next_tick = _NEVER
        if self._count_at(tick) != self.count:  # an edge on this tick, and the motor came first
            self.next_tick = tick
        if self.next_tick == tick or pace == 0.0:
            return
        edge = self.count + 1.0 if pace > 0.0 else 0.0 + self.count
        ticks = (edge - self._position_at(tick)) / pace
        if ticks > _FAR:
            return
        at = tick + max(int(ticks), 0)
        while at <= last_tick and self._count_at(at) == self.count:
            at += 1
        while at > tick and self._count_at(at - 1) != self.count:
            at -= 1
        if at <= last_tick:
            self.next_tick = at

    def _show(self) -> None:
        """Quarter 0 is (0, 0), 1 is (1, 0), 2 is (1, 1), 3 is (0, 1)."""
        quarter = self.count & 3
        self.drive(_A, (quarter + 1 >> 1 & 1) if self.broken_a == RELEASED else self.broken_a)
        self.drive(_B, (quarter >> 1) if self.broken_b == RELEASED else self.broken_b)

    def put(self, name: str, value: Any, tick: int) -> None:
        level = _BROKEN.index(value)
        if name == "a.broken":
            self.broken_a = level
        else:
            self.broken_b = level
        if self.is_on:
            self._show()

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "counts":
            return self.count
        return _BROKEN[self.broken_a if name == "a.broken" else self.broken_b]
