"""Checks that robots start on the pitch and in sight of the camera, and that their references stay on it, drivable.

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
from miro_exact.plugins import PluginError
from miro_host.eye.camera_parameters import HEIGHT, WIDTH
from miro_host.eye.patterns import ROBOT_HEIGHT_M, TEAMS
from miro_host.posture import Posture
from miro_sim.pitch import ground as pitch
from miro_sim.scenario.camera_keys import PixelCamera, SeeingCamera
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.keys import RobotSpec, Scenario

if TYPE_CHECKING:
    from miro_host.eye.lens import Lens
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
    from miro_sim.scenario.build import reference_and_start
    from miro_sim.scenario.drives import limits_problem, origin_problem

    duration_s = scenario.duration_s
    reference, start = reference_and_start(robot, duration_s)
    off = _off_pitch(start)
    if off is not None:
        axis, what = off
        of_reference = _off_pitch(reference.at(0.0).posture) is not None
        key = "reference" if of_reference else f"start_error_{axis}_cm"
        remedy = "begin the reference elsewhere" if of_reference else "start nearer to the reference"
        raise ScenarioError(origin, f"{path}.{key}", f"the robot starts off the pitch: {what}", remedy)
    check_start(scenario, start, origin, path)
    on_s = 0.0
    whole_path = []
    for t_s in _instants(reference, duration_s):
        at = reference.at(t_s)
        whole_path.append((t_s, at))
        off = _off_pitch(at.posture)
        if off is not None:
            what = f"leaves the pitch after {t_s:.2f} s of {duration_s:g} s: {off[1]}"
            remedy = f"let it stop before, drive_s = {int(100.0 * on_s) / 100.0:g}, or slow it down"
            if not hasattr(robot.reference, "drive_s"):
                remedy = f"choose other parameters for it, or duration_s = {int(100.0 * on_s) / 100.0:g}"
            raise ScenarioError(origin, f"{path}.reference", what, remedy if on_s else "start it elsewhere")
        on_s = t_s
    law = robot.controller
    assert isinstance(law, LawParameters)
    frames = ((t_s, reference.at(t_s)) for t_s in _frames(reference, duration_s))
    problem = origin_problem(whole_path, law) or limits_problem(frames, law)
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


_CORNERS = [(x, y) for x in (pitch.LEFT_M, pitch.RIGHT_M) for y in (pitch.BOTTOM_M, pitch.TOP_M)]
MOST_SLOPE = 5.0
"""A ray further from the vertical than 79 degrees sees nothing of use."""
_REMEDY = "hang it above the middle of the pitch, higher, or make focal_px shorter"


def check_camera(scenario: Scenario, origin: str) -> None:
    """Raises ScenarioError for a camera that does not see the pitch, and for robots without a team's colour."""
    camera = scenario.camera
    if not isinstance(camera, SeeingCamera):
        return
    from miro_host.eye.lens import Lens  # a hot module: not before the engine was chosen

    lens = Lens(camera.lens)
    try:
        for u, v in _edge():
            lens.slopes(u, v)
            if abs(lens.out_x) > MOST_SLOPE or abs(lens.out_y) > MOST_SLOPE:
                raise ValueError(f"pixel ({u:.0f}, {v:.0f}) looks too near to the horizon")
    except ValueError as error:
        raise ScenarioError(
            origin, "camera.lens", str(error), "use a longer focal_px, or less tilt"
        ) from None
    if not (pitch.LEFT_M <= lens.x_m <= pitch.RIGHT_M and pitch.BOTTOM_M <= lens.y_m <= pitch.TOP_M):
        what = f"hangs at ({100.0 * lens.x_m:.0f}, {100.0 * lens.y_m:.0f}) cm, beside the pitch"
        raise ScenarioError(origin, "camera.lens", what, "hang it above the pitch, and tilt it")
    for x_m, y_m in _CORNERS:
        if not _sees(lens, x_m, y_m, 0.0) or _pixel(lens, x_m, y_m, ROBOT_HEIGHT_M) is None:
            what = f"does not see the pitch's corner ({100.0 * x_m:.0f}, {100.0 * y_m:.0f}) cm"
            raise ScenarioError(origin, "camera.lens", what, _REMEDY)
    if isinstance(camera, PixelCamera) and len(scenario.networks) > len(TEAMS):
        what = f"{len(scenario.networks)} networks, but patches have the colours of {len(TEAMS)} teams"
        raise ScenarioError(origin, "camera.kind", what, "use gaussian or geometric, or fewer networks")


def check_start(scenario: Scenario, start: Posture, origin: str, place: str) -> None:
    """Raises ScenarioError for a robot of which the camera does not see the whole top where it starts."""
    if not isinstance(scenario.camera, SeeingCamera):
        return
    from miro_host.eye.lens import Lens

    lens = Lens(scenario.camera.lens)
    reach = pitch.reach_m(start.theta_rad)
    for x_m in (start.x_m - reach, start.x_m + reach):
        for y_m in (start.y_m - reach, start.y_m + reach):
            if not _sees(lens, x_m, y_m, ROBOT_HEIGHT_M):
                at = f"({100.0 * start.x_m:.1f}, {100.0 * start.y_m:.1f}) cm"
                what = f"the robot starts outside the camera's view, at {at}"
                raise ScenarioError(
                    origin, f"{place}.start_error_x_cm", what, "start it elsewhere, or change camera.lens"
                )


def _edge() -> Iterator[tuple[float, float]]:
    """The corners of all pixels along the border of the picture."""
    for i in range(WIDTH + 1):
        yield float(i), 0.0
        yield float(i), float(HEIGHT)
    for j in range(HEIGHT + 1):
        yield 0.0, float(j)
        yield float(WIDTH), float(j)


def _pixel(lens: Lens, x_m: float, y_m: float, z_m: float) -> tuple[float, float] | None:
    """Where the lens draws it; None where it cannot."""
    try:
        return lens.pixel(x_m, y_m, z_m)
    except ValueError:
        return None


def _sees(lens: Lens, x_m: float, y_m: float, z_m: float) -> bool:
    at = _pixel(lens, x_m, y_m, z_m)
    return at is not None and 0.0 <= at[0] <= WIDTH and 0.0 <= at[1] <= HEIGHT
