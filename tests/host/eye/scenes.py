"""Pictures for tests of the tracker: robots on a pitch, and a tracker that has seen them."""

import hashlib
import math

from miro_exact.dmath import sincos, wrap_pi
from miro_exact.rng import Stream
from miro_host.eye.calibration import Calibration
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.colours import classes_of
from miro_host.eye.tracker import Tracker
from miro_host.posture import Posture
from tests.naive.painted_frame import PaintedFrame, PaintedRobot, sampled
from tests.states import snapshot

FRAME = 800_800
CAMERA = CameraParameters()
CLASSES = classes_of(sampled())


def tracker(team="yellow", robots=(0,), **changes):
    given = {"pattern": "diagonal", "calibration": Calibration(camera=CAMERA), "colours": CLASSES, **changes}
    return Tracker(team, robots, **given)


def drawn(index, name="postures"):
    """A posture anywhere on the pitch."""
    stream = Stream(1997, name)
    x, y, turn = (stream.uniform(3 * index + part) for part in range(3))
    return Posture(1.2 * x - 0.05, 0.8 * y - 0.05, wrap_pi(6.28 * turn))


def errors(sighting, true):
    """Of position in cm and of heading in degrees."""
    off_m = math.hypot(sighting.x_m - true.x_m, sighting.y_m - true.y_m)
    return 100.0 * off_m, math.degrees(abs(wrap_pi(sighting.theta_rad - true.theta_rad)))


def beside(posture, ahead_m, left_m, turn_rad=0.0):
    """A posture given in the axes of another."""
    sin, cos = sincos(posture.theta_rad)
    return Posture(
        posture.x_m + ahead_m * cos - left_m * sin,
        posture.y_m + ahead_m * sin + left_m * cos,
        wrap_pi(posture.theta_rad + turn_rad),
    )


def session():
    """SHA-256 of what two trackers make of twelve pictures with six robots, and how many they lost."""
    found = hashlib.sha256()
    trackers = [tracker("yellow", (0, 1, 2)), tracker("blue", (0, 1, 2), centroid="binary")]
    start = [drawn(index, "session") for index in range(6)]
    for frame in range(12):
        robots = [
            PaintedRobot(beside(start[n], 0.02 * frame, 0.0, 0.1 * frame), ("yellow", "blue")[n // 3], n % 3)
            for n in range(6)
        ]
        picture = PaintedFrame(robots, noise=frame)
        for one in trackers:
            found.update(repr(one.track(picture, frame * FRAME)).encode() + snapshot(one))
    return f"{found.hexdigest()} {[one.lost_frames for one in trackers]}"
