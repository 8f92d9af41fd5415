"""Robots that touch are reported on the contact grid, and nothing else comes of it."""

import itertools
import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_sim.pitch.contact import GRID_TICKS, next_look, touch
from miro_sim.pitch.ground import ROBOT_HALF_M as HALF_M
from miro_sim.plant.params import DriveParams
from miro_sim.world import conditions as wait
from miro_sim.world.waits import WaitExpired
from tests.sim.world.rig import world_of

HEAD_ON = """
name = "head-on"
duration_s = 1.0

[camera]
kind = "gaussian"
position_error_cm = 0
heading_error_deg = 0

[[network]]

[[network.robot]]
slot = 0
reference.kind = "line"
reference.speed_m_s = 0.3

[[network.robot]]
slot = 1
start_error_x_cm = {gap_cm}
reference.kind = "line"
reference.speed_m_s = 0.0
"""
PLACES = st.floats(-0.2, 0.2)
HEADINGS = st.floats(-3.2, 3.2)


def corners(pose):
    x_m, y_m, theta_rad = pose
    cos, sin = math.cos(theta_rad), math.sin(theta_rad)
    for ahead, aside in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
        x, y = ahead * HALF_M, aside * HALF_M
        yield x_m + x * cos - y * sin, y_m + x * sin + y * cos


