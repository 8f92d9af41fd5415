"""The scenario: everything about a run that is chosen rather than drawn, as frozen structs.

Every key carries its unit. Defaults are the "realistic" set: a rendered picture, a calibration that is wrong by up to
2.40 cm, one camera frame of vision delay, 3 ms of computing, a keyed carrier and a
bit-error rate of 1e-4.
"""

from typing import Annotated, Any, ClassVar, Literal

import msgspec
from msgspec import Meta

from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND, ticks
from miro_host.integrator import Integration
from miro_host.registries import (
    DEFAULT_ESTIMATOR,
    DEFAULT_LAW,
    ESTIMATORS,
    LAWS,
    AnyEstimator,
    AnyReference,
    Controller,
)
from miro_host.wheels import MAX_WORD_BITS, MIN_WORD_BITS
from miro_protocol.table import DOWNLINK
from miro_robot.lm629.options import DEFAULT_OPTIONS, Lm629Options
from miro_sim.plant.params import Chassis, DriveParams
from miro_sim.radio.params import Radio
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.camera_keys import Camera, PitchCm, PixelCamera
from miro_sim.scenario.plugins import plugin_of

MAX_NETWORKS = 32  # building and simulating one takes as long as a whole run of fig6

Duration = Annotated[float, Meta(gt=0.0, le=86_400.0)]
TurnRad = Annotated[float, Meta(ge=-3.141592653589793, le=3.141592653589793)]
Name = Annotated[str, Meta(pattern=r"\A[a-z0-9][a-z0-9_-]{0,63}\Z")]


class HostSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The PC: how long it computes between camera frame and key-up, how it integrates, how long its words are.

    `integration`: of equation (15), see `miro_host.integrator`. `word_bits`: of each wheel speed of full scale 2.88 m/s
    that is sent; 16 is a step of 0.088 mm/s, each bit less doubles it.
    """

    compute_s: Annotated[float, Meta(ge=0.00001, le=0.030)] = 0.003
    integration: Integration = "euler"
    word_bits: Annotated[int, Meta(ge=MIN_WORD_BITS, le=MAX_WORD_BITS)] = MAX_WORD_BITS


class RobotSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One robot: slot on the network, start, reference, estimator and controller.

    `strap`: value on its slot pins, if not its slot.

    Start and reference have to lie on the pitch (`places`).
    The start is the start of the reference plus the errors (captions of the paper's Figs. 6 and 8). Each
    wheel's radius is drawn from 1 +- `wheel_radius_mismatch`, once a seed. `reference`,
    `estimator` and `controller` hold the parameters of the reference, the estimator and the law that they name. `drive`
    replaces single parameters of motors, bridges, battery, chassis and encoders, and turns on what disturbs the drive
    (`plant.params`). `expect` holds what is expected of this robot, see `Scenario`.
    """

    slot: Annotated[int, Meta(ge=0, le=4)] = 0
    strap: Annotated[int, Meta(ge=0, le=7)] | None = None
    start_error_x_cm: PitchCm = 0.0
    start_error_y_cm: PitchCm = 0.0
    start_error_theta_rad: TurnRad = 0.0
    wheel_radius_mismatch: Annotated[float, Meta(ge=0.0, le=0.5)] = 0.015
    reference: AnyReference
    estimator: AnyEstimator = msgspec.field(default_factory=lambda: ESTIMATORS.find(DEFAULT_ESTIMATOR)())
    controller: Controller = msgspec.field(default_factory=lambda: LAWS.find(DEFAULT_LAW)())
    drive: DriveParams = DriveParams()
    expect: dict[str, Any] = {}

    def __post_init__(self) -> None:
        spread = self.wheel_radius_mismatch
        for name in ("left_radius_factor", "right_radius_factor"):
            factor = getattr(self.drive.chassis, name)
            low, high = Chassis.WITHIN[name]
            if factor * (1.0 - spread) < low or factor * (1.0 + spread) > high:
                raise ValueError(
                    f"drive.chassis.{name}: {factor:g} is drawn within +- {100.0 * spread:g} %"
                    f" (wheel_radius_mismatch); what is drawn must stay within {low:g} to {high:g}"
                )


