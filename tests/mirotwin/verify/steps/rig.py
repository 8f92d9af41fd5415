"""For the tests of steps: a scenario of lines, and its run."""

from functools import cache

import msgspec

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import parse
from miro_sim.world.world import World
from mirotwin.verify.steps.player import Player
from mirotwin.verify.steps.reading import steps_of

MS = 24_000
ORIGIN = "mine.scenario.toml"


@cache
def own_image():
    return load_hex(image_path())


def scenario_of(steps, head="duration_s = 1.0"):
    """The built-in `silent` with these steps: inline tables, separated by commas."""
    return parse(f'scenario = "silent"\n{head}\nstep = [\n{steps}\n]\n', ORIGIN)


def read(steps, head="duration_s = 1.0"):
    return steps_of(scenario_of(steps, head), ORIGIN)


def play(steps, head="duration_s = 1.0", image=None, seed=0, finish=False):
    """The player, where the steps ended."""
    scenario = scenario_of(steps, head)
    world = World(scenario, seed, image or own_image())
    player = Player(world, steps_of(scenario, ORIGIN), ORIGIN)
    player.play()
    if finish:
        player.finish()
    return player


def without_steps(scenario):
    return msgspec.structs.replace(scenario, step=())
