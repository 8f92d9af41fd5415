"""Checks that the camera of a scenario sees the pitch and the robots that start on it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from miro_host.eye.camera_parameters import HEIGHT, WIDTH
from miro_host.eye.patterns import ROBOT_HEIGHT_M, TEAMS
from miro_sim.pitch import ground as pitch
from miro_sim.scenario.camera_keys import PixelCamera, SeeingCamera
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.keys import Scenario

if TYPE_CHECKING:
    from miro_host.eye.lens import Lens
    from miro_host.posture import Posture

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
        if not (_sees(lens, x_m, y_m, 0.0) and _draws(lens, x_m, y_m, ROBOT_HEIGHT_M)):
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


def _draws(lens: Lens, x_m: float, y_m: float, z_m: float) -> bool:
    try:
        lens.pixel(x_m, y_m, z_m)
    except ValueError:
        return False
    return True


def _sees(lens: Lens, x_m: float, y_m: float, z_m: float) -> bool:
    try:
        u, v = lens.pixel(x_m, y_m, z_m)
    except ValueError:
        return False
    return 0.0 <= u <= WIDTH and 0.0 <= v <= HEIGHT
