"""A DC motor with its gear between two outputs of a bridge.

a --(M)-- b     a high, b low: drives forward     both at one level: brakes     one of them let go: coasts
     |
   shaft        of the gear; an encoder's disc sits on it

Speed is held between two points of time. Points are the edges at a and b, what a test puts, and 1 ms after the point
before while the shaft turns or begins to. At a point the speed is worked out from the time since the last one:

    J dw/dt = k i - friction (against the way it turns, and load_nm with it)
    i = (u - k w) / R       u: driving, +-(supply_v - drop_v); braking, the drop, which the back-EMF k w has to overcome
    i = 0                   coasting; and where current would have to flow against the drive

by one implicit Euler step, which is stable for any motor; a step that would go through standstill ends there. So who
is on the shaft knows at a point how it turns until the next: the edges of an encoder are exact in this model. A shaft
that stands, with no torque to start it, has no events at all.
"""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import Meta

from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import IN, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_NEVER = 1 << 62
_TURN_RAD = 6.283185307179586
_STEP_US = 1000.0
_COAST, _FORWARD, _BACKWARD, _BRAKE = range(4)
_SHAFT = 2
_Above = Meta(gt=0.0, le=1e6)
_NotBelow = Meta(ge=0.0, le=1e3)


class DcMotor(PartKeys, frozen=True, kw_only=True, tag="dc_motor"):
    """A motor, seen at the shaft of its gear: constants times the ratio, inertia of the rotor times the ratio squared.

    `resistance_ohm`: of winding and bridge. `drop_v`: of the two transistors, or of the transistor and the diode, that
    conduct. The defaults are a TT gear motor 1:48 on 7.4 V behind an L298: 200 rpm, 0.15 A; stalled 0.6 A.
    """

    PINS = (Pin("a", IN), Pin("b", IN), Pin("shaft", STRONG, optional=True))
    PUTS = {"load_nm": Annotated[float, _NotBelow], "blocked": bool}
    READS = {"rpm": "of the gear's shaft, backward below 0", "turns": "of it since the beginning"}
    SHEET = (
        "none states all: TT motor 1:48 as shops list it (6 V: 200 rpm, 0.15 A, 0.6 A); the rotor of a 130 motor,"
        " 1.5e-7 kg m2, is guessed; ST L298 data sheet: saturation voltages, as in `miro_sim.plant.params`"
    )

    supply_v: Annotated[float, _NotBelow] = 7.4
    drop_v: Annotated[float, _Above] = 1.4
    resistance_ohm: Annotated[float, _Above] = 10.0
    torque_constant_nm_a: Annotated[float, Meta(ge=1e-4, le=1e3)] = 0.215
    inertia_kg_m2: Annotated[float, Meta(ge=1e-9, le=1e3)] = 3.5e-4
    friction_nm: Annotated[float, _NotBelow] = 0.032

    def make(self, place: Place) -> Part:
        return DcMotorPart(self, place)


class OnShaft(Part):
    """A part on the shaft of a motor. It knows of `speed_changed` at each point of the motor's time."""

    def speed_changed(self, tick: int) -> None:
        """From `tick` on the shaft has another speed, which it keeps until the motor's `next_tick` at least."""


