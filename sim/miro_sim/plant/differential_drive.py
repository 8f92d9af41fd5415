"""A differential drive as a part of a board: what stands behind the inputs of an L298.

               +---------------+
    en_a       |  half A       |   left_a left_b      A and B of the left encoder
    in1 in2    |     left wheel|   right_a right_b    of the right one
    en_b       |  half B       |   left_in right_in   index, where the encoders have it
    in3 in4    |    right wheel|
               +---------------+

The bridge with its delays and drops, motors, gears, wheels and encoders are `DifferentialDrive`. It knows driving and
coasting: with IN1 equal to IN2 it coasts. Encoder outputs go to an LM629 each, which is told of their edges directly:
they are known late, and late is early enough for a decoder that is asked at its samples.
"""

from __future__ import annotations

from typing import Any

from miro_exact.clock import NEVER_TICK
from miro_exact.plugins import PluginError
from miro_robot.parts.keys import IN, STRONG, PartKeys, Pin, Place
from miro_robot.parts.lm629 import CRYSTAL_HZ, Lm629Part
from miro_robot.parts.part import Part
from miro_robot.plant import Plant
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import DriveParams

_DEGREES = 57.29577951308232
_PINS = 3  # of a half of the bridge: EN and two IN
_HALF = 0x7  # as bits
_LEFT_A, _RIGHT_A = 6, 8


class Drive(PartKeys, frozen=True, kw_only=True, tag="differential_drive"):
    """A robot on two wheels that stands at the origin when it is switched on. `drive`: what it is made of."""

    PINS = (
        *(Pin(name, IN) for name in ("en_a", "in1", "in2", "en_b", "in3", "in4")),
        *(Pin(name, STRONG) for name in ("left_a", "left_b", "right_a", "right_b")),
        *(Pin(name, STRONG, optional=True) for name in ("left_in", "right_in")),
    )
    READS = {
        "x_cm": "from where it stood",
        "y_cm": "to the left of where it stood",
        "heading_deg": "counter-clockwise, not wrapped",
        "speed_m_s": "forward",
    }
    SHEET = "ST L298 data sheet: inputs, drops and delays (`drive.bridge`)"

    drive: DriveParams = DriveParams()

    def make(self, place: Place) -> Part:
        return DrivePart(self, place)


class DrivePart(Part):
    """`plant`: what moves; another one may be put in before the board is made, as a world does with its robot's.

    Its steps end at events of the two LM629 and at changes of the bridge's inputs, besides its own. That HI of an LM629
    falls is no step, though an event of the part: a step more would change the last bits of all that follow.
    """

    STATE = {"plant": Plant}
    NOT_STATE = ("left", "right", "on")
    CONTINUOUS = True

    def __init__(self, keys: Drive, place: Place) -> None:
        Part.__init__(self, keys, place)
        if place.crystal_hz != CRYSTAL_HZ:
            reason = f"part {place.name!r} ({keys.name}): its time is counted in ticks of 24 MHz"
            raise PluginError(reason, f"set crystal_hz = {CRYSTAL_HZ}")
        self.plant: Plant = DifferentialDrive(keys.drive)
        self.left: Any = None  # Lm629Part, from `start` on
        self.right: Any = None
        self.on = 1

    def _chip_at(self, pin: int) -> Lm629Part:
        """The LM629 at an encoder output. Raises PluginError."""
        for part, _ in self.place.peers.get(pin, []):
            if isinstance(part, Lm629Part):
                return part
        problem = f"no LM629 listens to pin {self.keys.PINS[pin].name}"
        raise PluginError(problem, "wire it to pin a of one")

    def start(self, tick: int) -> None:
        if self.left is None:
            self.left, self.right = self._chip_at(_LEFT_A), self._chip_at(_RIGHT_A)
            self.plant.attach(self.left.chip, self.right.chip)
        self._wait()

    def supply(self, on: int, tick: int) -> None:
        """Without it the bridge is off, and the wheels roll on."""
        for side in range(2):
            if self.levels >> _PINS * side & 1:
                self._put(side, tick, on)
        self.on = on
        if on:
            self.start(tick)

    def changed(self, pins: int, tick: int) -> None:
        for side in range(2):
            if pins >> _PINS * side & _HALF:
                self._put(side, tick, self.on)
        self._wait()

    def _put(self, side: int, tick: int, on: int) -> None:
        """The inputs of half a bridge."""
        levels = self.levels >> _PINS * side
        forward, backward = levels >> 1 & 1, levels >> 2 & 1
        self.plant.set_bridge(tick, side, levels & on & (forward ^ backward), forward)

    def advance(self, tick: int) -> None:
        chips_tick = min(self.left.chip.next_tick, self.right.chip.next_tick)
        if min(self.next_tick, chips_tick) <= tick:
            self.plant.advance(tick)
            self._wait()

    def due(self, tick: int) -> None:
        self.plant.advance(tick)
        self._wait()

    def _wait(self) -> None:
        self.next_tick = self.plant.next_tick
        self.reach_tick = NEVER_TICK  # an LM629 that counts says nothing by itself

    def read(self, name: str, tick: int) -> float | int | bool | str:
        plant = self.plant
        assert isinstance(plant, DifferentialDrive)
        x_m, y_m, heading_rad = plant.pose_at(tick)
        values = {
            "x_cm": 100.0 * x_m,
            "y_cm": 100.0 * y_m,
            "heading_deg": heading_rad * _DEGREES,
            "speed_m_s": plant.velocity_at(tick)[0],
        }
        return values[name]
