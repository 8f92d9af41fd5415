"""Every rule passes for the shipped firmware, and fails for an image that does nothing and for a planted mistake."""

from pathlib import Path

import pytest

from miro_protocol.transmission import Transmission
from miro_sim.world.world import World
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.conform.rule_monitor import ConformsTo
from mirotwin.verify.conform.rules import ALL, find
from mirotwin.verify.conform.run import try_rule
from mirotwin.verify.conform.trial import trial_of
from tests.mirotwin.verify.checks.rig import built, needs_sdcc, own_image, silent_world
from tests.mirotwin.verify.conform.images import HANGS, image_of
from tests.mirotwin.verify.conform.mistakes import MISTAKES

IDS = [rule.id for rule in ALL]


@pytest.mark.parametrize("id", IDS)
def test_the_shipped_firmware_keeps_the_rule(id):
    outcome = try_rule(find(id), own_image())
    assert not outcome.failures
    assert outcome.fault_count == 0


@pytest.mark.parametrize("id", IDS)
def test_an_image_that_does_nothing_breaks_the_rule(id):
    assert try_rule(find(id), image_of(HANGS)).verdict != "passed"


@needs_sdcc
@pytest.mark.parametrize("name", [name for name, mistake in MISTAKES.items() if mistake.fails])
def test_a_mistake_in_the_firmware_breaks_the_rules_that_it_concerns(name):
    mistake = MISTAKES[name]
    image = built(mistake.file, mistake.right, mistake.wrong)
    kept = [id for id in mistake.fails.split() if not broken(id, image)]
    assert kept == []


def broken(id, image):
    rule = find(id)
    outcome = try_rule(rule, image)
    forbidden = [fault for _, _, fault in outcome.faults if fault.kind in rule.faults]
    return bool(outcome.failures or forbidden)


def test_each_rule_has_a_mistake_that_breaks_it():
    assert {id for mistake in MISTAKES.values() for id in mistake.fails.split()} == set(IDS)


def test_rules_are_numbered_in_order_have_a_name_each_and_say_must_and_where_they_come_from():
    assert [f"P{number:02d}" for number in range(1, len(IDS) + 1)] == IDS
    assert len({rule.name for rule in ALL}) == len(ALL)
    for rule in ALL:
        assert "MUST" in rule.text
        page, _, section = rule.source.partition(", ")
        assert f"# {section}\n" in (Path(__file__).parents[4] / page).read_text()


@pytest.mark.parametrize("seed", range(1, 7))
def test_noise_of_any_seed_is_no_reason_to_fail(seed):
    assert try_rule(find("P15"), own_image(), seed).verdict == "passed"


def test_a_trial_depends_on_its_rule_alone():
    rule = find("P13")
    one = trial_of(rule)
    trial_of.cache_clear()
    other = trial_of(rule)
    assert one is not other
    assert one.script == other.script
    assert one.scenario == other.scenario


def test_a_run_that_is_no_trial_of_the_rule_is_not_judged():
    world, _ = silent_world("")
    checks = Checks(world, {(0, 1): [ConformsTo(rule="P02")]})
    world.inject(bytes(10))
    while not world.finished:
        world.step()
    checks.finish()
    assert [one.verdict for one in checks.verdicts()] == ["not judged"]


def test_a_trial_of_which_a_network_says_less_is_not_judged_there():
    trial = trial_of(find("P29"))
    said = [one for one in trial.script if one.network == 0 or not isinstance(one, Transmission)]
    world = World(trial.scenario, 0, own_image(), script=said)
    places = [(1, robot.slot) for robot in world.networks[1].robots]
    checks = Checks(world, {place: [ConformsTo(rule="P29")] for place in places})
    while not world.finished:
        world.step()
    checks.finish()
    assert [one.verdict for one in checks.verdicts()] == ["not judged"]
