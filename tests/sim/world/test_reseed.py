"""New noise from a tick on: what changes, what is kept, and that a branch can be made again anywhere."""

import pytest

from miro_protocol.actions import Reseed
from tests.sim.world.board_rig import board_world
from tests.sim.world.rig import PERIOD, SEED, world_of

NOISY = (
    "duration_s=0.4",
    "network.radio.profile=fade15",
    "network.radio.telemetry=true",
    "network.radio.dropouts={every_s = 0.05, length_s = 0.02}",
    "network.radio.jitter_s=0.0001",
    "network.radio.lost_frames=0.2",
    "network.control_noise={v_m_s = 0.02, w_rad_s = 0.2}",
    "network.robot.wheel_radius_mismatch=0.015",
)
CAMERAS = {
    "gaussian": ("camera={kind = 'gaussian'}",),
    "geometric": ("camera={kind = 'geometric', calibration = '1997', lost_robots = 0.2}",),
    "pixels": ("camera={kind = 'pixels', calibration = '1997'}",),
}
SWITCH = 4 * PERIOD + 1234
"""In the middle of a bit."""


def noisy(*script, camera="gaussian", seed=SEED):
    world = world_of("fig6", *NOISY, *CAMERAS[camera], seed=seed)
    for action in script:
        world.do(action)
    return world


def digests(world):
    return [world.step().digest for _ in range(10)]


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_reseed_with_the_seed_that_a_run_has_changes_no_bit(camera):
    assert digests(noisy(Reseed(SWITCH, 0, SEED), camera=camera)) == digests(noisy(camera=camera))


@pytest.mark.parametrize("camera", CAMERAS)
def test_with_another_seed_all_is_equal_up_to_the_tick_and_differs_after_it(camera):
    plain, branch = digests(noisy(camera=camera)), digests(noisy(Reseed(SWITCH, 0, 10042), camera=camera))
    assert branch[:4] == plain[:4]
    assert branch[5:] != plain[5:]
    assert branch == digests(noisy(Reseed(SWITCH, 0, 10042), camera=camera))


def test_each_source_of_noise_has_the_other_seed_afterwards():
    world = noisy(Reseed(SWITCH, 0, 10042), camera="pixels")
    world.run_to(SWITCH + 1)
    network = world.networks[0]
    streams = [network.sight.chances, network.sight.eye.sensor.stream, *network.draws]
    streams += [network.downlink.jitter, network.downlink.lost, world.robot().noise]
    assert {stream.seed for stream in streams} == {10042}


def test_wheels_and_calibration_are_kept():
    branch, other = noisy(Reseed(120, 0, 10042), camera="geometric"), noisy(seed=10042, camera="geometric")
    own = noisy(camera="geometric")
    for world in (branch, other, own):
        world.run_to(PERIOD)
    radius = [repr(world.robot().drive) for world in (branch, own, other)]
    field = [repr(world.networks[0].sight.field) for world in (branch, own, other)]
    assert radius[0].split("tick")[0] == radius[1].split("tick")[0]
    assert field[0] == field[1] != field[2]


@pytest.mark.parametrize("at", [SWITCH - 121, SWITCH - 120, SWITCH - 1, SWITCH, SWITCH + 1, 7 * PERIOD + 5])
def test_a_world_saved_around_the_tick_goes_on_alike_in_another_one(at):
    script = Reseed(SWITCH, 0, 10042), Reseed(6 * PERIOD, 0, 3)
    whole = noisy(*script)
    whole.run_to(10 * PERIOD)
    world = noisy(*script)
    world.run_to(at)
    other = noisy()
    other.run_to(2 * PERIOD)
    other.load(world.save())
    other.run_to(10 * PERIOD)
    assert other.digest == whole.digest


def test_a_world_that_goes_back_before_the_tick_has_its_own_noise_again():
    world = noisy()
    saved = world.save()
    plain = digests(world)
    world.load(saved)
    world.do(Reseed(SWITCH, 0, 10042))
    assert digests(world) != plain
    world.load(saved)
    assert digests(world) == plain


def test_a_saved_world_whose_noise_is_of_a_later_tick_is_refused():
    world, other = noisy(Reseed(SWITCH, 0, 10042)), noisy()
    world.run_to(SWITCH + 1)
    actions = world.networks[0].actions
    actions.reseeds = [entry._replace(tick=1 << 40) for entry in actions.reseeds]
    with pytest.raises(ValueError, match="the noise of tick 1099511627776 is there at tick"):
        other.load(world.save())
    assert digests(other) == digests(noisy())


def test_the_new_seed_is_an_event_and_an_action_of_its_period():
    world = noisy(Reseed(SWITCH, 0, 10042))
    periods = [world.step() for _ in range(6)]
    assert periods[4].actions == (Reseed(SWITCH, 0, 10042),)
    events = [f"{event}" for _, event in world.networks[0].log.since(0) if event.what == "reseed"]
    assert events == [f"tick {SWITCH}: net0/pc: reseed 10042"]


def test_parts_of_a_board_get_the_noise_too():
    seeds = []
    for script in ((), (Reseed(1_000_000, 0, 5),)):
        world = board_world()
        for action in script:
            world.do(action)
        world.run_to(1_000_001)
        seeds.append({part.place.noise.seed for part in world.devices[0].board.parts})
    assert seeds == [{0}, {5}]