def clipped(polygon, inside_of):
    """The part of a convex polygon inside another one, edge by edge (Sutherland and Hodgman)."""
    edges = list(inside_of)
    for (ax, ay), (bx, by) in zip(edges, edges[1:] + edges[:1], strict=True):
        side = [(bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in polygon]
        result = []
        for index, (x, y) in enumerate(polygon):
            before = index - 1
            if (side[index] <= 0) != (side[before] <= 0):
                px, py = polygon[before]
                part = side[before] / (side[before] - side[index])
                result.append((px + part * (x - px), py + part * (y - py)))
            if side[index] <= 0:
                result.append((x, y))
        polygon = result
        if not polygon:
            return 0.0
    pairs = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return abs(sum(x * v - u * y for (x, y), (u, v) in pairs)) / 2


@given(PLACES, PLACES, HEADINGS, PLACES, PLACES, HEADINGS)
def test_squares_touch_where_their_common_area_is_not_empty(x, y, theta, u, v, phi):
    one, other = (x, y, theta), (u, v, phi)
    if clipped(list(corners(one)), list(corners(other))) > 1e-9:
        assert touch(one, other)
    assert touch(one, other) == touch(other, one)


def test_squares_side_by_side_touch_up_to_their_edges():
    assert touch((0, 0, 0), (2 * HALF_M, 0.01, 0))
    assert not touch((0, 0, 0), (2 * HALF_M + 1e-9, 0.01, 0))
    assert touch((0, 0, 0), (HALF_M * (1 + math.sqrt(2)) - 1e-9, 0, math.pi / 4))
    assert not touch((0, 0, 0), (HALF_M * (1 + math.sqrt(2)) + 1e-9, 0, math.pi / 4))


def test_no_look_is_needed_before_they_can_meet():
    speed = 2 * DriveParams().top_speed_m_s()
    far = next_look(0, (0, 0, 0), (1, 0, 0), speed)
    assert far % GRID_TICKS == 0
    assert 0.13 < far / 24e6 < 0.30
    assert next_look(5, (0, 0, 0), (0.1, 0, 0), speed) == GRID_TICKS


def head_on(gap_cm):
    return world_of(HEAD_ON.format(gap_cm=gap_cm), seed=3)


def test_two_robots_that_meet_are_reported_at_the_first_tick_of_the_grid_at_which_they_touch():
    world = head_on(10.0)
    event = world.run_until(wait.Touch())
    assert (event.value, event.other, event.tick % GRID_TICKS) == (0, (0, 1), 0)
    for tick, touching in ((event.tick - GRID_TICKS, False), (event.tick, True)):
        other = head_on(10.0)
        other.run_to(tick)
        one, two = (robot.drive.pose_at(tick) for robot in other.networks[0].robots)
        assert touch(one, two) is touching


CROWD = """
name = "crowd"
duration_s = 2.0
camera.kind = "gaussian"

[[network]]
robots = 5
"""


def crowd(draw):
    """Five robots that start near each other, each with a heading of its own."""
    robot = """
[[network.robot]]
slot = {0}
start_error_x_cm = {1}
start_error_y_cm = {2}
start_error_theta_rad = {3}
reference.kind = "line"
reference.speed_m_s = {4}
"""
    text = CROWD + "".join(
        robot.format(slot, 11 * slot, draw.uniform(-3, 3), 3.1 * (slot % 2), draw.choice((0.0, 0.3, 0.6)))
        for slot in range(5)
    )
    return world_of(text, seed=3)


def touches(world):
    return [(e.tick, (e.network, e.value), e.other) for _, e in world.networks[0].log.since(0, ("touch",))]


def touches_by_looking_always(world, end_tick):
    """The slow twin: stops at every tick of the grid and compares all pairs."""
    robots, found, before = world.networks[0].robots, [], []
    while world.tick < end_tick:
        world.run_to(world.tick + GRID_TICKS)
        at = [robot.drive.pose_at(world.tick) for robot in robots]
        now = [(a, b) for a, b in itertools.combinations(range(len(robots)), 2) if touch(at[a], at[b])]
        found += [(world.tick, (0, a), (0, b)) for a, b in now if (a, b) not in before]
        before = now
    return found


@pytest.mark.parametrize("seed", range(4))
def test_a_crowd_s_reports_are_those_of_who_looks_at_every_tick_of_the_grid(seed):
    end_tick = 1500 * GRID_TICKS
    world = crowd(random.Random(seed))
    world.run_to(end_tick)
    found = touches(world)
    assert len(found) >= 2
    assert found == touches_by_looking_always(crowd(random.Random(seed)), end_tick)


@pytest.mark.parametrize("cut_ticks", [7_777, 100_003, 24_000])
def test_a_report_does_not_depend_on_how_the_run_is_cut_and_changes_no_bit(cut_ticks):
    whole, cut = head_on(10.0), head_on(10.0)
    end_tick = 20 * 800_800
    whole.run_to(end_tick)
    while cut.tick < end_tick:
        cut.run_to(min(end_tick, cut.tick + cut_ticks))
    assert cut.digest == whole.digest
    assert touches(whole) == touches(cut) != []


def test_after_a_load_a_contact_is_reported_when_it_begins_and_not_again():
    world = head_on(10.0)
    apart = world.save()
    tick = world.run_until(wait.Touch()).tick
    world.run_to(tick + 1)
    met = world.save()
    other = head_on(10.0)
    other.load(met)
    with pytest.raises(WaitExpired):
        other.run_until(wait.Touch(), within=GRID_TICKS)
    world.load(apart)
    assert world.run_until(wait.Touch()).tick == tick


PUSHED = """
name = "pushed"
duration_s = 1.0
camera.kind = "gaussian"

[[network]]

[[network.robot]]
slot = 0
reference = {kind = "line", start_x_cm = 15, start_y_cm = 35, speed_m_s = 0.05}
drive = {battery.voltage_v = 1, tyre.grip = 0.05, disturbance.force_n = 5}

[[network.robot]]
slot = 1
reference = {kind = "line", start_x_cm = 85, start_y_cm = 35, speed_m_s = 0.01}
drive.battery.voltage_v = 1
"""


@pytest.mark.parametrize("cut_ticks", [800_800, 300_007])
def test_a_robot_that_a_force_pushes_faster_than_it_drives_is_reported_where_it_touches(cut_ticks):
    world, slow = (world_of(PUSHED, seed=3) for _ in range(2))
    end_tick = 15 * 800_800
    while world.tick < end_tick:
        world.run_to(min(end_tick, world.tick + cut_ticks))
    assert touches(world) == touches_by_looking_always(slow, end_tick) != []
