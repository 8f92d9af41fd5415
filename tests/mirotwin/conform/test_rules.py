"""Every rule passes for the shipped firmware and fails for a planted mistake; frames that are sealed in wrong ways."""

from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.frames import seal
from miro_protocol.table import DOWNLINK, TELEMETRY
from miro_protocol.transmission import Transmission
from miro_robot.image import Symbols
from miro_sim.world.world import World
from mirotwin.conform.hints import wheels_instead
from mirotwin.conform.rule_monitor import ConformsTo
from mirotwin.conform.rules import ALL, find
from mirotwin.conform.run import try_rule
from mirotwin.conform.sealing import MISTAKES as SEALINGS
from mirotwin.conform.sealing import Sealing, mistake_in
from mirotwin.conform.trial import trial_of
from mirotwin.conform.trial_script import Frame
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.checks.orders import Order
from tests.mirotwin.conform.images import HANGS, image_of
from tests.mirotwin.conform.mistakes import MISTAKES
from tests.mirotwin.verify.checks.rig import built, finish, needs_sdcc, own_image, silent_world

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
        assert f"# {section}\n" in (Path(__file__).parents[3] / page).read_text()


@pytest.mark.parametrize("id", ["P18", "P29", "P44", "P48", "P49"])
def test_a_rule_needs_no_symbols(id):
    image = msgspec.structs.replace(own_image(), symbols=Symbols({}))
    assert try_rule(find(id), image).verdict == "passed"


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
    assert set(finish(world, checks).values()) == {"not judged"}


def test_a_trial_of_which_a_network_says_less_is_not_judged_there():
    trial = trial_of(find("P29"))
    said = [one for one in trial.script if one.network == 0 or not isinstance(one, Transmission)]
    world = World(trial.scenario, 0, own_image(), script=said)
    places = [(1, robot.slot) for robot in world.networks[1].robots]
    checks = Checks(world, {place: [ConformsTo(rule="P29")] for place in places})
    assert set(finish(world, checks).values()) == {"not judged"}


# Frames that are sealed in usual wrong ways, and what is told of a robot by them

FORMATS = (*DOWNLINK.values(), TELEMETRY)
ENDS = st.integers(-16633, 16633)
PAIRS = st.tuples(ENDS, ENDS)


def bodies(form):
    return st.binary(min_size=form.body_size, max_size=form.body_size)


@given(st.data())
def test_without_a_mistake_a_frame_is_sealed_as_the_protocol_seals_it(data):
    form = data.draw(st.sampled_from(FORMATS))
    body = data.draw(bodies(form))
    assert Sealing().seal(form, body) == seal(form, body)


@given(st.data())
def test_a_sealing_opens_what_it_sealed(data):
    form = data.draw(st.sampled_from(FORMATS))
    body = data.draw(bodies(form))
    sealing = data.draw(st.sampled_from([one for one in SEALINGS.values() if one.sync == form.sync]))
    assert sealing.opened(form, sealing.seal(form, body)[len(form.lead) :]) == body


@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_no_two_mistakes_make_the_same_frame_and_only_the_right_layout_byte_makes_the_right_one(form):
    body = bytes(range(1, form.body_size + 1))
    made = {what: sealing.seal(form, body) for what, sealing in SEALINGS.items()}
    assert len(set(made.values())) == len(made)
    right = [what for what, sealed in made.items() if sealed == seal(form, body)]
    assert right == [f"a CRC that begins with layout byte {form.layout:02X}h"]


@given(st.data())
def test_the_mistake_in_an_answer_is_found_by_its_characters_alone(data):
    sealing = data.draw(st.sampled_from([one for one in SEALINGS.values() if one.sync == TELEMETRY.sync]))
    body = bytes([0x96]) + data.draw(bodies(TELEMETRY))[1:]
    characters = sealing.seal(TELEMETRY, body)[len(TELEMETRY.lead) :]
    found = SEALINGS[mistake_in(TELEMETRY, characters, 0x96)]
    assert found.seal(TELEMETRY, found.opened(TELEMETRY, characters))[5:] == characters


def told(pair):
    return [Order(0, side, "drive", word << 8) for side, word in zip(("left", "right"), pair, strict=True)]


def frame(*words):
    return Frame(0, 0, 0, 1, words, "team frame")


@given(st.lists(PAIRS, min_size=3, max_size=3), st.integers(0, 2))
def test_nothing_is_said_of_wheels_that_do_as_told(words, slot):
    assert wheels_instead(told(words[slot]), frame(*words), slot) == ""


def test_nothing_is_said_of_velocities_at_the_limit_where_one_mistake_looks_like_another():
    assert wheels_instead(told((16632, -16633)), frame((16633, -16633)), 0) == ""


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ((-978, 983), "the signs of both are turned over"),
        ((978, 983), "the right one goes the wrong way"),
        ((-983, 978), "left and right are exchanged"),
        ((-11773, 10748), "the bytes of each are exchanged: the low one comes first"),
        ((-1279, 1284), "these are the velocities of robot 2"),
        ((3912, -3932), "4 times as fast"),
        ((489, -492), "2 times as slow"),
        ((1, 2), ""),
    ],
)
def test_one_mistake_that_explains_both_wheels_is_named(found, said):
    assert wheels_instead(told(found), frame((-677, 682), (978, -983), (-1279, 1284)), 1) == said
