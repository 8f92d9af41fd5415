"""`happens` and `never_happens` judge a condition as a wait finds it, to the tick."""

import json

import msgspec
import pytest

from miro_protocol.frames import encode
from miro_sim.scenario.errors import ScenarioError
from miro_sim.world.conditions import CONDITIONS
from tests.mirotwin.verify.checks.rig import MS, finish, send, silent_world, team

FRAMES = [
    encode(team(1, 900, 800, ask=True), 3),
    encode(team(3, 500, 400), 3),
    encode(team(4, 0, 0, ask=True), 3),
]
GIVEN = [
    {"event": "answer"},
    {"event": "answer", "slot": 1, "seq": 4, "accepted": 3, "stopped": False},
    {"event": "heard"},
    {"event": "heard", "byte": 0x2D},
    {"event": "frame"},
    {"event": "frame", "slot": 1, "seq": 3},
    {"event": "command", "name": "STT", "side": "right"},
    {"event": "command", "side": "left", "hex": "03 0f 01 90 00 28 0b b8 07 d0"},
    {"event": "received", "byte": 0xD4},
    {"event": "transmitted", "byte": 0xFF},
    {"event": "sent"},
]
NEVER = [
    {"event": "answer", "seq": 5},
    {"event": "answer", "slot": 0},
    {"event": "frame", "seq": 9},
    {"event": "command", "hex": "01 02 03"},
    {"event": "fault"},
    {"event": "touch"},
    {"event": "frame", "network": 1},
]


def judged(name, given):
    keys = {f"condition.{key}": value for key, value in given.items()} | {"until_tick": 1000 * MS}
    world, checks = silent_world("".join(f"{name}.{key} = {json.dumps(keys[key])}\n" for key in keys))
    send(world, FRAMES)
    verdicts = finish(world, checks)
    return verdicts, [one.tick for one in checks.failures]


@pytest.mark.parametrize("given", GIVEN, ids=str)
def test_a_condition_is_judged_at_the_tick_at_which_a_wait_for_it_ends(given):
    world, checks = silent_world("")
    send(world, FRAMES)
    event = world.run_until(msgspec.convert(given, CONDITIONS[given["event"]]))
    checks.finish()
    assert judged("never_happens", given)[1] == [event.tick]
    assert judged("happens", given)[0]["happens"] == "passed"


@pytest.mark.parametrize("given", NEVER, ids=str)
def test_what_does_not_come_fails_the_one_and_passes_the_other(given):
    verdict = "not judged" if "network" in given else "failed"
    assert judged("happens", given)[0]["happens"] == verdict
    assert judged("never_happens", given)[1] == []


def test_a_condition_that_no_log_records_is_refused_with_those_that_are():
    with pytest.raises(ScenarioError, match=r"condition\.event: .edge. is not one of the choices"):
        silent_world("never_happens = { condition = { event = 'edge', pin = 'rxd' }, until_tick = 24000 }")
