"""The drive of one robot: two bridges, two motors, gears, wheels, chassis and encoders behind `Plant`.

    battery --> L298 half --U--> winding --i--> shaft impulse --+
      EN, IN1, IN2 ^              ^ e = kM w                    v
                                  +------- shaft speeds <-- inertia of both wheels (coupled), friction
                                                |
    A, B to the LM629 <-- quadrature <-- angle -+--> posture (x, y, heading)        once per step, left and right

A step of at most one PWM period: currents with the back-EMF of its start, shaft impulses kM * charge,
friction, mean of old and new speed into angle and posture, edges interpolated inside it. Holding the back-EMF
makes energy only to second order, (kM charge)2 / 2J: by Cauchy-Schwarz less than step / (2 time constant),
0.4 % here, of what the same current loses in the winding. So the balance of the drive is never positive.
"""

from __future__ import annotations

from miro_exact.rng import Stream
from miro_exact.state import TICK
from miro_robot.lm629.chip import Lm629
from miro_robot.plant import Plant
from miro_sim.plant.chassis import Body
from miro_sim.plant.circuit import Winding
from miro_sim.plant.encoder import Quadrature
from miro_sim.plant.params import DriveParams
from miro_sim.plant.rough import RoughBody

LONGEST_STEP = 2048
TICK_S = 1.0 / 24e6


class DifferentialDrive(Plant):
    """A robot that stands at (x_m, y_m) with heading theta_rad at tick 0, bridges off, A = B = 0.

    `noise`: draws of the disturbing force, if `params` have any. Its value in the middle of a step holds for all of it.
    """

    STATE: dict[str, object] = {
        "tick": TICK,
        "left_winding": Winding,
        "right_winding": Winding,
        "left_encoder": Quadrature,
        "right_encoder": Quadrature,
        "body": Body,
    }
    NOT_STATE = ("left", "right", "params", "torque_constant_nm_a", "rough")

    def __init__(
        self,
        params: DriveParams,
        x_m: float = 0.0,
        y_m: float = 0.0,
        theta_rad: float = 0.0,
        noise: Stream | None = None,
    ) -> None:
        super().__init__()
        self.params = params
        self.torque_constant_nm_a = params.motor.torque_constant_nm_a
        self.tick = 0
        self.next_tick = LONGEST_STEP
        self.left_winding = Winding(params)
        self.right_winding = Winding(params)
        counts = 4 * params.encoder.lines if params.encoder.index_pulse else 0
        self.left_encoder = Quadrature(params.counts_per_radian(), counts)
        self.right_encoder = Quadrature(params.counts_per_radian(), counts)
        self.rough = RoughBody(params, x_m, y_m, theta_rad, noise) if params.is_rough() else None
        self.body = Body(params, x_m, y_m, theta_rad) if self.rough is None else self.rough

    def attach(self, left: Lm629, right: Lm629) -> None:
        """Wires the encoder outputs to the two LM629 and shows these the levels of now."""
        self.left = left
        self.right = right
        left.set_encoder(self.tick, self.left_encoder.a(), self.left_encoder.b())
        right.set_encoder(self.tick, self.right_encoder.a(), self.right_encoder.b())
        self._show_index(left, self.left_encoder, self.tick)
        self._show_index(right, self.right_encoder, self.tick)

    def advance(self, tick: int) -> None:
        """Integrates to `tick` (a tick that is past already: nothing)."""
        while self.tick < tick:
            self._step(min(tick - self.tick, LONGEST_STEP))
        self.next_tick = self.tick + LONGEST_STEP

    def _step(self, ticks: int) -> None:
        constant = self.torque_constant_nm_a
        start_tick = self.tick
        if self.rough is not None:
            self.rough.feel(start_tick + (ticks >> 1))
        left_charge = self.left_winding.step(ticks, constant * self.body.left_rad_s)
        right_charge = self.right_winding.step(ticks, constant * self.body.right_rad_s)
        self.body.push(constant * TICK_S * left_charge, constant * TICK_S * right_charge, ticks)
        self.tick = start_tick + ticks
        self.left_encoder.turn(self.body.turned_left_rad, start_tick, ticks, self.left)
        self.right_encoder.turn(self.body.turned_right_rad, start_tick, ticks, self.right)

    def _show_index(self, chip: Lm629, encoder: Quadrature, tick: int) -> None:
        """The index channel changes with A and B."""
        if encoder.counts_per_turn:
            chip.set_index(tick, encoder.index())

    def set_bridge(self, tick: int, side: int, enable: int, forward: int) -> None:
        """L298 inputs of one side (0 left, 1 right) from `tick` on: enable pin; 1 forward, 0 backward."""
        if self.tick < tick:
            self.advance(tick)
        if side == 0:
            self.left_winding.set_bridge(enable, forward)
        else:
            self.right_winding.set_bridge(enable, forward)

    def pose_at(self, tick: int) -> tuple[float, float, float]:
        """(x m, y m, unwrapped heading rad) at `tick`, at constant speed since the last step; pure."""
        return self.body.pose_after(tick - self.tick)

    def velocity_at(self, tick: int) -> tuple[float, float]:
        """(m/s forward, rad/s counter-clockwise) at `tick`, constant since the last step; pure."""
        return self.body.velocity()

    def after_load(self) -> None:
        self.next_tick = self.tick + LONGEST_STEP

    def __repr__(self) -> str:
        return (
            f"DifferentialDrive(tick={self.tick} {self.body!r} {self.left_winding!r} {self.right_winding!r})"
        )
