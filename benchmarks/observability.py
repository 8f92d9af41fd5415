"""What encoders, lines and both can tell about a camera: standard deviations of its error over the pitch.

    python -m benchmarks.observability [--seconds 30]

A calculation, not a run: covariances of the linear problem, the best that any filter can do. Unknown are the
five numbers in which a calibration of 1997 is wrong (with its sizes as standard deviations), two wheel factors (0.87 %)
and the posture at the start (nothing known). A robot drives a path of bends over the pitch. The camera measures its
place 30 times a second, to 0.05 cm, through the unknown calibration; encoders tell the path but for the factors and the
start, without slip. Lines tell what `self_calibration` takes from one picture, a mark each with its own noise.

What a combination of sensors cannot see at all stays as large as it was. A shift, a turn or a stretch of the whole
field of the camera moves the path as another start or other wheels would: the table says how much of each remains.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator

import numpy as np

from miro_host.eye import self_calibration
from miro_host.eye.calibration_kinds import CENTRE_PX, FOCAL_SHARE, TILT_RAD, WORST_M
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import ROBOT_HEIGHT_M
from miro_host.eye.pitch_marks import MARKS
from miro_host.wheels import Wheels

CAMERA = CameraParameters()
UNKNOWN = self_calibration.LEARNT[:5]
SIZES = np.array([CENTRE_PX, CENTRE_PX, FOCAL_SHARE * CAMERA.focal_px, TILT_RAD, TILT_RAD])
FACTOR = 0.0087
PLACE_NOISE_M = 0.0005
POSITION_DRIFT_M, HEADING_DRIFT_RAD = 0.002, 0.01
RATE_HZ = 30
TRACK_M = Wheels().track_m
GRID = [(x, y) for x in np.linspace(-0.05, 1.15, 13) for y in np.linspace(-0.05, 0.75, 9)]


def field(x_m: float, y_m: float) -> np.ndarray:
    """2 x 5: how far a place is read off, by each unknown of the camera."""
    true = Lens(CAMERA)
    u, v = true.pixel(x_m, y_m, ROBOT_HEIGHT_M)
    columns = []
    for index, size in enumerate(SIZES):
        step = 0.01 * size
        changes = [0.0] * len(self_calibration.LEARNT)
        changes[index] = step
        told = Lens(self_calibration.changed(CAMERA, changes))
        read = told.ground(u, v, ROBOT_HEIGHT_M)
        columns.append([(read[0] - x_m) / step, (read[1] - y_m) / step])
    return np.array(columns).T


def drive(seconds: float) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
    """At each frame: place, derivative of posture and wheel factors by those one frame before, and the time step.

    0.3 m/s, bends to both sides, turning at the walls.
    """
    x, y, theta, turning = 0.15, 0.15, 0.6, 0.0
    dt = 1.0 / RATE_HZ
    for index in range(int(seconds * RATE_HZ)):
        ahead_x, ahead_y = x + 0.15 * math.cos(theta), y + 0.15 * math.sin(theta)
        free = -0.05 < ahead_x < 1.15 and -0.05 < ahead_y < 0.75
        turning = (0.0 if free else turning or 4.0 * (1 if index % 2 else -1)) if turning or not free else 0.0
        v, w = 0.3, turning or 0.8 * math.sin(0.9 * index * dt)
        left, right = v - 0.5 * TRACK_M * w, v + 0.5 * TRACK_M * w
        middle = theta + 0.5 * w * dt
        sin, cos = math.sin(middle), math.cos(middle)
        by = np.eye(5)
        by[0, 2], by[1, 2] = -v * dt * sin, v * dt * cos
        by[:3, 3] = 0.5 * left * dt * cos, 0.5 * left * dt * sin, -left * dt / TRACK_M
        by[:3, 4] = 0.5 * right * dt * cos, 0.5 * right * dt * sin, right * dt / TRACK_M
        x, y, theta = x + v * dt * cos, y + v * dt * sin, theta + w * dt
        yield np.array([x, y]), by, dt


def encoder_covariance(before: np.ndarray, seconds: float) -> np.ndarray:
    """Of the camera's unknowns after a drive, with wheels and posture estimated beside them."""
    p = np.zeros((10, 10))
    p[:5, :5] = np.diag([1.0, 1.0, 10.0, FACTOR**2, FACTOR**2])
    p[5:, 5:] = before
    for place, by, dt in drive(seconds):
        f = np.eye(10)
        f[:5, :5] = by
        p = f @ p @ f.T
        p[[0, 1, 2], [0, 1, 2]] += np.square([POSITION_DRIFT_M, POSITION_DRIFT_M, HEADING_DRIFT_RAD]) * dt
        h = np.hstack([np.eye(2), np.zeros((2, 3)), field(*place)])
        gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + np.eye(2) * PLACE_NOISE_M**2)
        p = (np.eye(10) - gain @ h) @ p
        p = 0.5 * (p + p.T)
    return p[5:, 5:]


def line_information() -> np.ndarray:
    """Of the camera's unknowns, from each mark of one picture."""
    information = np.zeros((5, 5))
    for mark in MARKS:
        slopes = np.array(self_calibration.slopes_of(CAMERA, mark)[:5])
        noise = self_calibration.WALL_NOISE_PX if mark.height_m else self_calibration.LINE_NOISE_PX
        information += np.outer(slopes, slopes) / noise**2
    return information


def similarity(x_m: float, y_m: float) -> np.ndarray:
    """2 x 4: the same for a shift along x and y, a turn and a stretch about the middle of the pitch."""
    dx, dy = x_m - 0.55, y_m - 0.35
    return np.array([[1.0, 0.0, -dy, dx], [0.0, 1.0, dx, dy]])


def rows(seconds: float) -> list[tuple[str, list[float]]]:
    """Rms error over the pitch in cm of each combination: whole, and its parts shift, turn, stretch, rest."""
    fields = np.array([field(*place) for place in GRID]).reshape(-1, 5)
    shapes = np.array([similarity(*place) for place in GRID]).reshape(-1, 4)
    parts = np.linalg.lstsq(shapes, fields, rcond=None)[0]
    before = np.diag(SIZES**2)
    worst = math.sqrt(
        max(np.diag(fields @ before @ fields.T)[0::2] + np.diag(fields @ before @ fields.T)[1::2])
    )
    before = before * (WORST_M / worst) ** 2
    lines = np.linalg.inv(np.linalg.inv(before) + line_information())

    def rms_cm(columns: np.ndarray, covariance: np.ndarray) -> float:
        return 100.0 * math.sqrt(np.trace(columns @ covariance @ columns.T) / len(GRID))

    found = []
    for name, covariance in (
        ("as told", before),
        (f"encoders, {seconds:g} s", encoder_covariance(before, seconds)),
        ("lines, one picture", lines),
        ("both", encoder_covariance(lines, seconds)),
    ):
        pieces = [shapes[:, part] @ parts[part] for part in ([0, 1], [2], [3])]
        pieces.append(fields - shapes @ parts)
        found.append((name, [rms_cm(fields, covariance), *(rms_cm(piece, covariance) for piece in pieces)]))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=30.0)
    seconds = parser.parse_args().seconds
    print("| rms over the pitch, cm | whole | shift | turn | stretch | rest |\n|---|---|---|---|---|---|")
    for name, values in rows(seconds):
        print(f"| {name} | " + " | ".join(f"{value:.3f}" for value in values) + " |")


if __name__ == "__main__":
    main()
