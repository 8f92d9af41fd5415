"""Checks that the robots of a scenario start on the pitch, and that their references stay on it and can be driven.

The time that a robot spends off the pitch during a run is counted by `summary`.

Checked are the square of the robot at its start, and the same square at the reference, along the whole of its path: a
robot that follows the reference without error has it there. Of a reference from another distribution, whose path is not
known, the places at the camera frames are checked. Robots that start on top of each other are not refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_exact.domain import DomainError
from miro_host.plugins import PluginError
from miro_host.posture import Posture
from miro_sim.pitch import ground as pitch
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.keys import RobotSpec, Scenario
from miro_sim.scenario.views import check_camera, check_start

if TYPE_CHECKING:
    from miro_host.references.interface import Trajectory

STEP_M = 0.005
"""Distance along the path from one place that is checked to the next .."""
STEP_RAD = 0.02
""".. and the turn between them, whichever is less: between them a corner bulges by less than 0.1 mm."""
MOST_S = 3600.0
"""So long a reference of another distribution is checked, at each camera frame: this takes a few seconds."""


def check_places(scenario: Scenario, origin: str) -> None:
    """Raises ScenarioError for a start or a reference that is not on the pitch; `origin` names the scenario."""
    check_camera(scenario, origin)
    for number, network in enumerate(scenario.networks):
        for index, robot in enumerate(network.robot):
            path = f"network[{number}].robot[{index}]"
            try:
                _check(robot, scenario, origin, path)
            except PluginError as error:
                raise ScenarioError(origin, f"{path}.reference", error.what, error.remedy) from error
            except DomainError as error:  # a heading of a million radians
                raise ScenarioError(origin, f"{path}.reference", f"leaves the pitch: {error}") from error


def _check(robot: RobotSpec, scenario: Scenario, origin: str, path: str) -> None:
    from miro_host.laws.interface import LawParameters  # needs hot modules: not before the engine was chosen
    from miro_sim.scenario.build import reference_for
    from miro_sim.scenario.drives import limits_problem, origin_problem

    duration_s = scenario.duration_s
    reference = reference_for(robot, duration_s)
    at = reference.at(0.0).posture
    start = Posture(
        at.x_m + robot.start_error_x_cm / 100.0,
        at.y_m + robot.start_error_y_cm / 100.0,
        at.theta_rad + robot.start_error_theta_rad,
    )
    off = _off_pitch(start)
    if off is not None:
        axis, what = off
        of_reference = _off_pitch(at) is not None
        key = "reference" if of_reference else f"start_error_{axis}_cm"
        remedy = "begin the reference elsewhere" if of_reference else "start nearer to the reference"
        raise ScenarioError(origin, f"{path}.{key}", f"the robot starts off the pitch: {what}", remedy)
    check_start(scenario, start, origin, path)
    on_s = 0.0
    for t_s in _instants(reference, duration_s):
        off = _off_pitch(reference.at(t_s).posture)
        if off is not None:
            what = f"leaves the pitch after {t_s:.2f} s of {duration_s:g} s: {off[1]}"
            remedy = f"let it stop before, drive_s = {int(100.0 * on_s) / 100.0:g}, or slow it down"
            if not hasattr(robot.reference, "drive_s"):
                remedy = f"choose other parameters for it, or duration_s = {int(100.0 * on_s) / 100.0:g}"
            raise ScenarioError(origin, f"{path}.reference", what, remedy if on_s else "start it elsewhere")
        on_s = t_s
    law = robot.controller
    assert isinstance(law, LawParameters)
    problem = origin_problem(
        ((t_s, reference.at(t_s)) for t_s in _instants(reference, duration_s)), law
    ) or limits_problem(((t_s, reference.at(t_s)) for t_s in _frames(reference, duration_s)), law)
    if problem is not None:
        raise ScenarioError(origin, f"{path}.reference", *problem)


def _instants(reference: Trajectory, duration_s: float) -> Iterator[float]:
    """Times from 0 on between which the reference does not go far; camera frames, if its path is not known."""
    from miro_host.references.interface import Paced  # hot, too

    if not isinstance(reference, Paced):
        yield from _frames(reference, duration_s)
        return
    pace = reference.pace(STEP_M, STEP_RAD)
    yield from _every(pace.step_s, min(pace.until_s, duration_s))


def _frames(reference: Trajectory, duration_s: float) -> Iterator[float]:
    """Camera frames, as long as the reference moves as it has not moved before."""
    from miro_host.references.interface import Paced

    steady_s = reference.pace(STEP_M, STEP_RAD).steady_s if isinstance(reference, Paced) else MOST_S
    yield from _every(seconds(CONTROL_PERIOD_TICKS), min(steady_s, duration_s, MOST_S))


def _every(step_s: float, until_s: float) -> Iterator[float]:
    count = 0
    while count * step_s < until_s:
        yield count * step_s
        count += 1
    yield until_s


def _off_pitch(at: Posture) -> tuple[str, str] | None:
    """(axis, what) for a square that is not on the pitch."""
    if pitch.holds(at):
        return None
    reach = pitch.reach_m(at.theta_rad)
    for axis, centre, low, high in (
        ("x", at.x_m, pitch.LEFT_M, pitch.RIGHT_M),
        ("y", at.y_m, pitch.BOTTOM_M, pitch.TOP_M),
    ):
        if not low + reach <= centre <= high - reach:
            span = f"{100.0 * (centre - reach):.2f} to {100.0 * (centre + reach):.2f} cm"
            limits = f"{100.0 * low:.0f} to {100.0 * high:.0f} cm"
            return axis, f"a square of 7.5 cm there takes {axis} = {span}; the pitch has {limits}"
    return None
