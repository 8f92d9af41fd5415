"""Runs of boards as `mirotwin test` does them, and what else must give the same bits: cut, loaded, in another order.

`digests.py` freezes how they end.
"""

import random

import tomli_w
from msgspec.structs import replace

from miro_protocol.transmission import Transmission
from miro_sim.scenario.board import PERIOD_TICKS
from miro_sim.scenario.board_scenario import any_of_text, load_any
from miro_sim.world.world import World
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.firmware_image import image_for
from mirotwin.verify.checks.expect import expectations_in
from mirotwin.verify.steps.reading import steps_in


class _Over(Exception):
    """The run has come to where it is cut."""


def run_of(text, image, seed):
    """A run at its first tick, traced."""
    spec = RunSpec.of(text, image, seed)
    return Run.traced(replace(spec, expected=expectations_in(text), steps=steps_in(text)))


def play(run, duration_s=None):
    """Plays its steps, to the end of its scenario, or of the period in which `duration_s` ends. Returns it."""
    scenario = run.world.scenario
    last = scenario.periods - 1
    if duration_s is not None:
        last = min(last, replace(scenario, duration_ticks=round(duration_s * scenario.clock)).periods - 1)

    def look(period):
        if period.index >= last:
            raise _Over

    if last < scenario.periods - 1:
        run.world.observers.append(look)
    try:
        run.player.play()
        run.drive(move=run.player.finish)
        run.finish()
    except _Over:
        pass
    return run


def digest(entry):
    """Of a board's scenario file, as far as its entry says."""
    text = load_any(entry.scenario, entry.settings)
    return play(run_of(text, image_for(text), entry.seed), entry.duration_s).world.digest


def shuffled(text, seed):
    """The same scenario with the parts, nets, pins and keys of its file in another order."""
    return any_of_text(tomli_w.dumps(_shuffled(text.tables, random.Random(seed))), text.origin)


def _shuffled(table, draw):
    keys = draw.sample(list(table), len(table))
    return {key: _shuffled(table[key], draw) if isinstance(table[key], dict) else table[key] for key in keys}


def in_pieces(run, seed, stops):
    """The digest of what was played, told all at its start, and at random ticks saved and loaded into another world."""
    spec = run.spec

    def fresh():
        return World(spec.scenario, spec.seed, spec.image, ())

    world = fresh()
    for item in run.trace.script():
        if isinstance(item, Transmission):
            world.inject(item.data, item.network, item.tick)
        else:
            world.do(item)
    end_tick = spec.scenario.periods * PERIOD_TICKS
    draw = random.Random(seed)
    for stop in sorted(draw.randrange(end_tick) for _ in range(stops)):
        world.run_to(stop)
        saved, world = world.save(), fresh()
        world.load(saved)
    world.run_to(end_tick)
    return world.digest
