"""The pitch of a run as SVG: field, paths, and robots that the page's JavaScript moves."""

from __future__ import annotations

import math

import msgspec

from miro_sim.pitch import ground
from mirotwin.recording.track import Postures
from mirotwin.report.page.tracks import PageTracks

MARGIN_CM = 3.0
MOST_POINTS = 4000
"""Of a path; a longer one is drawn with every second point, or every third, and so on."""
HALF_CM = 100.0 * ground.ROBOT_HALF_M


class Pitch(msgspec.Struct, frozen=True):
    """`view_box` takes in the whole pitch and all paths. `paths`: number of the robot, truth or reference, and points
    as an SVG polyline has them; `dots`: of each robot the measured places, as one SVG path.
    """

    view_box: str
    paths: list[tuple[int, str, str]]
    dots: list[str]
    left: float = 100.0 * ground.LEFT_M
    bottom: float = 100.0 * ground.BOTTOM_M
    length: float = 100.0 * ground.LENGTH_M
    width: float = 100.0 * ground.WIDTH_M
    half: float = HALF_CM


def pitch_of(tracks: PageTracks) -> Pitch:
    paths, dots = [], []
    corners = [
        (100.0 * ground.LEFT_M, 100.0 * ground.BOTTOM_M),
        (100.0 * ground.RIGHT_M, 100.0 * ground.TOP_M),
    ]
    for number, robot in enumerate(tracks.robots):
        kinds = [("truth", robot.truth), *([("reference", robot.reference)] if robot.steered else [])]
        for kind, postures in kinds:
            places = _places(postures)
            corners += [(x, y) for x, y in places if math.isfinite(x + y)]
            paths.append((number, kind, " ".join(f"{x:.2f},{y:.2f}" for x, y in places)))
        seen = [place for place in _places(robot.measured) if not math.isnan(place[0])]
        dots.append("".join(f"M{x:.2f} {y:.2f}h0" for x, y in seen))
    left, right = min(x for x, _ in corners) - MARGIN_CM, max(x for x, _ in corners) + MARGIN_CM
    bottom, top = min(y for _, y in corners) - MARGIN_CM, max(y for _, y in corners) + MARGIN_CM
    return Pitch(f"{left:.2f} {-top:.2f} {right - left:.2f} {top - bottom:.2f}", paths, dots)


def _places(postures: Postures) -> list[tuple[float, float]]:
    step = -(-len(postures.x_m) // MOST_POINTS) or 1
    places = [(100.0 * x, 100.0 * y) for x, y in zip(postures.x_m, postures.y_m, strict=True)]
    last = places[-1:] if (len(places) - 1) % step else []
    return [*places[::step], *last]
