"""The parameters of a robot's drive: the figures of the default robot, each with its source.

Sources: Faulhaber 2224 006 SR catalogue figures, which close on themselves (no-load speed, stall torque and
the 11 ms time constant follow from them); ST L298 data sheet, total saturation drop; the robot is a MiroSot
cube of 7.5 cm and 0.5 kg.
"""

from typing import Annotated

from miro_sim.ranges import Ranged, Within

GRAVITY_M_S2 = 9.81
MAX_COUNTS_PER_S = 4e6  # encoder edges are simulated one by one
MIN_MOTOR_S = 1e-4
"""The plant steps by a PWM period, 85 us: the speed of a quicker motor would grow from step to step."""


class Motor(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A DC motor with precious-metal commutation: Faulhaber 2224 006 SR."""

    resistance_ohm: Annotated[float, Within(0.01, 1e3)] = 1.94
    inductance_h: Annotated[float, Within(1e-9, 1.0)] = 45e-6
    torque_constant_nm_a: Annotated[float, Within(1e-5, 10.0)] = 6.92e-3  # also V s / rad
    rotor_inertia_kg_m2: Annotated[float, Within(1e-13, 1e-2)] = 2.7e-7
    friction_nm: Annotated[float, Within(0.0, 1.0)] = 0.2e-3  # Coulomb, at the shaft: that of 29 mA


class Bridge(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """L298 with external fast diodes: total drop (source + sink) = drop_v + drop_ohm * |current|.

    The line goes through the sheet's typical saturations: source 1.35 V and sink 1.2 V at 1 A, 2.0 V and 1.7 V at 2 A.

    The PWM is on the enable pin. `on_delay_s` is T3(Ven) of the source, which turns on after the sink (T7, 0.25 us).
    `off_delay_s` is the mean of T5(Ven) of the sink, 2.2 us, and T1(Ven) of the source, 3 us. In the 0.8 us between the
    two the current goes round through the source and a diode and hardly falls; with this mean the charge of a pulse is
    within 2.5 % of that of the two switches one by one, from 4/128 on.
    """

    drop_v: Annotated[float, Within(0.0, 10.0)] = 1.4
    drop_ohm: Annotated[float, Within(0.0, 1e3)] = 1.15  # 2.55 V at 1 A, 3.7 V at 2 A
    diode_v: Annotated[float, Within(0.0, 10.0)] = 1.0  # each of the two that conduct
    on_delay_s: Annotated[float, Within(0.0, 20e-6)] = 0.3e-6
    off_delay_s: Annotated[float, Within(0.0, 20e-6)] = 2.6e-6


class Battery(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Six NiCd cells. Each motor sees the internal resistance by itself (no mutual sag)."""

    voltage_v: Annotated[float, Within(1e-3, 100.0)] = 7.2
    resistance_ohm: Annotated[float, Within(1e-9, 1e3)] = 0.15


class Chassis(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Two driven wheels on one axle through the centre of mass, two low-friction skids."""

    mass_kg: Annotated[float, Within(1e-3, 1e3)] = 0.5
    yaw_inertia_kg_m2: Annotated[float, Within(1e-6, 1e3)] = 4.7e-4  # 0.5 kg * (0.075**2 + 0.075**2) / 12
    track_m: Annotated[float, Within(1e-3, 10.0)] = 0.068
    wheel_radius_m: Annotated[float, Within(1e-3, 1.0)] = 0.020
    left_radius_factor: Annotated[float, Within(0.1, 10.0)] = 1.0  # real radius / wheel_radius_m
    right_radius_factor: Annotated[float, Within(0.1, 10.0)] = 1.0
    gear_ratio: Annotated[float, Within(0.1, 1e3)] = 8.0
    gear_efficiency: Annotated[float, Within(0.01, 1.0)] = 0.8  # acts on the rolling resistance only
    rolling_resistance: Annotated[float, Within(0.0, 10.0)] = 0.03  # force / weight
    stiction_ratio: Annotated[float, Within(1.0, 10.0)] = 1.0  # friction of a standing / a turning shaft
    gear_backlash_rad: Annotated[float, Within(0.0, 0.2)] = 0.0  # of a wheel while its motor shaft is held
    gear_load_friction: Annotated[float, Within(0.0, 0.5)] = 0.0  # friction / torque, at the motor shaft


class OpticalEncoder(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Optical encoder on the motor shaft; the LM629 counts every state change, 4 per line.

    With `index_pulse` it has a third channel, low for the one count in a turn that begins it (A = B = 0 there).
    """

    lines: Annotated[int, Within(16, 100_000)] = 512
    index_pulse: bool = False


class Tyre(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Friction between a wheel and the pitch: it slips beyond `grip` times its load, and never without `grip`."""

    grip: Annotated[float | None, Within(0.01, 10.0)] = None  # rubber on a painted board about 0.8


class RollingBall(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The ball that the robot rests on beside its wheels (paper, section V-A): friction against its way on the ground.

    It carries `load_share` of the weight, which the wheels then do not press with. 0.03 m and a fifth: chosen.
    """

    friction: Annotated[float, Within(0.0, 10.0)] = 0.0  # force / load of the ball, whichever way it goes
    load_share: Annotated[float, Within(0.0, 0.9)] = 0.2
    behind_m: Annotated[float, Within(-0.1, 0.1)] = 0.03  # behind the axle's middle; negative: in front


class Disturbance(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A force along the robot's axis (forward) and a yaw torque (counter-clockwise) on its body.

    Added up: a constant, a sine from tick 0 on, and noise, which is drawn again every period within +- the bound.
    """

    force_n: Annotated[float, Within(-5.0, 5.0)] = 0.0
    torque_nm: Annotated[float, Within(-0.1, 0.1)] = 0.0
    sine_force_n: Annotated[float, Within(0.0, 5.0)] = 0.0
    sine_torque_nm: Annotated[float, Within(0.0, 0.1)] = 0.0
    noise_force_n: Annotated[float, Within(0.0, 5.0)] = 0.0
    noise_torque_nm: Annotated[float, Within(0.0, 0.1)] = 0.0
    period_s: Annotated[float, Within(0.001, 3600.0)] = 1.0  # of the sine, and how long a draw holds

    def is_on(self) -> bool:
        """True if there is any force or torque."""
        return any(getattr(self, name) for name in self.__struct_fields__ if name != "period_s")


class DriveParams(Ranged, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Everything `DifferentialDrive` needs to know about a robot."""

    motor: Motor = Motor()
    bridge: Bridge = Bridge()
    battery: Battery = Battery()
    chassis: Chassis = Chassis()
    encoder: OpticalEncoder = OpticalEncoder()
    tyre: Tyre = Tyre()
    ball: RollingBall = RollingBall()
    disturbance: Disturbance = Disturbance()

    def __post_init__(self) -> None:
        motor, voltage_v = self.motor, self.battery.voltage_v
        constant = motor.torque_constant_nm_a
        counts_per_s = voltage_v / constant * self.counts_per_radian()
        if counts_per_s > MAX_COUNTS_PER_S:
            raise ValueError(
                f"{voltage_v} V, {constant} Nm/A and {self.encoder.lines} lines make {counts_per_s:.3g} counts/s"
                f" without load; at most {MAX_COUNTS_PER_S:.0f} (the LM629 itself follows 1000000)"
            )
        # The shortest that it has, of a motor alone: shorted through battery and diodes.
        ohm = motor.resistance_ohm + self.battery.resistance_ohm
        motor_s = motor.rotor_inertia_kg_m2 * ohm / (constant * constant)
        if motor_s < MIN_MOTOR_S:
            raise ValueError(
                f"motor: {motor.rotor_inertia_kg_m2:g} kg m2, {ohm:g} ohm with the battery and {constant:g} Nm/A make"
                f" a time constant of {motor_s:.3g} s; at least {MIN_MOTOR_S:g} s (real motors: 0.001 to 0.1 s)"
            )

    def radius_m(self, side: int) -> float:
        """Wheel radius of side 0 (left) or 1 (right)."""
        body = self.chassis
        return body.wheel_radius_m * (body.right_radius_factor if side else body.left_radius_factor)

    def friction_nm(self) -> float:
        """Coulomb friction of one motor and half the robot's rolling resistance, at the motor shaft."""
        body = self.chassis
        rolling = 0.5 * body.rolling_resistance * body.mass_kg * GRAVITY_M_S2 * body.wheel_radius_m
        return self.motor.friction_nm + rolling / (body.gear_ratio * body.gear_efficiency)

    def top_speed_m_s(self) -> float:
        """No-load speed of the faster wheel at full battery: no robot drives faster by itself."""
        motor_rad_s = self.battery.voltage_v / self.motor.torque_constant_nm_a
        return motor_rad_s / self.chassis.gear_ratio * max(self.radius_m(0), self.radius_m(1))

    def counts_per_radian(self) -> float:
        """Encoder counts per radian of the motor shaft."""
        return 4.0 * self.encoder.lines / 6.283185307179586
