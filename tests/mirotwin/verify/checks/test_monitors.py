"""Feeding checks changes no bit of a run, and gives the same verdicts however the run is cut."""

import random

import pytest

from miro_robot.event_log import RECEIVED
from miro_sim.scenario.file import load, parse
from miro_sim.world import conditions
from miro_sim.world.world import World
from mirotwin.verify.checks.interface import Check, Monitor
from mirotwin.verify.checks.monitors import Checks, ExpectationFailed
from tests.mirotwin.conform.images import BABBLES, HANGS, image_of
from tests.mirotwin.verify.checks.rig import MS, finish, own_image, send, silent_world, team
from tests.mirotwin.verify.checks.test_planted import ALL
from tests.robot.board.rig import RESET, START
from tests.robot.board.rig import image_of as assembled

EVERYTHING = ALL + "tracks_within_cm = 0.1\nsettles_within_s = 0.2\ninside_pitch = true\n"
TWO = f"""
name = "two"
duration_s = 0.5

[expect]
{EVERYTHING}

[[network]]
radio.profile = "fade15"
robot = [{{ slot = 0, reference.kind = "line" }}, {{ slot = 2, reference.kind = "arc" }}]

[[network]]
robots = 5
robot = [{{ slot = 4, reference.kind = "line", start_error_x_cm = 3.0 }}]
"""


def judged(seed, advance, text=TWO):
    scenario = parse(text, "two")
    world = World(scenario, seed, own_image())
    checks = Checks(world)
    while not world.finished:
        advance(world)
    checks.finish()
    return world.digest, checks.verdicts(), checks.failures


@pytest.mark.parametrize("seed", range(3))
def test_a_run_with_all_checks_has_the_digest_of_one_without(seed):
    plain = World(parse(TWO, "two"), seed, own_image())
    while not plain.finished:
        plain.step()
    digest, verdicts, failures = judged(seed, World.step)
    assert digest == plain.digest
    assert {one.name for one in verdicts if one.verdict == "failed"} >= {"tracks_within_cm"}
    assert failures


LATER = """
name = "later"
duration_s = 1.5
stop_on_fault = false

[expect]
tracks_within_cm = 0.8
inside_pitch = true
frames_accepted_min = 40

[[network]]
radio.profile = "{profile}"
robot = [{{ slot = 0, reference.kind = "line" }}, {{ slot = 2, reference.kind = "arc" }}]
"""


@pytest.mark.parametrize(
    "image", [own_image(), image_of(HANGS), image_of(BABBLES)], ids=["own", "hangs", "babbles"]
)
@pytest.mark.parametrize("profile", ["weaker", "fade15"])
def test_periods_that_are_told_together_are_judged_as_one_by_one(image, profile):
    """Who asks for failures is told of all periods so far."""

    def found(asking):
        world = World(parse(LATER.format(profile=profile), "later"), 2, image)
        checks = Checks(world)
        draw = random.Random(5)
        seen = []
        while not world.finished:
            world.step()
            if draw.random() < 0.1:
                world.set_reset(draw.randrange(2), slot=draw.choice((0, 2)))
            if asking:
                seen = checks.failures
        assert checks.together > 1
        assert not asking or seen == checks.failures
        checks.finish()
        return checks.verdicts(), checks.failures, [repr(one) for one in checks.monitors]

    assert found(asking=False) == found(asking=True)


class Listing(Check, frozen=True, kw_only=True, tag="listing"):
    """Its monitor keeps the events of these kinds."""

    KIND = "safety"

    kinds: tuple[str, ...]
    later: bool = False

    def monitor(self, subject):
        monitor = ListingMonitor(self, subject)
        monitor.EVENTS, monitor.LATER, monitor.heard = self.kinds, self.later, []
        return monitor


class ListingMonitor(Monitor[Listing]):
    def event(self, event):
        self.heard.append(event)


def test_who_may_be_told_later_hears_all_of_a_board_that_fills_its_log():
    often = "MOV P2,#0E6h\nMOV P0,#01h\nagain:\nCPL P2.2\nMOV R7,#50\nDJNZ R7,$\nSJMP again\n"
    world = World(parse(LATER.format(profile="weaker"), "later"), 2, assembled(START + RESET + often))
    checks = Checks(world, {(0, 0): [Listing(kinds=("command", "start_lost"), later=True)]})
    for _ in range(12):
        world.step()
    log = world.networks[0].robots[0].log
    assert log.first > 0
    assert [len(monitor.heard) for monitor in checks.monitors] == [log.end]  # STT; most come too soon


