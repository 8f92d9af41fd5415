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

from functools import lru_cache

from miro_exact import dmath
from miro_exact.clock import NEVER_TICK
from miro_exact.rng import Stream
from miro_exact.state import FLAG, TICK
from miro_robot.lm629.chip import Lm629
from miro_robot.plant import Plant
from miro_sim.plant.chassis import Body
from miro_sim.plant.params import DriveParams
from miro_sim.plant.rough import RoughBody

LONGEST_STEP = 2048  # one PWM period
TICK_S = 1.0 / 24e6
_NEVER = NEVER_TICK
_LARGEST = 1.7976931348623157e308
_MOST_STEPS = 16
_KEPT = 8  # tables of decay: of 32 kB
_MOST_COUNTS = 1 << 50  # doubles still hold fractions of it


class Decay:
    """Remaining share of a current after each number of ticks, through diodes and then through transistors."""

    NOT_STATE = ("*",)

    def __init__(self, taus: tuple[float, float]) -> None:
        self.share = [dmath.exp(-ticks / tau) for tau in taus for ticks in range(LONGEST_STEP + 1)]


_decay = lru_cache(_KEPT)(Decay)
"""One for all windings with these time constants (in ticks): it takes longer to make than all else of a robot."""


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
        "is_open": FLAG,
    }
    NOT_STATE = ("on_ticks", "off_ticks", "decay", "volts", "volt", "ohm", "tau", "row")
    NOT_HASHED = ("is_open",)  # a fault: what it does to the current is hashed

    def __init__(self, params: DriveParams) -> None:
        motor = params.motor
        driven = params.battery.voltage_v - params.bridge.drop_v
        diodes = params.battery.voltage_v + 2.0 * params.bridge.diode_v
        through_diodes = motor.resistance_ohm + params.battery.resistance_ohm
        through_transistors = through_diodes + params.bridge.drop_ohm
        ohms = (through_diodes, through_transistors)
        diode_tau, transistor_tau = (motor.inductance_h / (ohm * TICK_S) for ohm in ohms)
        self.decay = _decay((diode_tau, transistor_tau))
        # Driving backward, off, driving forward; for each a current below zero, then one above it.
        self.volts = [-driven, -diodes, diodes, -diodes, diodes, driven]
        self.volt = [0.0] * 6
        self.open(0)
        self.ohm = [through_transistors, *[through_diodes] * 4, through_transistors]
        self.tau = [transistor_tau, *[diode_tau] * 4, transistor_tau]
        self.row = [LONGEST_STEP + 1, 0, 0, 0, 0, LONGEST_STEP + 1]  # of `decay`
        self.on_ticks = int(params.bridge.on_delay_s / TICK_S + 0.5)
        self.off_ticks = int(params.bridge.off_delay_s / TICK_S + 0.5)
        self.current_a = 0.0
        self.drive = 0
        self.wanted = 0  # by the inputs
        self.wait_ticks = 0  # until the bridge does it; 0: it does

    def open(self, is_open: int) -> None:
        """Fault: the circuit is open from now on, and no current flows; 0: it is whole.

        An open winding needs no branch in `_flow`: no back-EMF lies outside of these voltages.
        """
        self.is_open = is_open
        for kind in range(6):
            self.volt[kind] = self.volts[kind] if not is_open else -_LARGEST if kind & 1 else _LARGEST
        if is_open:
            self.current_a = 0.0

    def ask(self, wanted: int) -> None:
        """The inputs ask the transistors to drive forward (1), backward (-1) or not (0)."""
        if wanted == self.wanted:
            return
        self.wanted = wanted
        self.wait_ticks = 0
        if wanted != self.drive:
            self.wait_ticks = self.off_ticks if self.drive != 0 else self.on_ticks
            if self.wait_ticks == 0:
                self.drive = wanted

    def pass_edge(self, chip: Lm629) -> int:
        """Executes `Lm629.advance` at an edge, and updates the bridge's input. Returns the tick of the next edge."""
        if chip.pwm:
            chip.pwm = 0
            chip.next_tick = chip.period_tick + LONGEST_STEP
            self.ask(0)
        else:
            chip.pwm = 1
            chip.period_tick = chip.next_tick
            chip.next_tick += 16 * chip.pwm_magnitude
            self.ask(-1 if chip.sign else 1)
        return chip.next_tick

    def step(self, ticks: int, emf_v: float) -> float:
        """Advances by 1..2048 ticks with the back-EMF held; returns the charge that passed, in A * ticks."""
        if ticks < 1 or ticks > LONGEST_STEP:
            raise ValueError(f"an interval lasts 1..2048 ticks, got {ticks}")
        return self._pass(ticks, emf_v)

    def _pass(self, ticks: int, emf_v: float) -> float:
        """`step` without the check. NaN if a result is not finite: the body's next angle raises DomainError."""
        wait = self.wait_ticks
        if wait == 0 or wait > ticks:
            self.wait_ticks = wait - ticks if wait else 0
            return self._flow(ticks, emf_v)
        charge = self._flow(wait, emf_v)
        self.wait_ticks = 0
        self.drive = self.wanted
        return charge + self._flow(ticks - wait, emf_v) if wait < ticks else charge

    def _flow(self, ticks: int, emf_v: float) -> float:
        """The charge of an interval in which the bridge does not switch."""
        start = self.current_a
        kind = 2 * self.drive + 3
        if start < 0.0:
            kind -= 1
        elif start == 0.0:
            if emf_v > self.volt[kind - 1]:
                kind -= 1
            elif not emf_v < self.volt[kind]:
                return 0.0  # blocked
        final = (self.volt[kind] - emf_v) / self.ohm[kind]
        end = final + (start - final) * self.decay.share[self.row[kind] + ticks]
        goes_on = end >= 0.0 if kind & 1 else not end > 0.0
        if goes_on:
            self.current_a = end
            return final * ticks + self.tau[kind] * (start - end)
        return self._through_zero(ticks, emf_v, final, self.tau[kind])

    def _through_zero(self, ticks: int, emf_v: float, final: float, tau: float) -> float:
        """The charge of an interval in which the current comes to zero on its way to `final`."""
        start = self.current_a
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
        kind = 2 * self.drive + 3
        if emf_v > self.volt[kind - 1]:
            kind -= 1
        elif not emf_v < self.volt[kind]:
            return 0.0
        final = (self.volt[kind] - emf_v) / self.ohm[kind]
        self.current_a = final * (1.0 - dmath.exp_within(-ticks / self.tau[kind]))
        return final * ticks - self.tau[kind] * self.current_a

    def rests(self) -> bool:
        """True if no current flows and the bridge is off and stays so: nothing drives a shaft that stands."""
        return self.current_a == 0.0 and self.drive == 0 and self.wait_ticks == 0

    def after_load(self) -> None:
        """Raises ValueError unless the bridge waits exactly while it does not do what its inputs ask for."""
        longest = self.off_ticks if self.drive != 0 else self.on_ticks
        if (self.wait_ticks == 0) != (self.drive == self.wanted) or self.wait_ticks > longest:
            raise ValueError(f"a bridge at {self.drive} waits {self.wait_ticks} ticks for {self.wanted}")
        if self.is_open and self.current_a != 0.0:
            raise ValueError(f"{self.current_a} A flow in an open winding")
        self.open(self.is_open)

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
        "held_a": ("i", -1, 1),
        "held_b": ("i", -1, 1),
    }
    NOT_STATE = ("counts_per_radian", "counts_per_turn", "chip", "positions", "counts")
    NOT_HASHED = ("held_a", "held_b")  # a fault: what it does to the LM629 is hashed

    def __init__(self, counts_per_radian: float, counts_per_turn: int = 0) -> None:
        self.counts_per_radian = counts_per_radian
        self.counts_per_turn = counts_per_turn  # 0: there is no index channel
        self.position = 0.5  # the rotor stands in the middle of a quarter line
        self.count = 0
        self.held_a = -1
        self.held_b = -1
        self.chip: Lm629 | None = None
        # At the start of the last turn and at the ends of its steps.
        self.positions = [0.0] * 17
        self.counts = [0] * 17

    def turn(self, radians: list[float], ticks: list[int]) -> None:
        """Turns the shaft in at most 16 steps between these ticks, evenly in each, and tells the LM629 of the edges."""
        spare = [0] * (_MOST_STEPS - len(radians))
        c_radians = radians + spare
        c_ticks = ticks + spare
        self._turn(c_radians, c_ticks, len(radians))

    def _turn(self, radians: list[float], ticks: list[int], steps: int) -> None:
        chip = self.chip
        least = 4.0  # ticks a count in which its decoder counts each edge
        if chip is not None:
            least += chip.encoder.spacing
        slow = True
        edges = 0
        position = self.position
        count = self.count
        self.positions[0] = position
        self.counts[0] = count
        for step in range(steps):
            moved = radians[step] * self.counts_per_radian
            before = count
            position = position + moved
            count = int(position)
            if count > position:
                count -= 1
            edges += abs(count - before)
            if abs(moved) * least > ticks[step + 1] - ticks[step]:
                slow = False
            self.positions[step + 1] = position
            self.counts[step + 1] = count
        self.position = position
        self.count = count
        if edges and chip is not None:
            one_way = edges == abs(count - self.counts[0])
            if not (slow and one_way and self._tell_run(chip, radians, ticks, steps, edges)):
                self._tell_each(chip, radians, ticks, steps)

    def _tell_run(self, chip: Lm629, radians: list[float], ticks: list[int], steps: int, edges: int) -> int:
        """Tells of edges one way all at once. Returns whether the decoder takes it."""
        if chip.encoder_edges is not None or self.counts_per_turn or self.held_a >= 0 or self.held_b >= 0:
            return 0
        first = 0
        while self.counts[first + 1] == self.counts[0]:
            first += 1
        way = 1 if self.count > self.counts[0] else -1
        before = self.count - way
        step = self._step_to(self.count, steps - 1)
        last_tick = self._edge_tick(radians, ticks, step, before)
        before_tick = last_tick
        if edges > 1:
            step = self._step_to(before, step)
            before_tick = self._edge_tick(radians, ticks, step, before - way)
        return chip.encoder.set_run(ticks[first], before_tick, last_tick, edges, way, self.count)

    def _step_to(self, count: int, step: int) -> int:
        """The step that came to this count, `step` or before."""
        while self.counts[step] == count:
            step -= 1
        return step

    def _tell_each(self, chip: Lm629, radians: list[float], ticks: list[int], steps: int) -> None:
        """Tells of one edge after the other."""
        self.count = self.counts[0]
        for step in range(steps):
            while self.count != self.counts[step + 1]:
                tick = self._edge_tick(radians, ticks, step, self.count)
                self.count += 1 if radians[step] > 0.0 else -1
                self._show(tick, chip)

    def _edge_tick(self, radians: list[float], ticks: list[int], step: int, count: int) -> int:
        """The tick of the edge that leads away from a count in a step."""
        length = ticks[step + 1] - ticks[step]
        moved = radians[step] * self.counts_per_radian
        forward = moved > 0.0
        exact = ((count + 1 if forward else count) - self.positions[step]) * (length / moved)
        after = int(exact)
        if not forward or after < exact:
            after += 1  # forward the first tick at or after the crossing, backward the first beyond it
        return ticks[step] + min(max(after, 1), length)

    def attach(self, tick: int, chip: Lm629) -> None:
        """Wires the outputs to the LM629 and shows it the levels of now."""
        self.chip = chip
        self._show(tick, chip)

    def hold(self, a: int, b: int) -> None:
        """Fault: from the shaft's next edge on the wire of A or B shows this level; -1: it is whole."""
        self.held_a = a
        self.held_b = b

    def _show(self, tick: int, chip: Lm629) -> None:
        """Shows the LM629 the levels of A and B, and of the index channel if there is one: it changes with them."""
        chip.set_encoder(tick, self.a(), self.b())
        if self.counts_per_turn:
            chip.set_index(tick, self.index())

    def a(self) -> int:
        """Level of channel A."""
        return ((self.count + 1) >> 1) & 1 if self.held_a < 0 else self.held_a

    def b(self) -> int:
        """Level of channel B."""
        return (self.count >> 1) & 1 if self.held_b < 0 else self.held_b

    def index(self) -> int:
        """Level of the index channel: low for one count a turn; high for good without one."""
        return 1 if self.counts_per_turn == 0 or self.count % self.counts_per_turn else 0

    def after_load(self) -> None:
        """Raises ValueError unless A and B show the position."""
        if not self.count <= self.position < self.count + 1:
            raise ValueError(f"count is {self.count} at position {self.position}")

    def __repr__(self) -> str:
        return f"Quadrature(position={self.position!r} A={self.a()} B={self.b()})"


