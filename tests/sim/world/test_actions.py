"""Reset pins, supplies and radios while a world runs: what follows, and that it does not depend on who asked when."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact import engine
from miro_exact.clock import ticks
from miro_protocol.actions import Power, RadioState, Reseed, Reset
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.table import DOWNLINK
from miro_sim.world import conditions as wait
from miro_sim.world.actions import POWER, RADIO_UP, RESET, RXD, WaitingAction
from miro_sim.world.waits import WaitExpired
from tests.children import uncompiled
from tests.sim.world.rig import PERIOD, fig6, two_networks, world_of

HELD, RUNS, OFF, ON = 1, 0, 0, 1
BOOTED_TICK = ticks(0.060)
SPEED = 800


def silent(**options):
    return world_of("fig6", "network.host=silent", "network.radio.profile=wire", **options)


def driving(**options):
    """A robot that was told to drive, in a world whose host says nothing by itself."""
    world = silent(**options)
    world.run_to(BOOTED_TICK)
    say(world)
    world.run_to(world.tick + 2 * PERIOD)
    return world


def say(world, seq=1, speed=SPEED):
    world.inject(encode(TeamFrame(0, seq, ((speed, speed), (0, 0), (0, 0))), 3))


def accept(world):
    """Time for a frame, and for what the firmware does about it."""
    world.run_to(world.tick + 2 * PERIOD)


def test_a_reset_pulse_lets_the_firmware_begin_again():
    world = driving()
    assert world.robot().counter(0) == 1
    pressed = world.set_reset(HELD)
    world.run_to(pressed + 24_000)
    released = world.set_reset(RUNS)
    world.run_to(released + BOOTED_TICK)
    assert world.robot().counter(0) == 0
    assert world.robot().board.left.desired_velocity == 0
    say(world)
    accept(world)
    assert not world.faults


def test_a_processor_that_is_held_in_reset_executes_nothing():
    world = driving()
    world.run_to(world.set_reset(HELD) + 1)
    before = world.robot().board.cpu.instructions
    say(world, seq=2)
    world.run_to(world.tick + 5 * PERIOD)
    assert world.robot().board.cpu.instructions == before
    assert world.robot().board.held


def test_the_motion_controllers_go_on_while_the_processor_is_held_in_reset():
    world = driving()
    world.run_to(world.set_reset(HELD) + ticks(0.7))  # longer than both of the firmware's failsafe times
    assert world.robot().board.left.desired_velocity == SPEED << 8


def test_without_supply_the_motors_coast_and_with_it_everything_begins_anew():
    world = driving()
    world.run_to(world.set_power(OFF) + 1)
    board = world.robot().board
    assert (board.left.pwm_magnitude, board.right.pwm_magnitude) == (0, 0)
    moving = abs(world.robot().drive.velocity_at(world.tick)[0])
    world.run_to(world.tick + ticks(0.5))
    assert 0.0 <= abs(world.robot().drive.velocity_at(world.tick)[0]) < moving
    assert {board.cpu.peek_iram(address) for address in range(256)} == {0}
    world.run_to(world.set_power(ON) + BOOTED_TICK)
    say(world)
    accept(world)
    assert world.robot().counter(0) == 1
    assert not world.faults


def test_a_reset_pin_that_is_down_while_the_supply_comes_back_holds_the_processor():
    world = driving()
    for action in (world.set_power, world.set_reset, world.set_power):
        world.run_to(action(1 if action == world.set_reset or not world.robot().board.powered else 0) + 1)
    before = world.robot().board.cpu.instructions
    world.run_to(world.tick + PERIOD)
    assert world.robot().board.cpu.instructions == before
    world.run_to(world.set_reset(RUNS) + PERIOD)
    assert world.robot().board.cpu.instructions > before


@pytest.mark.parametrize("state", ["down", "noise"])
def test_no_frame_passes_a_radio_that_is_off_or_drowned(state):
    world = driving()
    changed = world.set_radio(state)
    world.run_to(changed)
    say(world, seq=2)
    world.run_to(world.tick + 2 * PERIOD)
    assert world.robot().counter(0) == 1
    world.run_to(world.set_radio("up") + 1)
    world.run_to(world.tick + PERIOD)
    say(world, seq=3)
    accept(world)
    assert world.robot().counter(0) == 2


def test_in_noise_robot_and_pc_hear_characters_that_nobody_sent():
    world = driving()
    world.run_to(world.set_radio("noise"))
    assert world.run_until(wait.Heard(), within=PERIOD).what == "heard"
    assert world.run_until(wait.Received(), within=PERIOD).what == "received"


def test_an_answer_does_not_come_through_a_radio_that_is_off():
    world = driving()
    begun = world.inject(encode(TeamFrame(3, 3, ((0, 0),) * 3), 3))
    world.run_to(begun + DOWNLINK[3].air_ticks)
    world.set_radio("down")
    with pytest.raises(WaitExpired):
        world.run_until(wait.Answer(), within=2 * PERIOD)


SCRIPT = (
    RadioState(1_000_000, 0, "noise"),
    RadioState(1_300_003, 0, "up"),
    Reset(2_000_001, 0, 0, HELD),
    Reset(2_000_300, 0, 0, RUNS),
    RadioState(3_000_000, 0, "down"),
    Power(3_000_000, 0, 2, OFF),
    Reset(4 * PERIOD, 1, 1, HELD),
    Reseed(3_300_001, 0, 11),
    RadioState(3_400_000, 0, "up"),
    Power(3_900_123, 0, 2, ON),
    Reset(5 * PERIOD, 1, 1, RUNS),
)
PERIODS = 8


def scripted():
    world = two_networks(script=SCRIPT)
    world.run_to(PERIODS * PERIOD)
    return world


@pytest.mark.slow
@settings(max_examples=8)
@given(st.data())
def test_when_an_action_is_announced_and_where_the_world_stops_change_no_bit(data):
    world = two_networks(script=[])
    for action in SCRIPT:
        latest = action.tick - 120
        world.run_to(data.draw(st.integers(min(world.tick, latest), latest)))
        world.do(action)
        if data.draw(st.booleans()):
            other = two_networks(script=[])
            other.load(world.save())
            world = other
    world.run_to(PERIODS * PERIOD)
    assert world.digest == scripted().digest


def test_a_wait_among_actions_changes_no_bit():
    world = two_networks(script=SCRIPT)
    with pytest.raises(WaitExpired):
        world.run_until(wait.When(predicate=lambda robot: False, at="sample"), within=PERIODS * PERIOD)
    assert world.digest == scripted().digest


def test_a_period_names_its_actions():
    world = two_networks(script=SCRIPT)
    periods = [world.step() for _ in range(PERIODS)]
    assert sorted((action for period in periods for action in period.actions), key=lambda one: one.tick) == [
        *SCRIPT
    ]
    assert periods[2].actions == SCRIPT[2:4]


def test_actions_are_events_that_say_what_was_done():
    world = two_networks(script=SCRIPT)
    world.run_to(PERIODS * PERIOD)
    told = [
        str(event) for _, event in world.networks[0].log.since(0) if event.what in ("reset", "power", "radio")
    ]
    assert told[0] == "tick 1000000: net0/pc: radio noise"
    assert told[2] == "tick 2000001: net0/robot0: reset 1"
    assert "tick 3000000: net0/robot2: power 0" in told


@pytest.mark.parametrize(
    ("action", "what"),
    [
        (Reset(119, 0, 0, 1), "the earliest is 120"),
        (Reset(120, 1, 0, 1), "network 1 does not exist; there is 1, numbered from 0"),
        (Power(120, 0, 2, 1), "no robot in slot 2; there is 0"),
        (Reset(120, 0, 0, 2), "level 2; give 0 or 1"),
        (RadioState(120, 0, "loud"), "give up, down, noise"),
        (RadioState(1 << 62, 0, "up"), "the earliest is"),
        (Reseed(120, 0, 1 << 63), "seed 9223372036854775808; give 0 to"),
        (Reseed(120, 0, -1), "seed -1; give 0 to"),
    ],
)
def test_what_cannot_be_done_is_refused(action, what):
    world = fig6()
    before = world.save()
    with pytest.raises(ValueError, match=what):
        world.do(action)
    assert world.save() == before


def test_an_action_is_saved_with_the_world():
    world = silent()
    world.do(Reset(BOOTED_TICK, 0, 0, HELD))
    other = silent()
    other.load(world.save())
    other.run_to(BOOTED_TICK + PERIOD)
    assert other.robot().board.held


@pytest.mark.parametrize(
    "move",
    [
        lambda world: world.run_to(1.5),
        lambda world: world.run_for(0.5),
        lambda world: world.run_until(wait.Heard(), within=1e3),
        lambda world: world.inject(b"U", at_tick=1e6),
        lambda world: world.do(Reset(1e6, 0, 0, 1)),
    ],
)
def test_a_time_that_is_no_whole_number_of_ticks_is_refused(move):
    world = fig6()
    before = world.save()
    with pytest.raises(ValueError, match="is no whole number of ticks"):
        move(world)
    assert world.save() == before


@pytest.mark.parametrize(
    "waiting",
    [
        WaitingAction(50_000, RESET, 3, 1),
        WaitingAction(50_000, POWER, 0, 2),
        WaitingAction(50_000, RADIO_UP, 0, 3),
        WaitingAction(50_000, RXD, 3, 1),
    ],
)
def test_a_saved_action_that_cannot_be_done_is_refused(waiting):
    world, other = silent(), silent()
    world.networks[0].actions.waiting = [waiting]
    with pytest.raises(ValueError, match="an action waits for slot"):
        other.load(world.save())


def digest_of_actions():
    """Of three periods with all kinds of actions and without a picture, which takes long uncompiled."""
    actions = [RadioState(400_000, 0, "noise"), RadioState(700_003, 0, "up")]
    actions += [Reset(900_001, 0, 0, HELD), Reset(900_400, 0, 0, RUNS)]
    actions += [Reseed(350_001, 0, 99), Reseed(800_001, 0, 98)]
    actions += [Power(1_200_000, 0, 0, OFF), RadioState(1_300_000, 0, "down"), Power(1_500_123, 0, 0, ON)]
    settings = ["network.host=silent", "network.radio.profile=fade15", "camera={kind = 'gaussian'}"]
    world = world_of("fig6", *settings, script=actions)
    world.run_to(3 * PERIOD)
    return world.digest


@pytest.mark.skipif(engine.active() != "compiled", reason="no compiled modules here")
def test_actions_give_the_same_bits_compiled_and_uncompiled():
    code = "from tests.sim.world.test_actions import digest_of_actions; print(digest_of_actions())"
    assert uncompiled(code).strip() == digest_of_actions()
