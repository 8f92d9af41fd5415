"""Where things are: the frames of a run as one tree, under the pitch's own.

pitch                          the paper's axes on the floor, z up, m
  net0/robot0                  the robot's truth: x ahead, y left, origin on the floor under its centre
  net0/robot0/measured         what its PC measured last; it stays where it was while the robot is lost
  net0/robot0/reference        where it should be
  net0/camera                  the lens: x right in the picture, y down, z into it
"""

from __future__ import annotations

from collections.abc import Iterator

from miro_host.posture import Posture
from miro_sim.periods import RobotPeriod
from mirotwin.report.foxglove.messages import FrameTransform, Timestamp, Vector3
from mirotwin.report.foxglove.shapes import heading

PITCH = "pitch"


def robot_frame(network: int, slot: int) -> str:
    return f"net{network}/robot{slot}"


def measured_frame(network: int, slot: int) -> str:
    return f"{robot_frame(network, slot)}/measured"


def reference_frame(network: int, slot: int) -> str:
    return f"{robot_frame(network, slot)}/reference"


def camera_frame(network: int) -> str:
    return f"net{network}/camera"


def of_robot(robot: RobotPeriod, at: Timestamp) -> Iterator[FrameTransform]:
    """Truth, reference, and the measurement if there is one."""
    place = robot.network, robot.slot
    yield _on_floor(robot_frame(*place), robot.truth, at)
    yield _on_floor(reference_frame(*place), robot.reference, at)
    if robot.measurement is not None:
        yield _on_floor(measured_frame(*place), robot.measurement, at)


def _on_floor(frame: str, posture: Posture, at: Timestamp) -> FrameTransform:
    place = Vector3(posture.x_m, posture.y_m, 0.0)
    return FrameTransform(at, PITCH, frame, place, heading(posture.theta_rad))
