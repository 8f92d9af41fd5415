"""A car on a plane: motors turn its wheels, and what stands on it sees walls and lines.

    left motor.shaft  ──> left         ^ y
    right motor.shaft ──> right        |   heading_deg counter-clockwise from x
                body <── sensors       +──> x        (x_cm, y_cm): between the driven wheels

Wheels roll as those of the robot's chassis do (`chassis.Body`). It moves on at each point of time of one of its motors;
between two the shafts turn evenly, so its way is exact for what they do. Of the mass each wheel carries its share, as
an inertia on its shaft: one wheel does not feel the other, which is exact where the radius of gyration is half the
track. Of four wheels those of one side roll together, with the mean of their shafts.

`walls`: segments [x1, y1, x2, y2] in cm. `lines`: lists of points [x, y], `line_cm` wide, dark on light floor.
`picture`: rows of text, the top one first, of square cells of `cell_cm`, dark where there is neither a blank nor `.`
nor `-`; its lower left corner is at (0, 0). `radius_cm`: of the car's outline, a circle around its middle. Where that
meets a wall the car stays, its wheels slip, and it may turn or back off.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from miro_exact import dmath
from miro_exact.plugins import PluginError
from miro_exact.state import FLAG, TICK
from miro_robot.parts.keys import IN, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part
from miro_sim.plant.chassis import Body
from miro_sim.plant.dc_motor import DcMotorPart, OnShaft
from miro_sim.plant.params import GRAVITY_M_S2, Chassis, DriveParams
from miro_sim.plant.plane import MOST_SEGMENTS, Plane

_TURN_RAD = 6.283185307179586
_DEGREE_RAD = 0.017453292519943295
_LEAST_WALL_CM = 0.01
_NO_NEARER_CM = 1e-9
_MOST_RAD = 1e5  # of a heading that counts whole turns: two hours of a car that spins
_LEFT, _RIGHT, _REAR_LEFT, _REAR_RIGHT, _BODY = range(5)

Cm = Annotated[float, Meta(ge=-1e4, le=1e4)]
Degrees = Annotated[float, Meta(ge=-3600.0, le=3600.0)]
_Cell = Annotated[float, Meta(ge=0.01, le=1e3)]
Point = tuple[Cm, Cm]


class Car(PartKeys, frozen=True, kw_only=True, tag="car"):
    """A car with two driven wheels and a caster, or with four wheels of which two are each side's.

    It stands at `x_cm`, `y_cm`, `heading_deg` at first.
    """

    PINS = (
        *(Pin("left", IN), Pin("right", IN)),
        *(Pin("rear_left", IN, optional=True), Pin("rear_right", IN, optional=True)),
        Pin("body", STRONG, optional=True),
    )
    PUTS = {"x_cm": Cm, "y_cm": Cm, "heading_deg": Degrees}
    READS = {
        "x_cm": "where it is",
        "y_cm": "where it is",
        "heading_deg": "where it looks, counter-clockwise from x; whole turns count",
        "speed_cm_s": "forward; 0 at a wall",
        "bumped": "whether a wall stops it",
        "bumps": "how often it came to one",
    }
    SHEET = (
        "none: wheels of 65 mm and chassis for TT motors as shops list them; 0.6 kg with batteries is guessed"
    )
    PATH: ClassVar[tuple[str, ...]] = ("x_cm", "y_cm", "heading_deg")
    """Values that say where it is: who draws its way finds them here, and walls and lines among the keys."""

    wheel_radius_cm: Annotated[float, Meta(ge=0.1, le=100.0)] = 3.25
    track_cm: Annotated[float, Meta(ge=0.1, le=1e3)] = 13.0
    mass_kg: Annotated[float, Meta(ge=1e-3, le=1e3)] = 0.6
    wheel_inertia_kg_m2: Annotated[float, Meta(ge=0.0, le=1e3)] = 2e-5
    rolling_resistance: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.03
    radius_cm: Annotated[float, Meta(ge=0.1, le=1e3)] = 10.0
    x_cm: Cm = 0.0
    y_cm: Cm = 0.0
    heading_deg: Degrees = 0.0
    walls: tuple[tuple[Cm, Cm, Cm, Cm], ...] = ()
    lines: tuple[Annotated[tuple[Point, ...], Meta(min_length=2)], ...] = ()
    line_cm: _Cell = 1.9
    picture: Annotated[tuple[Annotated[str, Meta(max_length=1024)], ...], Meta(max_length=1024)] = ()
    cell_cm: _Cell = 1.0

    def __post_init__(self) -> None:
        for key, count in (("walls", len(self.walls)), ("lines", len(self.pieces))):
            if count > MOST_SEGMENTS:
                raise ValueError(f"{key}: {count} pieces, at most {MOST_SEGMENTS} fit")
        for x1, y1, x2, y2 in self.walls:
            if abs(x2 - x1) + abs(y2 - y1) < _LEAST_WALL_CM:
                raise ValueError(f"walls: one at ({x1:g}, {y1:g}) is shorter than {_LEAST_WALL_CM:g} cm")

    @property
    def pieces(self) -> list[tuple[float, float, float, float]]:
        """The segments of all lines."""
        return [(*a, *b) for line in self.lines for a, b in pairwise(line)]

    def make(self, place: Place) -> Part:
        return CarPart(self, place)


class OnCar(Part):
    """A part on the body of a car, which calls `displaced` when it has been put elsewhere."""

    def displaced(self, tick: int) -> None:
        """From `tick` on the car is elsewhere, not by its wheels."""


class CarPart(OnShaft):
    """`body`: as of the last point of time of a motor, at which its wheels had turned `left_turns`, `right_turns`."""

    STATE = {
        "body": Body,
        "left_turns": ("d", -1e12, 1e12),
        "right_turns": ("d", -1e12, 1e12),
        "bumped": FLAG,
        "bumps": TICK,
    }
    NOT_STATE = (
        *("plane", "radius_cm", "radius_m", "on_body", "top_cm_tick", "half_track_cm"),
        *("left", "right", "rear_left", "rear_right"),
        *("at_x_cm", "at_y_cm", "at_rad", "cosine", "sine"),  # of the last look
    )
    CONTINUOUS = True

    def __init__(self, keys: Car, place: Place) -> None:
        OnShaft.__init__(self, keys, place)
        self.radius_cm, self.radius_m = keys.radius_cm, 0.01 * keys.wheel_radius_cm
        self.half_track_cm = 0.5 * keys.track_cm
        chassis = Chassis(
            mass_kg=keys.mass_kg,
            track_m=0.01 * keys.track_cm,
            wheel_radius_m=self.radius_m,
            gear_ratio=1.0,  # a shaft is the gear's
        )
        self.body = Body(
            DriveParams(chassis=chassis), 0.01 * keys.x_cm, 0.01 * keys.y_cm, keys.heading_deg * _DEGREE_RAD
        )
        self.plane = Plane(list(keys.walls), keys.pieces, keys.line_cm, list(keys.picture), keys.cell_cm)
        self.left: Any = None  # DcMotorPart, from the first supply on
        self.right: Any = None
        self.rear_left: Any = None
        self.rear_right: Any = None
        self.on_body: list[OnCar] = []
        self.left_turns = self.right_turns = 0.0
        self.top_cm_tick = 1.0  # beyond all, until its motors are known
        self.bumped = self.bumps = 0
        self.at_x_cm = self.at_y_cm = self.at_rad = self.cosine = self.sine = 0.0

    def supply(self, on: int, tick: int) -> None:
        """It has none."""
        if self.left is None:
            self._load()
            self.on_body = [part for part, _ in self.place.peers.get(_BODY, []) if isinstance(part, OnCar)]

    def _load(self) -> None:
        """Gives each motor its share of the car."""
        keys: Any = self.keys
        motors = [self._motor(pin) for pin in (_LEFT, _RIGHT, _REAR_LEFT, _REAR_RIGHT)]
        self.left, self.right, self.rear_left, self.rear_right = motors
        there = [motor for motor in motors if motor is not None]
        self.top_cm_tick = 0.0
        share_kg = keys.mass_kg / len(there)
        rolling_nm = keys.rolling_resistance * share_kg * GRAVITY_M_S2 * self.radius_m
        for motor in there:
            motor.carry(keys.wheel_inertia_kg_m2 + share_kg * self.radius_m * self.radius_m, rolling_nm)
            top_rad_tick = motor.drive_v / motor.nm_a / self.crystal_hz
            self.top_cm_tick = max(self.top_cm_tick, 100.0 * self.radius_m * top_rad_tick)

    def _motor(self, pin: int) -> DcMotorPart | None:
        if pin not in self.place.connected and self.keys.PINS[pin].optional:
            return None
        motor = self.source(pin)
        if not isinstance(motor, DcMotorPart):
            name = self._named(pin)
            raise PluginError(f"no motor at pin {name}", f'give {name} = "MOTOR.shaft"')
        return motor

    # Motion

    def speed_changed(self, tick: int) -> None:
        """A point of time of one of its motors."""
        if self.left is None:
            return
        left, right = self.left_turns, self.right_turns
        bumped = self._roll(tick)
        if not -_MOST_RAD < self.body.theta_rad < _MOST_RAD:
            self.body.theta_rad = dmath.wrap_pi(self.body.theta_rad)
        if left != self.left_turns or right != self.right_turns:
            self.bumps += 1 if bumped and not self.bumped else 0
            self.bumped = bumped

    def _roll(self, tick: int) -> int:
        """Rolls to `tick`. Returns whether it came to a wall, where it stays."""
        left = self._turns(self.left, self.rear_left, tick)
        right = self._turns(self.right, self.rear_right, tick)
        body = self.body
        x_m, y_m = body.x_m, body.y_m
        body.turned_left_rad[0] = _TURN_RAD * (left - self.left_turns)
        body.turned_right_rad[0] = _TURN_RAD * (right - self.right_turns)
        self.left_turns, self.right_turns = left, right
        body._roll(1)
        room_cm = self.plane.room_cm(100.0 * body.x_m, 100.0 * body.y_m)
        if room_cm >= self.radius_cm and not self.bumped:
            return 0
        if room_cm >= self.plane.room_cm(100.0 * x_m, 100.0 * y_m) - _NO_NEARER_CM:
            return 0
        body.x_m, body.y_m = x_m, y_m
        return 1

    def _turns(self, motor: DcMotorPart, rear: DcMotorPart | None, tick: int) -> float:
        """Of the wheels of one side."""
        turns: float = motor.turns_at(tick)
        return turns if rear is None else 0.5 * (turns + rear.turns_at(tick))

    def look(self, tick: int) -> None:
        """Puts where it is at `tick` into `at_x_cm`, `at_y_cm`, `at_rad`, `cosine`, `sine`; changes nothing else."""
        body = self.body
        x_m, y_m, rad = body.x_m, body.y_m, body.theta_rad
        left, right = self.left_turns, self.right_turns
        if self.left is not None:
            self._roll(self._known(tick))
        self.at_x_cm, self.at_y_cm, self.at_rad = 100.0 * body.x_m, 100.0 * body.y_m, body.theta_rad
        body.x_m, body.y_m, body.theta_rad = x_m, y_m, rad
        self.left_turns, self.right_turns = left, right
        self.sine, self.cosine = dmath.sincos(self.at_rad)

    def _known(self, tick: int) -> int:
        """`tick`, or up to where all motors know how they turn."""
        for motor in (self.left, self.right, self.rear_left, self.rear_right):
            if motor is not None:
                tick = min(tick, motor.next_tick)
        return tick

    # What stands on it

    def top_speed(self, ahead_cm: float, left_cm: float) -> float:
        """The most cm a tick that a place of the body goes, by its wheels."""
        turning = (abs(ahead_cm) + abs(left_cm)) / self.half_track_cm
        return self.top_cm_tick * max(1.0, turning)

    def edge_cm(self, ahead_cm: float, left_cm: float) -> float:
        """Of a place of the body, after a `look`: see `Plane.edge_cm`."""
        return self.plane.edge_cm(
            self.at_x_cm + ahead_cm * self.cosine - left_cm * self.sine,
            self.at_y_cm + ahead_cm * self.sine + left_cm * self.cosine,
        )

    def echo_cm(self, tick: int, ahead_cm: float, left_cm: float, turned_deg: float) -> float:
        """Distance in cm measured by a ranger at a place of the body, turned counter-clockwise; below 0: no echo."""
        self.look(tick)
        sine, cosine = dmath.sincos(self.at_rad + turned_deg * _DEGREE_RAD)
        return self.plane.echo_cm(
            self.at_x_cm + ahead_cm * self.cosine - left_cm * self.sine,
            self.at_y_cm + ahead_cm * self.sine + left_cm * self.cosine,
            cosine,
            sine,
        )

    # Tests

    def put(self, name: str, value: Any, tick: int) -> None:
        self.speed_changed(self._known(tick) if self.left is not None else tick)
        self.bumped = 0
        body = self.body
        if name == "x_cm":
            body.x_m = 0.01 * value
        elif name == "y_cm":
            body.y_m = 0.01 * value
        else:
            body.theta_rad = value * _DEGREE_RAD
        for part in self.on_body:
            part.displaced(tick)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        if name == "bumped":
            return bool(self.bumped)
        if name == "bumps":
            return self.bumps
        if name == "speed_cm_s":
            return self._speed_cm_s()
        self.look(tick)
        if name == "heading_deg":
            return self.at_rad / _DEGREE_RAD
        return self.at_x_cm if name == "x_cm" else self.at_y_cm

    def _speed_cm_s(self) -> float:
        motors = [
            wheel for wheel in (self.left, self.right, self.rear_left, self.rear_right) if wheel is not None
        ]
        rad_s = 0.0
        for motor in motors:
            rad_s += motor.rad_s
        return 0.0 if self.bumped or not motors else 100.0 * self.radius_m * rad_s / len(motors)
