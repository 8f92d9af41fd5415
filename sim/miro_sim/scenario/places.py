"""Checks that robots start on the pitch and in sight of the camera, and that their references stay on it, drivable.

The time that a robot spends off the pitch during a run is counted by `summary`.

Checked are the square of the robot at its start, and the same square at the reference, along the whole of its path: a
robot that follows the reference without error has it there. Of a reference from another distribution, whose path is not
known, the places at the camera frames are checked. Robots that start on top of each other are not refused.
"""

from __future__ import annotations

from collections.abc import Iterator

from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_host.eye.camera_parameters import HEIGHT, WIDTH
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import ROBOT_HEIGHT_M, TEAMS
from miro_host.laws.interface import LawParameters
from miro_host.posture import Posture
from miro_host.references.interface import Paced, Trajectory
from miro_sim.pitch import ground as pitch
from miro_sim.scenario.camera_keys import Camera, PixelCamera, SeeingCamera
from miro_sim.scenario.drives import limits_problem, origin_problem

STEP_M = 0.005
"""Distance along the path from one place that is checked to the next .."""
STEP_RAD = 0.02
""".. and the turn between them, whichever is less: between them a corner bulges by less than 0.1 mm."""
MOST_S = 3600.0
"""Longest time for which a reference of another distribution is checked, at each camera frame: this takes a few
seconds.
"""
Problem = tuple[str, str, str]
"""The key of what is wrong, what that is, and the remedy."""


def robot_problem(
    reference: Trajectory,
    start: Posture,
    parameters: object,
    law: object,
    duration_s: float,
    lens: Lens | None,
) -> Problem | None:
    """The error in a robot's start, in its reference (with these `parameters`), or in both together; None if there is
    none.

    `lens`: of a camera that must see the robot at its start. Raises PluginError and DomainError.
    """
    assert isinstance(law, LawParameters)
    off = _off_pitch(start)
    if off is not None:
        axis, reason = off
        reason = f"the robot starts off the pitch: {reason}"
        if _off_pitch(reference.at(0.0).posture) is not None:
            return "reference", reason, "begin the reference elsewhere"
        return f"start_error_{axis}_cm", reason, "start nearer to the reference"
    if lens is not None and not _sees_top(lens, start):
        at = f"({100.0 * start.x_m:.1f}, {100.0 * start.y_m:.1f}) cm"
        reason = f"the robot starts outside the camera's view, at {at}"
        return "start_error_x_cm", reason, "start it elsewhere, or change camera.lens"
    on_s = 0.0
    whole_path = []
    for t_s in _instants(reference, duration_s):
        place = reference.at(t_s)
        whole_path.append((t_s, place))
        off = _off_pitch(place.posture)
        if off is not None:
            reason = f"leaves the pitch after {t_s:.2f} s of {duration_s:g} s: {off[1]}"
            remedy = f"let it stop before, drive_s = {int(100.0 * on_s) / 100.0:g}, or slow it down"
            if not hasattr(parameters, "drive_s"):
                remedy = f"choose other parameters for it, or duration_s = {int(100.0 * on_s) / 100.0:g}"
            return "reference", reason, remedy if on_s else "start it elsewhere"
        on_s = t_s
    frames = ((t_s, reference.at(t_s)) for t_s in _frames(reference, duration_s))
    problem = origin_problem(whole_path, law) or limits_problem(frames, law)
    return problem and ("reference", *problem)


def _instants(reference: Trajectory, duration_s: float) -> Iterator[float]:
    """Times from 0 on between which the reference does not go far; camera frames, if its path is not known."""
    if not isinstance(reference, Paced):
        yield from _frames(reference, duration_s)
        return
    pace = reference.pace(STEP_M, STEP_RAD)
    yield from _every(pace.step_s, min(pace.until_s, duration_s))


def _frames(reference: Trajectory, duration_s: float) -> Iterator[float]:
    """Camera frames, as long as the reference moves as it has not moved before."""
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


def lens_of(camera: Camera) -> Lens | None:
    """The lens of a camera that has one."""
    return Lens(camera.lens) if isinstance(camera, SeeingCamera) else None


def camera_problem(camera: Camera, networks: int) -> Problem | None:
    """The error of a camera that does not see the pitch, or that has more teams than there are colours; else None."""
    lens = lens_of(camera)
    if lens is None:
        return None
    try:
        for u, v in _edge():
            lens.slopes(u, v)
            if abs(lens.out_x) > MOST_SLOPE or abs(lens.out_y) > MOST_SLOPE:
                raise ValueError(f"pixel ({u:.0f}, {v:.0f}) looks too near to the horizon")
    except ValueError as error:
        return "camera.lens", str(error), "use a longer focal_px, or less tilt"
    if not (pitch.LEFT_M <= lens.x_m <= pitch.RIGHT_M and pitch.BOTTOM_M <= lens.y_m <= pitch.TOP_M):
        problem = f"hangs at ({100.0 * lens.x_m:.0f}, {100.0 * lens.y_m:.0f}) cm, beside the pitch"
        return "camera.lens", problem, "hang it above the pitch, and tilt it"
    for x_m, y_m in _CORNERS:
        if not _sees(lens, x_m, y_m, 0.0) or _pixel(lens, x_m, y_m, ROBOT_HEIGHT_M) is None:
            problem = f"does not see the pitch's corner ({100.0 * x_m:.0f}, {100.0 * y_m:.0f}) cm"
            return "camera.lens", problem, _REMEDY
    if isinstance(camera, PixelCamera) and networks > len(TEAMS):
        problem = f"{networks} networks, but patches have the colours of {len(TEAMS)} teams"
        return "camera.kind", problem, "use gaussian or geometric, or fewer networks"
    return None


def _sees_top(lens: Lens, start: Posture) -> bool:
    """True if the camera sees the whole top of a robot there."""
    reach = pitch.reach_m(start.theta_rad)
    xs, ys = (start.x_m - reach, start.x_m + reach), (start.y_m - reach, start.y_m + reach)
    return all(_sees(lens, x_m, y_m, ROBOT_HEIGHT_M) for x_m in xs for y_m in ys)


def _edge() -> Iterator[tuple[float, float]]:
    """The corners of all pixels along the border of the picture."""
    for i in range(WIDTH + 1):
        yield float(i), 0.0
        yield float(i), float(HEIGHT)
    for j in range(HEIGHT + 1):
        yield 0.0, float(j)
        yield float(WIDTH), float(j)


def _pixel(lens: Lens, x_m: float, y_m: float, z_m: float) -> tuple[float, float] | None:
    """The projected pixel; None if the lens cannot project the point."""
    try:
        return lens.pixel(x_m, y_m, z_m)
    except ValueError:
        return None


def _sees(lens: Lens, x_m: float, y_m: float, z_m: float) -> bool:
    at = _pixel(lens, x_m, y_m, z_m)
    return at is not None and 0.0 <= at[0] <= WIDTH and 0.0 <= at[1] <= HEIGHT
