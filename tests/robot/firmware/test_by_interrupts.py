"""A firmware for the MIRO that waits for the LM629s' host interrupts where the shipped one asks them now and then."""

from pathlib import Path

import pytest

from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.conditions import Reached
from miro_sim.world.world import World
from mirotwin.conform.rules import RULES, find
from mirotwin.conform.trial import trial_of
from tests.mutants.build import build
from tests.mutants.score import judged
from tests.mutants.sdcc import needs_sdcc

pytestmark = needs_sdcc
FOLDER = Path(__file__).parent / "interrupts"


@pytest.fixture(scope="module")
def image():
    built = build({name: (FOLDER / name).read_text("utf-8") for name in ("watch.c", "watch.h")})
    assert not built.error, built.error
    return built.image


def test_it_keeps_every_rule(image):
    failed, *_ = judged(image, tuple(rule.id for rule in RULES))
    assert failed == ()


def test_it_drives_fig6(image):
    world = World(load("fig6").scenario, seed=0, image=load_hex(image))
    while not world.finished:
        world.step()
    assert world.faults == []
    x_m, y_m, _ = world.robot().drive.pose_at(world.tick)
    reference = world.last.robots[0].reference
    assert abs(complex(x_m - reference.x_m, y_m - reference.y_m)) < 0.03


@pytest.mark.parametrize("rule", ["P32", "P37", "P63"])
def test_its_interrupts_are_what_it_learns_from(image, rule):
    loaded = load_hex(image)
    trial = trial_of(find(rule))
    world = World(trial.scenario, 0, loaded, trial.script)
    entry = loaded.symbols.find("_watch_left").address
    assert world.run_until(Reached(slot=world.networks[0].robots[0].slot, address=entry)).address == entry
    while not world.finished:
        world.run_to(world.period_end)
    assert world.faults == []
