"""From the keys of a scenario to the objects that they describe."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_exact.domain import DomainError
from miro_exact.plugins import PluginError
from miro_exact.raised import at_place, defined_at, raised
from miro_exact.rng import Stream
from miro_host.estimators.interface import EstimatorParameters
from miro_host.integrator import integrator_of
from miro_host.laws.interface import LawParameters
from miro_host.pilot import Pilot
from miro_host.posture import Posture
from miro_host.references.interface import CheckedReference, ReferenceParameters, Trajectory
from miro_host.registries import REFERENCES
from miro_host.wheels import Wheels
from miro_protocol.table import DOWNLINK
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.scenario import keys as sc
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.places import camera_problem, lens_of, robot_problem


def check_robots(scenario: sc.Scenario, origin: str) -> None:
    """Raises ScenarioError for a camera that does not see the pitch, and for a robot that starts beside it or cannot
    follow its reference (`places`). `origin` names the scenario.
    """
    if problem := camera_problem(scenario.camera, len(scenario.networks)):
        raise ScenarioError(origin, *problem)
    lens = lens_of(scenario.camera)
    for number, network in enumerate(scenario.networks):
        for index, robot in enumerate(network.robot):
            place = f"network[{number}].robot[{index}]"
            try:
                reference, start = reference_and_start(robot, scenario.duration_s)
                misplaced = robot_problem(
                    reference, start, robot.reference, robot.controller, scenario.duration_s, lens
                )
            except PluginError as error:
                raise ScenarioError(origin, f"{place}.reference", error.what, error.remedy) from error
            except DomainError as error:  # a heading of a million radians
                raise ScenarioError(origin, f"{place}.reference", f"leaves the pitch: {error}") from error
            if misplaced is not None:
                key, reason, remedy = misplaced
                raise ScenarioError(origin, f"{place}.{key}", reason, remedy)


def reference_for(robot: sc.RobotSpec, duration_s: float) -> Trajectory:
    """The reference trajectory in the paper's axes, which start at its own start. Raises PluginError."""
    parameters = robot.reference
    assert isinstance(parameters, ReferenceParameters)
    name = parameters.name()
    trajectory = _made(
        "reference", name, lambda: _a_plugin(parameters.trajectory(duration_s), "at", parameters.trajectory)
    )
    return trajectory if name in REFERENCES.own else CheckedReference(trajectory, name)


def reference_and_start(robot: sc.RobotSpec, duration_s: float) -> tuple[Trajectory, Posture]:
    """The reference, and where the robot starts: there, but for the errors of its start. Raises PluginError."""
    reference = reference_for(robot, duration_s)
    at = reference.at(0.0).posture
    start = Posture(
        at.x_m + robot.start_error_x_cm / 100.0,
        at.y_m + robot.start_error_y_cm / 100.0,
        at.theta_rad + robot.start_error_theta_rad,
    )
    return reference, start


def dead_s(scenario: sc.Scenario, network: sc.NetworkSpec) -> float:
    """The PC's own delay in seconds: from a period's begin to the end of its frame."""
    radio = network.radio
    keyup_s = radio.keyup_s if radio.carrier == "keyed" else 0.0
    return scenario.host.compute_s + keyup_s + radio.latency_s + seconds(DOWNLINK[network.robots].air_ticks)


def pilot_for(robot: sc.RobotSpec, reference: Trajectory, scenario: sc.Scenario, network: int) -> Pilot:
    """Estimator and law, integrator and wheel split. Raises PluginError when one of the first two cannot be made."""
    chosen, controller = robot.estimator, robot.controller
    assert isinstance(chosen, EstimatorParameters)
    assert isinstance(controller, LawParameters)
    estimator = _made("estimator", chosen.name(), lambda: _remembering(chosen.estimator(), chosen.estimator))
    law = _made("law", controller.name(), lambda: _remembering(controller.law(), controller.law))
    host = scenario.host
    return Pilot(
        reference,
        law,
        Wheels(word_bits=host.word_bits),
        estimator=estimator,
        integrator=integrator_of(host.integration, controller, seconds(CONTROL_PERIOD_TICKS)),
        dead_s=dead_s(scenario, scenario.networks[network]),
    )


def _remembering(plugin: Any, maker: Any) -> Any:
    """The plug-in itself, once its memory was found to be as declared. Raises PluginError."""
    _a_plugin(plugin, "check_memory", maker)
    try:
        plugin.check_memory()
    except ValueError as error:
        place = defined_at(type(plugin).__init__) or defined_at(type(plugin).step)
        raise PluginError(at_place(str(error), place), "mend STATE, NOT_STATE or `__init__`") from error
    return plugin


def _a_plugin(plugin: Any, method: str, maker: Any) -> Any:
    """Checks that the result of `maker` has this method. Raises PluginError."""
    if not hasattr(plugin, method):
        problem = f"`{maker.__name__}` returned {plugin!r:.40}"
        raise PluginError(
            at_place(problem, defined_at(maker)), f"return an object with the method `{method}`"
        )
    return plugin


def _made(word: str, name: str, make: Callable[[], Any]) -> Any:
    """A new plug-in; whatever goes wrong with it is a PluginError that names it."""
    try:
        return make()
    except PluginError as error:
        raise PluginError(f"{word} {name!r} cannot be made: {error.what}", error.remedy) from error
    except (Exception, SystemExit) as error:
        problem = f"{word} {name!r} cannot be made: {raised(error)}"
        raise PluginError(problem, f"mend the {word} or its parameters") from error


def pilot_and_drive(
    robot: sc.RobotSpec, scenario: sc.Scenario, network: int, wheels: Stream, noise: Stream
) -> tuple[Pilot, DifferentialDrive]:
    """The pilot and the drive of a robot. Raises PluginError."""
    reference, start = reference_and_start(robot, scenario.duration_s)
    return pilot_for(robot, reference, scenario, network), drive_for(robot, start, wheels, noise)


def drive_for(robot: sc.RobotSpec, start: Posture, wheels: Stream, noise: Stream) -> DifferentialDrive:
    """The drive with this seed's wheels, which are drawn from `wheels`; `noise` is the disturbance's."""
    spread, left, right = robot.wheel_radius_mismatch, wheels.uniform(0), wheels.uniform(1)
    body = robot.drive.chassis
    drawn = msgspec.structs.replace(
        body,
        left_radius_factor=body.left_radius_factor * (1.0 + spread * (2.0 * left - 1.0)),
        right_radius_factor=body.right_radius_factor * (1.0 + spread * (2.0 * right - 1.0)),
    )
    params = msgspec.structs.replace(robot.drive, chassis=drawn)
    return DifferentialDrive(params, start.x_m, start.y_m, start.theta_rad, noise)
