"""For the tests of steps: a scenario of lines, its run, and the same run without steps."""

import msgspec

from miro_sim.scenario.file import parse
from miro_sim.world.world import World
from mirotwin.verify.cases.case import Trace
from mirotwin.verify.steps.player import Player
from mirotwin.verify.steps.reading import steps_of
from tests.mirotwin.verify.checks.rig import own_image

ORIGIN = "mine.scenario.toml"
SECOND = "duration_s = 1.0"


def scenario_of(steps, head=SECOND):
    """The built-in `silent` with these steps: inline tables, separated by commas."""
    return parse(f'scenario = "silent"\n{head}\nstep = [\n{steps}\n]\n', ORIGIN)


def read(steps, head=SECOND):
    return steps_of(scenario_of(steps, head), ORIGIN)


def play(steps, head=SECOND, image=None, finish=False):
    """The player, where the steps ended. `trace`: what was sent and done."""
    scenario = scenario_of(steps, head)
    world = World(scenario, 0, image or own_image())
    player = Player(world, steps_of(scenario, ORIGIN), ORIGIN)
    player.trace = Trace(world)
    player.play()
    if finish:
        player.finish()
    return player


def digest_without_steps(player, script=(), saved=None):
    """Of a run without steps, in which `script` is sent and done. `saved`: where it begins."""
    world = World(msgspec.structs.replace(player.world.scenario, step=()), 0, own_image(), script)
    if saved:
        world.load(saved)
    while not world.finished:
        world.step()
    return world.digest
