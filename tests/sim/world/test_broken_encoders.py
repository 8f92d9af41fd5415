"""A robot of which an encoder breaks: it stands in the end, whatever its host says. The fault enters no digest."""

import pytest

from miro_exact.clock import TICKS_PER_SECOND
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World

MS = TICKS_PER_SECOND // 1000
IMAGE = load_hex(image_path())
SCENARIO = load("silent", ["duration_s=9"]).scenario
OPEN = (1, 1)
"""Both wires of the encoder broken, with pull-ups at the LM629."""
WAYS = (OPEN, (0, -1), (1, -1), (-1, 0), (-1, 1))


def driven(velocity, seed=0):
    """A world whose host tells its robot this for ever."""
    frames = [
        Transmission(
            round((60 + 33.37 * seq) * MS), DOWN, encode(TeamFrame(0, seq % 64, ((velocity,) * 2,) * 3), 3)
        )
        for seq in range(260)
    ]
    return World(SCENARIO, seed, IMAGE, frames)


def stands(world):
    v_m_s, w_rad_s = world.robot().drive.velocity_at(world.tick)
    return abs(v_m_s) < 1e-3 and abs(w_rad_s) < 1e-2


def broken_at(world, tick, side, way):
    world.run_to(tick)
    encoder_of(world, side).hold(*way)


def encoder_of(world, side):
    drive = world.robot().drive
    return drive.right_encoder if side else drive.left_encoder


def a_robot_stands(velocity, seed, within_ms):
    world = driven(velocity, seed)
    broken_at(world, round((400 + 0.7 * seed) * MS), seed & 1, WAYS[seed % len(WAYS)])
    world.run_for(within_ms * MS)
    assert stands(world)
    world.run_for(500 * MS)
    assert stands(world)
    assert world.faults == []


@pytest.mark.parametrize(("velocity", "within_ms"), [(2279, 900), (16633, 2600)])
@pytest.mark.parametrize("seed", range(5))
def test_a_robot_stands_after_an_encoder_broke(velocity, within_ms, seed):
    a_robot_stands(velocity, seed, within_ms)


@pytest.mark.slow
@pytest.mark.parametrize(("velocity", "within_ms"), [(2279, 900), (16633, 2600)])
def test_a_robot_stands_after_an_encoder_broke_with_every_seed(velocity, within_ms):
    for seed in range(5, 50):
        a_robot_stands(velocity, seed, within_ms)


def test_a_broken_encoder_shows_one_level_and_a_mended_one_follows_the_shaft_again():
    world = driven(2279)
    broken_at(world, 400 * MS, 0, (1, -1))
    board, encoder = world.robot().board, world.robot().drive.left_encoder
    place = board.left.real_position
    world.run_for(5 * MS)
    assert encoder.a() == 1
    assert abs(board.left.real_position - place) <= 10  # of the sample that is under way
    encoder.hold(-1, -1)
    place, count = board.left.real_position, encoder.count
    world.run_for(3 * MS)
    assert abs(board.left.real_position - place - (encoder.count - count)) <= 20  # within a sample


def test_the_fault_is_saved_and_restored_and_enters_no_digest():
    world = driven(2279)
    world.run_to(400 * MS)
    before = world.state.hashed()
    encoder_of(world, 0).hold(1, -1)
    assert world.state.hashed() == before
    saved = world.save()
    other = driven(2279)
    other.load(saved)
    assert encoder_of(other, 0).held_a == encoder_of(world, 0).held_a == 1
    for one in (world, other):
        one.run_to(1000 * MS)
    assert world.digest == other.digest


def test_a_flipped_bit_heals_or_is_gone_and_leaves_no_robot_deaf():
    world = driven(2279)
    world.run_to(400 * MS)
    saved = world.save()
    for name in ("_robots", "_frame_size", "_slot"):
        address = IMAGE.symbols.find(name).address
        for bit in range(8):
            world.load(saved)
            cpu = world.robot().board.cpu
            cpu.poke_iram(address & 0xFF, cpu.peek_iram(address & 0xFF) ^ 1 << bit)
            world.run_to(900 * MS)
            counted = world.robot().counter(0)
            world.run_to(1000 * MS)
            assert world.robot().counter(0) > counted, (name, bit)
