"""The cameras' and wheels' parameters learnt by a run's hosts, beside the true ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from miro_host.eye.calibration_kinds import worst_error_m
from miro_host.eye.self_calibration import LEARNT
from miro_sim.world.sight import PixelSight


class Learnt(msgspec.Struct, frozen=True):
    """One parameter: the truth, the host's first and last value, and the filter's standard deviation."""

    true: float
    told: float
    learnt: float
    spread: float


class LearntCalibration(msgspec.Struct, frozen=True):
    """One host's camera. `worst_*_cm`: the largest position error that the calibration makes over the pitch.

    `marks`: number of lines and walls used; `refused`: those too far from the expected place.
    """

    network: int
    worst_told_cm: float
    worst_learnt_cm: float
    marks: int
    refused: int
    parameters: Mapping[str, Learnt]


def learnt_calibrations(networks: Sequence[Any]) -> tuple[LearntCalibration, ...]:
    """Of each host that learns. `networks`: those of a world."""
    learnt = []
    for network in networks:
        learning = network.sight.tracker.learning if isinstance(network.sight, PixelSight) else None
        if learning is not None:
            learnt.append(_learnt(network.index, network.sight.camera.lens, learning))
    return tuple(learnt)


def _learnt(network: int, true: Any, learning: Any) -> LearntCalibration:
    initial, learnt, spreads = learning.begun.camera, learning.calibration.camera, learning.spreads()
    return LearntCalibration(
        network=network,
        worst_told_cm=100.0 * worst_error_m(true, learning.begun),
        worst_learnt_cm=100.0 * worst_error_m(true, learning.calibration),
        marks=learning.used,
        refused=learning.refused,
        parameters={
            name: Learnt(getattr(true, name), getattr(initial, name), getattr(learnt, name), spreads[name])
            for name in LEARNT
        },
    )


def calibration_text(learnt: LearntCalibration) -> str:
    """A line of text for people."""
    return (
        f"net{learnt.network}: {learnt.worst_told_cm:.2f} cm wrong at worst,"
        f" {learnt.worst_learnt_cm:.2f} cm at the end, after {learnt.marks} lines and walls"
    )


LEFT, RIGHT = "left_factor", "right_factor"
"""Values by which an estimator names the wheels' radii."""


class WheelFactor(msgspec.Struct, frozen=True):
    """A wheel's radius divided by the nominal one: the true value, and the estimator's at the end."""

    true: float
    learnt: float


class LearntWheels(msgspec.Struct, frozen=True):
    """Both wheels of one robot."""

    network: int
    slot: int
    left: WheelFactor
    right: WheelFactor


def learnt_wheels(networks: Sequence[Any]) -> tuple[LearntWheels, ...]:
    """The learnt wheels of each robot whose estimator learns them. `networks`: those of a world."""
    learnt = []
    for network in networks:
        for robot in network.robots:
            estimate = robot.pilot.command.estimate
            if LEFT in estimate and RIGHT in estimate:
                chassis = robot.drive.params.chassis
                left = WheelFactor(chassis.left_radius_factor, estimate[LEFT])
                right = WheelFactor(chassis.right_radius_factor, estimate[RIGHT])
                learnt.append(LearntWheels(network.index, robot.slot, left, right))
    return tuple(learnt)


def wheels_text(learnt: LearntWheels) -> str:
    """A line of text for people."""
    sides = ", ".join(
        f"{name} {100.0 * (factor.true - 1.0):+.2f} % (learnt {100.0 * (factor.learnt - 1.0):+.2f} %)"
        for name, factor in (("left", learnt.left), ("right", learnt.right))
    )
    return f"net{learnt.network}/robot{learnt.slot}: radius {sides}"