@pytest.mark.parametrize("seed", range(3))
def test_stops_and_waits_at_any_tick_change_no_verdict(seed):
    draw = random.Random(seed)

    def wander(world):
        if draw.random() < 0.5:
            world.run_to(world.tick + draw.randrange(1, 900_000))
        else:
            world.run_until([conditions.Received(), conditions.Sent()])

    whole = judged(seed, World.step)
    assert judged(seed, wander) == whole


def test_a_saved_world_of_a_scenario_goes_on_under_other_expectations():
    plain = World(load("fig6").scenario, 1, own_image())
    plain.run_to(100 * MS)
    other = World(load("fig6", ["expect.inside_pitch=true"]).scenario, 1, own_image())
    other.load(plain.save())
    assert other.step().digest == plain.step().digest


def test_failures_are_raised_for_tests_in_python():
    world, checks = silent_world("frames_accepted_min = 3")
    send(world, [team(1, 10, 10)])
    finish(world, checks)
    with pytest.raises(ExpectationFailed, match=r"wanted at least 3 frames accepted, found 1$") as caught:
        checks.check()
    assert [(one.check, one.network, one.slot) for one in caught.value.failures] == [
        ("frames_accepted_min", 0, 1)
    ]


def test_a_world_that_is_loaded_meanwhile_is_no_run_to_judge():
    world, checks = silent_world("")
    world.step()
    saved = world.save()
    world.step()
    world.load(saved)
    with pytest.raises(
        RuntimeError, match="control period 1 follows 1: the world was loaded; begin new checks"
    ):
        world.step()
    checks.finish()
    Checks(world)
    world.step()


def test_events_that_the_log_no_longer_holds_leave_nothing_judged():
    world, checks = silent_world("acts_within_ms = true\ninside_pitch = true")
    send(world, [team(1, 10, 10)])
    for _ in range(2049):
        world.robot(0, 1).board.log.note(RECEIVED, world.tick, 1, 0)
    found = finish(world, checks)
    assert (found["acts_within_ms"], found["inside_pitch"]) == ("not judged", "passed")


def test_a_judge_hears_every_event_once_in_the_order_of_ticks():
    world, _ = silent_world("")
    kinds = ("sent", "frame", "damaged", "command", "received", "transmitted", "answer")
    checks = Checks(world, {(0, 1): [Listing(kinds=kinds)]})
    send(world, [team(seq, 100, -100, ask=True) for seq in range(1, 8)] + [team(7, 1, 1)])
    finish(world, checks)
    (monitor,) = checks.monitors
    ticks = [event.tick for event in monitor.heard]
    counts = {what: len([event for event in monitor.heard if event.what == what]) for what in kinds}
    assert ticks == sorted(ticks)
    assert (counts["sent"], counts["frame"], counts["received"]) == (8, 8, 8 * 23)
    assert (counts["answer"], counts["transmitted"]) == (3, 3 * 19)
    assert [event.value for event in monitor.heard if event.what == "frame"] == [1] * 7 + [0]


def test_a_robot_that_is_reset_owes_nothing_from_before():
    world, checks = silent_world(ALL)
    world.run_to(60 * MS)
    send(world, [team(1, 900, 900, ask=True)])
    world.run_to(world.set_reset(1) + 100)
    world.set_reset(0)
    world.run_to(world.tick + 300 * MS)
    send(world, [team(2, 700, 700, ask=True)])
    finish(world, checks)
    assert [failure for failure in checks.failures if failure.check != "frames_accepted_min"] == []


def test_a_reset_pin_that_stays_down_excuses_no_other_robot():
    scenario = parse(TWO, "two", ["expect.failsafe_stop_ms=true"])
    world = World(scenario, 1, own_image())
    checks = Checks(world)
    world.run_to(world.set_reset(1, 0, 2))
    finish(world, checks)
    answers = {one.slot for one in checks.failures if one.check == "answers_within_ms"}
    assert 2 not in answers
