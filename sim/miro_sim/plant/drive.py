# cython: cdivision=True
# No divisor below is ever zero: `Winding` and `Body` divide by all resistances and lengths when they are made.
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

from miro_exact import dmath
from miro_exact.rng import Stream
from miro_exact.state import TICK
from miro_robot.lm629.chip import Lm629
from miro_robot.plant import Plant
from miro_sim.plant.chassis import Body
from miro_sim.plant.params import DriveParams
from miro_sim.plant.rough import RoughBody

LONGEST_STEP = 2048  # one PWM period
TICK_S = 1.0 / 24e6
_LARGEST = 1.7976931348623157e308
_ANGLES = 1.6e6  # `dmath.ANGLE_LIMIT`
_MOST_COUNTS = 1 << 50  # doubles still hold fractions of it


class Winding:
    """Current (A, positive drives forward) in one motor and the state of its bridge.

    The winding's time constant (13 us driven, 22 us through the diodes) is shorter than a PWM period (85 us):
    the current ripples fully and stands at zero for part of the period at light load, so no average-voltage model
    holds. With the current i positive the bridge puts a voltage `up` on the winding, with i negative `down`:

        bridge               up                      down
        driving forward      VS - drop (transistors) VS + 2 Vf (diodes)
        driving backward     -(VS + 2 Vf) (diodes)   -(VS - drop) (transistors)
        off                  -(VS + 2 Vf) (diodes)   VS + 2 Vf (diodes)

    and L di/dt = voltage - emf - R i, R being that of winding, battery and, where transistors conduct, bridge.
    As up < down, the current that reaches zero stays there while up <= emf <= down, else it goes on with the
    other sign: at most one change of sign in an interval. Source: L298 data sheet (no internal diodes).

    The bridge follows its inputs late. A change of the inputs starts a delay: that of turning on if the bridge is off,
    else that of turning off. When it is over, the bridge goes to what the inputs ask for. A change back before cancels
    it: a gap between two pulses that is shorter than the delay of turning off vanishes.
    """

    STATE = {
        "current_a": ("d", -1e6, 1e6),
        "drive": ("i", -1, 1),
        "wanted": ("i", -1, 1),
        "wait_ticks": ("i", 0, LONGEST_STEP),
    }
    NOT_STATE = (
        "on_ticks",
        "off_ticks",
        "drive_v",
        "diode_v",
        "ohm",
        "tau",
        "decay",
        "up_v",
        "down_v",
    )

    def __init__(self, params: DriveParams) -> None:
        motor = params.motor
        self.drive_v = params.battery.voltage_v - params.bridge.drop_v
        self.diode_v = params.battery.voltage_v + 2.0 * params.bridge.diode_v
        diode_ohm = motor.resistance_ohm + params.battery.resistance_ohm
        self.ohm = [diode_ohm, diode_ohm + params.bridge.drop_ohm]  # through diodes, through transistors
        self.tau = [motor.inductance_h / (ohm * TICK_S) for ohm in self.ohm]  # in ticks
        self.decay = [dmath.exp(-ticks / tau) for tau in self.tau for ticks in range(LONGEST_STEP + 1)]
        self.on_ticks = int(params.bridge.on_delay_s / TICK_S + 0.5)
        self.off_ticks = int(params.bridge.off_delay_s / TICK_S + 0.5)
        self.current_a = 0.0
        self.wanted = 0  # by the inputs
        self.wait_ticks = 0  # until the bridge does it; 0: it does
        self._switch(0)

    def set_bridge(self, enable: int, forward: int) -> None:
        """Inputs of the L298 half: enable pin and direction (1 forward, 0 backward), from now on."""
        wanted = 0
        if enable:
            wanted = 1 if forward else -1
        if wanted == self.wanted:
            return
        self.wanted = wanted
        self.wait_ticks = 0
        if wanted != self.drive:
            self.wait_ticks = self.off_ticks if self.drive != 0 else self.on_ticks
            if self.wait_ticks == 0:
                self._switch(wanted)

    def _switch(self, drive: int) -> None:
        """Makes the transistors drive forward (1) or backward (-1), or turns them off (0)."""
        self.drive = drive
        self.up_v = self.drive_v if self.drive > 0 else -self.diode_v
        self.down_v = -self.drive_v if self.drive < 0 else self.diode_v

    def step(self, ticks: int, emf_v: float) -> float:
        """Advances by 1..2048 ticks with the back-EMF held; returns the charge that passed, in A * ticks."""
        if ticks < 1 or ticks > LONGEST_STEP:
            raise ValueError(f"an interval lasts 1..2048 ticks, got {ticks}")
        return self._pass(ticks, emf_v)

    def _pass(self, ticks: int, emf_v: float) -> float:
        """The same unchecked; NaN where a result is not finite: the body's next angle raises DomainError."""
        wait = self.wait_ticks
        if wait == 0:
            return self._flow(ticks, emf_v)
        if wait > ticks:
            self.wait_ticks = wait - ticks
            return self._flow(ticks, emf_v)
        charge = self._flow(wait, emf_v)
        self.wait_ticks = 0
        self._switch(self.wanted)
        return charge if wait == ticks else charge + self._flow(ticks - wait, emf_v)

    def _flow(self, ticks: int, emf_v: float) -> float:
        """The charge of an interval in which the bridge does not switch."""
        start = self.current_a
        if start > 0.0 or (start == 0.0 and emf_v < self.up_v):
            positive = True
            voltage = self.up_v
            driven = self.drive > 0
        elif start < 0.0 or emf_v > self.down_v:
            positive = False
            voltage = self.down_v
            driven = self.drive < 0
        else:
            return 0.0  # blocked
        tau = self.tau[driven]
        final = (voltage - emf_v) / self.ohm[driven]
        end = final + (start - final) * self.decay[driven * (LONGEST_STEP + 1) + ticks]
        if (end >= 0.0) == positive or end == 0.0:
            self.current_a = end
            return final * ticks + tau * (start - end)
        ratio = 1.0 - start / final
        if not ratio <= _LARGEST:
            return ratio - ratio
        crossing = tau * dmath.log_within(ratio)
        self.current_a = 0.0
        return final * crossing + tau * start + self._onward(ticks - crossing, emf_v)

    def _onward(self, ticks: float, emf_v: float) -> float:
        """The rest of an interval in which the current came to zero: blocked, or on with the other sign."""
        if ticks <= 0.0:
            return 0.0
        if emf_v < self.up_v:
            voltage = self.up_v
            driven = self.drive > 0
        elif emf_v > self.down_v:
            voltage = self.down_v
            driven = self.drive < 0
        else:
            return 0.0
        tau = self.tau[driven]
        final = (voltage - emf_v) / self.ohm[driven]
        self.current_a = final * (1.0 - dmath.exp_within(-ticks / tau))
        return final * ticks - tau * self.current_a

    def after_load(self) -> None:
        """Raises ValueError unless the bridge waits exactly while it does not do what its inputs ask for."""
        longest = self.off_ticks if self.drive != 0 else self.on_ticks
        if (self.wait_ticks == 0) != (self.drive == self.wanted) or self.wait_ticks > longest:
            raise ValueError(f"a bridge at {self.drive} waits {self.wait_ticks} ticks for {self.wanted}")
        self._switch(self.drive)

    def __repr__(self) -> str:
        mode = "forward" if self.drive > 0 else "backward" if self.drive < 0 else "off"
        return f"Winding({mode}, {self.current_a!r} A)"


