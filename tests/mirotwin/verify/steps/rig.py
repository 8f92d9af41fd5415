"""For the tests of steps: a scenario of lines, and its run."""

from __future__ import annotations

from functools import cache

import msgspec

from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_sim.scenario.file import parse
from miro_sim.scenario.keys import Scenario
from miro_sim.world.world import World
from mirotwin.verify.steps.keys import Step
from mirotwin.verify.steps.player import Player
from mirotwin.verify.steps.reading import steps_of

MS = 24_000
ORIGIN = "mine.scenario.toml"


@cache
def own_image() -> Image:
    return load_hex(image_path())


def scenario_of(steps: str, head: str = "duration_s = 1.0") -> Scenario:
    """The built-in `silent` with these steps: inline tables, separated by commas."""
    return parse(f'scenario = "silent"\n{head}\nstep = [\n{steps}\n]\n', ORIGIN)


def read(steps: str, head: str = "duration_s = 1.0") -> list[Step]:
    return steps_of(scenario_of(steps, head), ORIGIN)


def play(
    steps: str,
    head: str = "duration_s = 1.0",
    image: Image | None = None,
    seed: int = 0,
    finish: bool = False,
) -> Player:
    """The player, where the steps ended."""
    scenario = scenario_of(steps, head)
    world = World(scenario, seed, image or own_image())
    player = Player(world, steps_of(scenario, ORIGIN), ORIGIN)
    player.play()
    if finish:
        player.finish()
    return player


def without_steps(scenario: Scenario) -> Scenario:
    return msgspec.structs.replace(scenario, step=())