def is_rough(params: DriveParams) -> bool:
    """True if anything is on that `chassis.Body` does not know: then the body is a `rough.RoughBody`."""
    chassis = params.chassis
    rubs = chassis.stiction_ratio > 1.0 or chassis.gear_load_friction > 0.0 or params.ball.friction > 0.0
    plays = params.tyre.grip is not None or chassis.gear_backlash_rad > 0.0
    return rubs or plays or params.disturbance.is_on()


def _other_tick(chip: Lm629) -> int:
    """The next tick at which the chip has more to do than to begin or end a pulse of PWM."""
    pulsing = chip.pwm_magnitude != 0 and chip.pulses != 0 and not chip.pulse_late
    return chip.sample_tick if pulsing else chip.next_tick


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
    NOT_STATE = ("left", "right", "params", "torque_constant_nm_a", "rough", "ticks")

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
        self.ticks = [0] * 17  # `tick` and the ends of the steps since then
        self.left_winding = Winding(params)
        self.right_winding = Winding(params)
        counts = 4 * params.encoder.lines if params.encoder.index_pulse else 0
        self.left_encoder = Quadrature(params.counts_per_radian(), counts)
        self.right_encoder = Quadrature(params.counts_per_radian(), counts)
        self.rough = RoughBody(params, x_m, y_m, theta_rad, noise) if is_rough(params) else None
        self.body = Body(params, x_m, y_m, theta_rad) if self.rough is None else self.rough

    def attach(self, left: Lm629, right: Lm629) -> None:
        """Wires the encoder outputs to the two LM629 and shows these the levels of now."""
        self.left = left
        self.right = right
        self.left_encoder.attach(self.tick, left)
        self.right_encoder.attach(self.tick, right)

    def advance(self, tick: int) -> None:
        """Integrates to `tick` (a tick that is past already: nothing)."""
        if self.tick < tick:
            self._run(tick, tick, _NEVER, _NEVER)

    def run_pulses(self, tick: int) -> int:
        """Steps and PWM edges one after the other, as the board does them by `advance`, the chips' and `set_bridge`.

        Where a chip has more to do by `tick`, the last step ends there.
        """
        left = self.left
        right = self.right
        if left is None or right is None or min(self.next_tick, left.next_tick, right.next_tick) > tick:
            return 0
        begin = self.tick
        other = min(_other_tick(left), _other_tick(right))
        self._run(tick, other, left.next_tick, right.next_tick)
        return self.tick != begin

    def _run(self, until: int, last: int, left_tick: int, right_tick: int) -> None:
        """Steps that end by `until`, until one has ended at `last`; edges of PWM from these two ticks on."""
        if last <= left_tick and last <= right_tick and self._stands():
            end = last if last <= until else until - (until - self.tick) % LONGEST_STEP
            self.tick = max(self.tick, end)
            self.next_tick = self.tick + LONGEST_STEP
            return
        left = self.left
        right = self.right
        constant = self.torque_constant_nm_a
        impulse = constant * TICK_S
        begin = self.tick
        self.ticks[0] = begin
        steps = 0
        now = min(begin + LONGEST_STEP, last, left_tick, right_tick)
        while now <= until:
            if begin < now:
                ticks = now - begin
                if steps == _MOST_STEPS:
                    self._move(steps)
                    steps = 0
                if self.rough is not None and self.rough.forces.is_on:
                    self.rough.forces.at(begin + (ticks >> 1))
                left_charge = self.left_winding._pass(ticks, constant * self.body.left_rad_s)
                right_charge = self.right_winding._pass(ticks, constant * self.body.right_rad_s)
                self.body._push(impulse * left_charge, impulse * right_charge, ticks, steps)
                steps += 1
                self.ticks[steps] = now
                begin = now
            if now == last:
                break
            if now == left_tick and left is not None:
                left_tick = self.left_winding.pass_edge(left)
            if now == right_tick and right is not None:
                right_tick = self.right_winding.pass_edge(right)
            now = min(begin + LONGEST_STEP, last, left_tick, right_tick)
        self._move(steps)
        self.next_tick = begin + LONGEST_STEP

    def _stands(self) -> bool:
        """True if all steps up to the next edge of PWM change nothing."""
        if self.body.left_rad_s != 0.0 or self.body.right_rad_s != 0.0:
            return False
        still = self.rough is None or self.rough.stands()
        return still and self.left_winding.rests() and self.right_winding.rests()

    def _move(self, steps: int) -> None:
        """Posture and encoders follow what the shafts turned in these steps."""
        body = self.body
        body._roll(steps)
        self.left_encoder._turn(body.turned_left_rad, self.ticks, steps)
        self.right_encoder._turn(body.turned_right_rad, self.ticks, steps)
        self.tick = self.ticks[steps]
        self.ticks[0] = self.tick

    def set_bridge(self, tick: int, side: int, enable: int, forward: int) -> None:
        """L298 inputs of one side (0 left, 1 right) from `tick` on: enable pin; 1 forward, 0 backward."""
        if self.tick < tick:
            self.advance(tick)
        winding = self.right_winding if side else self.left_winding
        winding.ask((1 if forward else -1) if enable else 0)

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
