"""What the hosts of a run learnt about the wheels of their robots, beside the truth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

LEFT, RIGHT = "left_factor", "right_factor"
"""Values by which an estimator names the wheels' radii."""


class WheelFactor(msgspec.Struct, frozen=True):
    """A wheel's radius over the nominal one: as it is, and as the estimator has it at the end."""

    true: float
    learnt: float


class LearntWheels(msgspec.Struct, frozen=True):
    """Both wheels of one robot."""

    network: int
    slot: int
    left: WheelFactor
    right: WheelFactor


def learnt_wheels(networks: Sequence[Any]) -> tuple[LearntWheels, ...]:
    """Of each robot whose estimator learns them. `networks`: those of a world."""
    found = []
    for network in networks:
        for robot in network.robots:
            estimate = robot.pilot.command.estimate
            if LEFT in estimate and RIGHT in estimate:
                chassis = robot.drive.params.chassis
                left = WheelFactor(chassis.left_radius_factor, estimate[LEFT])
                right = WheelFactor(chassis.right_radius_factor, estimate[RIGHT])
                found.append(LearntWheels(network.index, robot.slot, left, right))
    return tuple(found)


def wheels_text(learnt: LearntWheels) -> str:
    """One line for people."""
    sides = ", ".join(
        f"{name} {100.0 * (factor.true - 1.0):+.2f} % (learnt {100.0 * (factor.learnt - 1.0):+.2f} %)"
        for name, factor in (("left", learnt.left), ("right", learnt.right))
    )
    return f"net{learnt.network}/robot{learnt.slot}: radius {sides}"
