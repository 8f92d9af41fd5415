"""The built-in paths in the whole loop: firmware, radio, motors, camera, wheels that do not match."""

import math

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World


def errors_cm(name, seed, *settings):
    """Distances of the robot from its reference, at each camera frame."""
    world, errors = World(load(name, settings).scenario, seed, load_hex(image_path())), []
    while not world.finished:
        robot = world.step().robots[0]
        errors.append(
            100.0 * math.hypot(robot.truth.x_m - robot.reference.x_m, robot.truth.y_m - robot.reference.y_m)
        )
    return errors


@pytest.mark.parametrize("name", ["line", "curve", "sine"])
def test_the_robot_stays_within_half_a_centimetre_of_the_path_where_the_camera_is_right(name):
    """Measured over seeds 0 to 9, in the last two thirds of the run: 0.37 cm at worst."""
    errors = errors_cm(name, 4, 'camera={kind="pixels", calibration="exact"}')
    assert max(errors[len(errors) // 3 :]) < 0.5


@pytest.mark.parametrize("name", ["line", "curve", "sine"])
def test_a_wrong_calibration_is_what_is_left(name):
    """2.40 cm is what the calibration is wrong by at worst; measured over seeds 0 to 9: 2.11 cm."""
    assert max(errors_cm(name, 4)[60:]) < 2.4


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_papers_law_drives_a_path_that_has_no_closed_form(seed):
    """Measured over seeds 0 to 9, in the last two thirds: 2.9 cm at worst, for a start 7.3 cm beside the path."""
    errors = errors_cm("waypoints", seed)
    assert errors[0] > 7.0
    assert max(errors[len(errors) // 3 :]) < 3.5


def test_a_closed_path_is_driven_lap_after_lap():
    errors = errors_cm(
        "sine",
        2,
        "duration_s=14",
        'camera={kind="gaussian"}',
        'network.robot.reference={kind="waypoints", closed=true,'
        " points=[{x_cm=30, y_cm=20}, {x_cm=70, y_cm=25}, {x_cm=50, y_cm=50}]}",
    )
    assert max(errors[100:]) < 1.2