class ControlNoise(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The paper's "noise in control signal" (section V-A): bounds of what is added to the commands sent.

    0 and 0 is none. Every control period each robot's v and w get a draw of their own, uniform within the
    bound: the paper gives neither bounds nor distribution.
    """

    v_m_s: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    w_rad_s: Annotated[float, Meta(ge=0.0, le=40.0)] = 0.0


class NetworkSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One radio frequency: one host, `robots` slots (the layout of its frames), and the robots that are present. A
    `silent` host sends nothing: its frames are injected by the program that runs the scenario (`World.inject`).
    """

    robots: Literal[3, 5] = 3
    host: Literal["controller", "silent"] = "controller"
    radio: Radio = Radio()
    control_noise: ControlNoise = ControlNoise()
    robot: Annotated[tuple[RobotSpec, ...], Meta(min_length=1)]

    def __post_init__(self) -> None:
        slots = [robot.slot for robot in self.robot]
        for index, slot in enumerate(slots):
            if slot >= self.robots:
                raise ValueError(
                    f"robot[{index}]: slot {slot} does not exist on a network of {self.robots} robots;"
                    f" use 0 to {self.robots - 1}, or robots = 5"
                )
            if slot in slots[:index]:
                raise ValueError(
                    f"robot[{index}]: slot {slot} is taken by robot[{slots.index(slot)}];"
                    " give each robot its own slot"
                )
        self._check_air_time()

    def _check_air_time(self) -> None:
        """A frame, with the transmitter's key-up, has to fit the camera period."""
        radio, frame = self.radio, DOWNLINK[self.robots]
        characters = frame.wire_size
        air_ticks = frame.air_ticks * 1_000_000 / (1_000_000 + radio.baud_offset_ppm)
        if air_ticks > CONTROL_PERIOD_TICKS:
            raise ValueError(
                f"radio.baud_offset_ppm: {radio.baud_offset_ppm} makes a frame of {characters} characters longer"
                " than the camera period; use a smaller one"
            )
        longest_s = (CONTROL_PERIOD_TICKS - air_ticks) / TICKS_PER_SECOND
        keyup_ticks = round(radio.keyup_s * TICKS_PER_SECOND)
        if radio.carrier == "keyed" and keyup_ticks > CONTROL_PERIOD_TICKS - air_ticks:
            raise ValueError(
                f"radio.keyup_s: {radio.keyup_s} s and a frame of {characters} characters do"
                f" not fit the camera period; at most {longest_s:.6f} s"
            )


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A whole run. A file may also have `variant` (`variants`), which stands for other keys, and `scenario` with `set`
    (`base`), which stand for another scenario's.

    `stop_on_fault` ends it at the first firmware fault; otherwise faults are counted.

    `lm629` turns readings of the chips' undocumented corners (`robot_fw/miro_robot/lm629/README.md`).

    `expect` says what is expected of every robot: a key a check. It is handed on as it is to who judges the run
    (`mirotwin.verify.checks`), because a world does not depend on what is expected of it. So is `step`, what is done
    during the run (`mirotwin.verify.steps`): a world does what it is told.
    """

    name: Name
    title: Annotated[str, Meta(max_length=200)] = ""
    duration_s: Duration
    stop_on_fault: bool = True
    lm629: Lm629Options = DEFAULT_OPTIONS
    camera: Camera = PixelCamera()
    host: HostSpec = HostSpec()
    expect: dict[str, Any] = {}
    step: tuple[dict[str, Any], ...] = ()
    networks: Annotated[tuple[NetworkSpec, ...], Meta(min_length=1)] = msgspec.field(name="network")
    clock: ClassVar[int] = TICKS_PER_SECOND
    """Ticks per second of the world."""
    period_ticks: ClassVar[int] = CONTROL_PERIOD_TICKS
    """A control period."""

    def __post_init__(self) -> None:
        if len(self.networks) > MAX_NETWORKS:
            raise ValueError(
                f"network: {len(self.networks)} networks, each of which takes as much time as a run;"
                f" at most {MAX_NETWORKS}, make several scenarios of them"
            )

    @property
    def periods(self) -> int:
        """Control periods of a run; the last one is that in which its duration ends."""
        return max(1, -(-ticks(self.duration_s) // CONTROL_PERIOD_TICKS))

    @property
    def end_tick(self) -> int:
        return self.periods * CONTROL_PERIOD_TICKS


def scenario_of(tables: dict[str, Any]) -> Scenario:
    """The scenario of complete tables. Raises msgspec.ValidationError."""
    return msgspec.convert(tables, Scenario, dec_hook=plugin_of)


def without_expectations(scenario: Scenario | BoardScenario) -> Scenario | BoardScenario:
    """A copy without expectations and steps: all that a world depends on."""
    if isinstance(scenario, BoardScenario):
        return msgspec.structs.replace(scenario, expect={}, step=())
    networks = []
    for network in scenario.networks:
        robots = tuple(msgspec.structs.replace(robot, expect={}) for robot in network.robot)
        networks.append(msgspec.structs.replace(network, robot=robots))
    return msgspec.structs.replace(scenario, expect={}, step=(), networks=tuple(networks))