class DcMotorPart(Part):
    """`rad_s`: since `from_tick`, the last point, at which the shaft had turned `turns`."""

    STATE = {
        "mode": ("i", 0, _BRAKE),
        "blocked": FLAG,
        "from_tick": TICK,
        "rad_s": ("d", -1e9, 1e9),
        "turns": ("d", -1e12, 1e12),
        "load_nm": ("d", 0.0, 1e3),
    }
    NOT_STATE = (
        "drive_v",
        "drop_v",
        "ohm",
        "nm_a",
        "kg_m2",
        "friction_nm",
        "tick_s",
        "step_ticks",
        "on_shaft",
    )
    CONTINUOUS = True
    SENSES_DRIVE = True

    def __init__(self, keys: DcMotor, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.drive_v = max(keys.supply_v - keys.drop_v, 0.0)
        self.drop_v, self.ohm = keys.drop_v, keys.resistance_ohm
        self.nm_a, self.kg_m2, self.friction_nm = (
            keys.torque_constant_nm_a,
            keys.inertia_kg_m2,
            keys.friction_nm,
        )
        self.tick_s = 1.0 / self.crystal_hz
        self.step_ticks = self.ticks(_STEP_US)
        self.on_shaft: list[OnShaft] = []
        self.mode = _COAST
        self.blocked = self.from_tick = 0
        self.rad_s = self.turns = self.load_nm = 0.0

    def supply(self, on: int, tick: int) -> None:
        """It has none of its own: what its terminals are driven to says what it does."""
        peers = self.place.peers.get(_SHAFT, [])
        self.on_shaft = [part for part, _ in peers if isinstance(part, OnShaft)]
        self.changed(0, tick)

    def changed(self, pins: int, tick: int) -> None:
        self._move(tick)
        self.mode = _COAST
        if self.is_driven(0) and self.is_driven(1):
            a, b = self.level(0), self.level(1)
            self.mode = _BRAKE if a == b else _FORWARD if a else _BACKWARD
        self._go_on(tick)

    def due(self, tick: int) -> None:
        """It looks at its terminals again: while the board has no supply, nobody tells it."""
        self.changed(0, tick)

    def carry(self, kg_m2: float, friction_nm: float) -> None:
        """Adds a load to the shaft, from now on: the share of a car."""
        keys: Any = self.keys
        self.kg_m2 = keys.inertia_kg_m2 + kg_m2
        self.friction_nm = keys.friction_nm + friction_nm

    def put(self, name: str, value: Any, tick: int) -> None:
        self._move(tick)
        setattr(self, name, value)
        if self.blocked:
            self.rad_s = 0.0
        self._go_on(tick)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "turns":
            return self.turns_at(tick)
        return self.rad_s * 60.0 / _TURN_RAD

    # Motion

    def turns_per_tick(self) -> float:
        return self.rad_s / _TURN_RAD * self.tick_s

    def turns_at(self, tick: int) -> float:
        """From the last point to the motor's next event."""
        return self.turns + self.turns_per_tick() * (tick - self.from_tick)

    def _move(self, tick: int) -> None:
        """A point of time: how far it has come, and how fast it is now."""
        if tick > self.from_tick:
            self.turns = self.turns_at(tick)
            if not self.blocked:
                self.rad_s = self._after((tick - self.from_tick) * self.tick_s)
            self.from_tick = tick

    def _go_on(self, tick: int) -> None:
        """The next point, and what is on the shaft is told."""
        stands = self.rad_s == 0.0 and (self.blocked or self._way() == 0)
        self.next_tick = _NEVER if stands else tick + self.step_ticks
        for part in self.on_shaft:
            part.speed_changed(tick)

    def _volts(self) -> float:
        """Voltage that drives current through winding and bridge, without back-EMF; 0 if no current flows."""
        emf_v = self.nm_a * self.rad_s
        if self.mode == _FORWARD and emf_v < self.drive_v:
            return self.drive_v
        if self.mode == _BACKWARD and emf_v > -self.drive_v:
            return -self.drive_v
        if self.mode == _BRAKE and abs(emf_v) > self.drop_v:
            return self.drop_v if emf_v > 0.0 else -self.drop_v
        return 0.0

    def _way(self) -> int:
        """To which side it turns, or begins to: 1 forward, -1 backward, 0 it stays."""
        if self.rad_s != 0.0:
            return 1 if self.rad_s > 0.0 else -1
        torque_nm = self.nm_a * self._volts() / self.ohm
        if abs(torque_nm) <= self.friction_nm + self.load_nm:
            return 0
        return 1 if torque_nm > 0.0 else -1

    def _after(self, seconds: float) -> float:
        """The speed after so long."""
        way = self._way()
        if way == 0:
            return 0.0
        volts = self._volts()
        damping = self.nm_a * self.nm_a / self.ohm if volts != 0.0 else 0.0
        torque_nm = self.nm_a * volts / self.ohm - way * (self.friction_nm + self.load_nm)
        share = seconds / self.kg_m2
        speed = (self.rad_s + share * torque_nm) / (1.0 + share * damping)
        return speed if speed * way > 0.0 else 0.0