class Quadrature:
    """Position (counts, float) of one shaft and what A and B show of it: angle in, edges with their ticks out.

    Count n stands for positions n <= p < n + 1 (in quarter lines). Forward A leads B: (A, B) goes 00, 10, 11, 01.
    Inside a step the shaft turns evenly; an edge falls on the first integer tick at which p has the new count.
    """

    STATE = {
        "position": ("d", -_MOST_COUNTS, _MOST_COUNTS),
        "count": ("q", -_MOST_COUNTS, _MOST_COUNTS),
    }
    NOT_STATE = ("counts_per_radian", "counts_per_turn")

    def __init__(self, counts_per_radian: float, counts_per_turn: int = 0) -> None:
        self.counts_per_radian = counts_per_radian
        self.counts_per_turn = counts_per_turn  # 0: there is no index channel
        self.position = 0.5  # the rotor stands in the middle of a quarter line
        self.count = 0

    def turn(self, radians: float, start_tick: int, ticks: int, chip: Lm629 | None) -> None:
        """Turns the shaft evenly from `start_tick` on for `ticks`, and tells the LM629 of its edges in order."""
        moved = radians * self.counts_per_radian
        start = self.position
        position = start + moved
        self.position = position
        last = int(position)
        if last > position:
            last -= 1
        if last != self.count:
            self._cross(start, last, ticks / moved, start_tick, ticks, chip)

    def _cross(
        self, start: float, last: int, ticks_per_count: float, start_tick: int, ticks: int, chip: Lm629 | None
    ) -> None:
        """The edges from `count` to `last`. The index channel changes with A and B."""
        count = self.count
        while count != last:
            forward = last > count
            boundary = count + 1 if forward else count
            exact = (boundary - start) * ticks_per_count
            after = int(exact)
            if not forward or after < exact:
                after += 1  # forward the first tick at or after the crossing, backward the first beyond it
            after = min(max(after, 1), ticks)
            count += 1 if forward else -1
            self.count = count
            if chip is None:
                continue
            if chip.encoder_edges is None:
                chip.encoder.set_place(start_tick + after, count & 3)
            else:
                chip.set_encoder(start_tick + after, self.a(), self.b())
            if self.counts_per_turn:
                chip.set_index(start_tick + after, self.index())

    def a(self) -> int:
        """Level of channel A."""
        return ((self.count + 1) >> 1) & 1

    def b(self) -> int:
        """Level of channel B."""
        return (self.count >> 1) & 1

    def index(self) -> int:
        """Level of the index channel: low for one count a turn; high for good without one."""
        return 1 if self.counts_per_turn == 0 or self.count % self.counts_per_turn else 0

    def after_load(self) -> None:
        """Raises ValueError unless A and B show the position."""
        if not self.count <= self.position < self.count + 1:
            raise ValueError(f"count is {self.count} at position {self.position}")

    def __repr__(self) -> str:
        return f"Quadrature(position={self.position!r} A={self.a()} B={self.b()})"


