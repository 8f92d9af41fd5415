"""Worlds for tests: of built-in scenarios, of a text, and the line with other hosts and more robots."""

from functools import cache

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


@cache
def image():
    return load_hex(image_path())


def world_of(source, *settings, seed=SEED, **options):
    """A world of a built-in scenario, or of a scenario's text, with settings."""
    text = "\n" in source
    scenario = file.parse(source, "text", settings) if text else file.load(source, settings).scenario
    return World(scenario, seed, image(), **options)


def finished(world):
    """The same world at its end."""
    while not world.finished:
        world.step()
    return world


def fig6(**options):
    return world_of("fig6", **options)


def two_networks(host="", **options):
    return world_of(TWO_NETWORKS.format(host=host), **options)
