"""The coordinate frames of a run as one tree, below the pitch's own.

pitch                          the paper's axes on the floor, z up, m
  net0/robot0                  the robot's truth: x ahead, y left, origin on the floor under its centre
  net0/robot0/measured         last measurement of its PC; unchanged while the robot is lost
  net0/robot0/reference        its reference posture
  net0/camera                  the lens: x right in the picture, y down, z into it
"""

from __future__ import annotations

from collections.abc import Iterator

from miro_exact.dmath import sincos
from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_sim.periods import RobotPeriod
from mirotwin.report.foxglove.messages import (
    CameraCalibration,
    FrameTransform,
    Quaternion,
    Timestamp,
    Vector3,
)
from mirotwin.report.foxglove.shapes import heading

PITCH = "pitch"


def robot_frame(network: int, slot: int) -> str:
    return f"net{network}/robot{slot}"


def camera_frame(network: int) -> str:
    return f"net{network}/camera"


def of_robot(robot: RobotPeriod, time: Timestamp) -> Iterator[FrameTransform]:
    """Truth, reference, and the measurement if there is one."""
    frame = robot_frame(robot.network, robot.slot)
    for name, posture in (
        (frame, robot.truth),
        (f"{frame}/reference", robot.reference),
        (f"{frame}/measured", robot.measurement),
    ):
        if posture is not None:
            place = Vector3(posture.x_m, posture.y_m, 0.0)
            yield FrameTransform(time, PITCH, name, place, heading(posture.theta_rad))


UPSIDE_DOWN = Quaternion(1.0, 0.0, 0.0, 0.0)
"""From right, up, backwards to right, down, ahead: half a turn about the first."""


def transform(network: int, lens: CameraParameters, time: Timestamp) -> FrameTransform:
    """Position and orientation of the camera: turned, tilted, and upside down."""
    turned = _about(lens.turn_rad, (0.0, 0.0, 1.0))
    tilted = _product(_about(lens.tilt_x_rad, (1.0, 0.0, 0.0)), _about(lens.tilt_y_rad, (0.0, 1.0, 0.0)))
    place = Vector3(lens.x_m, lens.y_m, lens.height_m)
    rotation = _product(_product(tilted, turned), UPSIDE_DOWN)
    return FrameTransform(time, PITCH, camera_frame(network), place, rotation)


def calibration(network: int, lens: CameraParameters, time: Timestamp) -> CameraCalibration:
    """The true optics."""
    along, down = lens.focal_px, lens.focal_px * lens.pixel_aspect
    u, v = lens.centre_u_px - 0.5, lens.centre_v_px - 0.5
    return CameraCalibration(
        timestamp=time,
        frame_id=camera_frame(network),
        width=WIDTH,
        height=HEIGHT,
        distortion_model="plumb_bob",
        distortion=(lens.k1, 0.0, 0.0, 0.0, 0.0),
        intrinsic=(along, 0.0, u, 0.0, down, v, 0.0, 0.0, 1.0),
        rectification=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        projection=(along, 0.0, u, 0.0, 0.0, down, v, 0.0, 0.0, 0.0, 1.0, 0.0),
    )


def _about(angle_rad: float, axis: tuple[float, float, float]) -> Quaternion:
    sin, cos = sincos(0.5 * angle_rad)
    return Quaternion(axis[0] * sin, axis[1] * sin, axis[2] * sin, cos)


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    """The turn `b`, then the turn `a`."""
    return Quaternion(
        a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
    )