def _other_tick(chip: Lm629) -> int:
    """The next tick at which the chip has more to do than to begin or end a pulse of PWM."""
    pulsing = chip.pwm_magnitude != 0 and chip.pulses != 0 and not chip.pulse_late
    return chip.sample_tick if pulsing else chip.next_tick


def _pass_edge(chip: Lm629, winding: Winding) -> None:
    """What `MotorAxis.advance` does at an edge, and the bridge's input after it."""
    if chip.pwm:
        chip.pwm = 0
        chip.next_tick = chip.period_tick + LONGEST_STEP
    else:
        chip.pwm = 1
        chip.period_tick = chip.next_tick
        chip.next_tick += 16 * chip.pwm_magnitude
    winding.set_bridge(chip.pwm, 1 - chip.sign)


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
            self._step(min(tick - self.tick, LONGEST_STEP), self.left, self.right)
        self.next_tick = self.tick + LONGEST_STEP

    def run_pulses(self, tick: int) -> int:
        """Steps and PWM edges one after the other, as the board does them by `advance`, the chips' and `set_bridge`."""
        left = self.left
        right = self.right
        if left is None or right is None:
            return 0
        begin = self.next_tick
        until = min(tick, _other_tick(left) - 1, _other_tick(right) - 1)
        if self.rough is None and min(begin, left.next_tick, right.next_tick) <= until:
            self._roll(until, left, right)
        while True:
            now = min(self.next_tick, left.next_tick, right.next_tick)
            if now > until:
                return self.next_tick != begin
            if self.tick < now:
                self._step(now - self.tick, left, right)
            self.next_tick = now + LONGEST_STEP
            if left.next_tick == now:
                _pass_edge(left, self.left_winding)
            if right.next_tick == now:
                _pass_edge(right, self.right_winding)

    def _roll(self, until: int, left: Lm629, right: Lm629) -> None:
        """The same up to and including `until` for wheels that only roll: `Body.push` in one loop over locals."""
        body = self.body
        left_winding, right_winding = self.left_winding, self.right_winding
        left_encoder, right_encoder = self.left_encoder, self.right_encoder
        constant = self.torque_constant_nm_a
        impulse = constant * TICK_S
        inverse_ll, inverse_lr, inverse_rr = body.inverse_ll, body.inverse_lr, body.inverse_rr
        left_rad_s, right_rad_s = body.left_rad_s, body.right_rad_s
        x_m, y_m, theta_rad = body.x_m, body.y_m, body.theta_rad
        begin = self.tick
        now = min(self.next_tick, left.next_tick, right.next_tick)
        while now <= until:
            ticks = now - begin
            if ticks > 0:
                left_nms = impulse * left_winding._pass(ticks, constant * left_rad_s)
                right_nms = impulse * right_winding._pass(ticks, constant * right_rad_s)
                if left_rad_s != 0.0 or right_rad_s != 0.0 or left_nms != 0.0 or right_nms != 0.0:
                    half_s = 0.5 * TICK_S * ticks
                    most = 2.0 * half_s * body.friction_nm
                    free_left = left_rad_s + inverse_ll * left_nms + inverse_lr * right_nms
                    free_right = right_rad_s + inverse_lr * left_nms + inverse_rr * right_nms
                    left_rub = most if free_left < 0.0 else -most
                    right_rub = most if free_right < 0.0 else -most
                    new_left = free_left + inverse_ll * left_rub + inverse_lr * right_rub
                    new_right = free_right + inverse_lr * left_rub + inverse_rr * right_rub
                    if not (new_left * free_left > 0.0 and new_right * free_right > 0.0):
                        body._rub(free_left, free_right, most)
                        new_left, new_right = body.left_rad_s, body.right_rad_s
                    turned_left = half_s * (left_rad_s + new_left)
                    turned_right = half_s * (right_rad_s + new_right)
                    left_rad_s, right_rad_s = new_left, new_right
                    if turned_left != 0.0 or turned_right != 0.0:
                        left_m = body.left_m_rad * turned_left
                        right_m = body.right_m_rad * turned_right
                        half = 0.5 * (right_m - left_m) / body.track_m
                        chord_m = 0.5 * (left_m + right_m) * (1.0 - half * half / 6.0)
                        angle = theta_rad + half
                        if not -_ANGLES < angle < _ANGLES:
                            dmath.sincos(angle)  # raises DomainError
                        sine, cosine = dmath.sincos_within(angle)
                        x_m = x_m + chord_m * cosine
                        y_m = y_m + chord_m * sine
                        theta_rad = theta_rad + 2.0 * half
                        left_encoder.turn(turned_left, begin, ticks, left)
                        right_encoder.turn(turned_right, begin, ticks, right)
                begin = now
            if left.next_tick == now:
                _pass_edge(left, left_winding)
            if right.next_tick == now:
                _pass_edge(right, right_winding)
            next_tick = now + LONGEST_STEP
            now = min(next_tick, left.next_tick, right.next_tick)
            self.next_tick = next_tick
        self.tick = begin
        body.left_rad_s, body.right_rad_s = left_rad_s, right_rad_s
        body.x_m, body.y_m, body.theta_rad = x_m, y_m, theta_rad

    def _step(self, ticks: int, left: Lm629 | None, right: Lm629 | None) -> None:
        constant = self.torque_constant_nm_a
        start_tick = self.tick
        if self.rough is not None:
            self.rough.feel(start_tick + (ticks >> 1))
        left_charge = self.left_winding.step(ticks, constant * self.body.left_rad_s)
        right_charge = self.right_winding.step(ticks, constant * self.body.right_rad_s)
        self.body.push(constant * TICK_S * left_charge, constant * TICK_S * right_charge, ticks)
        self.tick = start_tick + ticks
        self.left_encoder.turn(self.body.turned_left_rad, start_tick, ticks, left)
        self.right_encoder.turn(self.body.turned_right_rad, start_tick, ticks, right)

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
