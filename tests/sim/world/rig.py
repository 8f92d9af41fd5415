"""Worlds for the tests of waiting and injecting: the built-in line, with other hosts and more robots."""

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file
from miro_sim.world.world import World

PERIOD = CONTROL_PERIOD_TICKS
SEED = 7
TWO_NETWORKS = """
name = "two"
duration_s = 0.4

[[network]]
{host}

[[network.robot]]
slot = 0
reference.kind = "line"

[[network.robot]]
slot = 2
reference.kind = "arc"

[[network]]

[[network.robot]]
slot = 1
reference.kind = "line"
"""
_IMAGES = []


def image():
    if not _IMAGES:
        _IMAGES.append(load_hex(image_path()))
    return _IMAGES[0]


def fig6(seed=SEED, **options):
    return World(file.load("fig6").scenario, seed, image(), **options)


def two_networks(host="", seed=SEED, **options):
    return World(file.parse(TWO_NETWORKS.format(host=host), "two"), seed, image(), **options)
