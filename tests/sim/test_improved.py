"""The improved chain in the loop, a few runs of what `benchmarks.improved` and `benchmarks.chain` do with many."""

import math

import pytest

from benchmarks import chain, improved
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.pitch import ground
from miro_sim.scenario import file as scenario_file
from miro_sim.scenario.build import dead_s
from miro_sim.world.world import World
from mirotwin.campaign.single import run_single

CASES = {case.name: case for case in improved.cases()}
SHORT = ("duration_s=2.0", 'camera={kind="gaussian"}', 'network.robot.controller={law="body_frame"}')


def run_world(*sets, seed=1, scenario="fig6"):
    world = World(scenario_file.load(scenario, (*SHORT, *sets)).scenario, seed, load_hex(image_path()))
    while not world.finished:
        world.step()
    return world


def run_case(name, estimator):
    (job,) = improved.works(CASES[name], range(1, 2), "body_frame", estimator)
    return improved.result_of(run_single(job))


@pytest.mark.parametrize("estimator", ["ekf", "ekf+telemetry"])
def test_a_calibrated_camera_brings_the_robot_within_a_millimetre_and_a_half(estimator):
    result = run_case("calibrated, Fig. 6", estimator)
    assert result.settled
    assert 0.0 < result.position_cm < 0.15
    assert result.off_pitch_s == 0.0


def test_uneven_wheels_do_not_lead_the_robot_aside():
    result = run_case("wheels 1.05 and 0.95, calibrated, Fig. 8", "ekf")
    assert result.position_cm < 0.3


def test_starts_are_drawn_on_the_pitch_near_enough_and_over_all_headings():
    starts = [improved.start_of(seed, 0.6) for seed in range(200)]
    assert all(ground.holds(start) and math.hypot(start.x_m, start.y_m) <= 0.6 for start in starts)
    assert {int(4.0 * (start.theta_rad + math.pi) / math.tau) for start in starts} == {0, 1, 2, 3}
    assert improved.start_of(7, 0.6) == starts[7]


def test_a_start_that_was_drawn_is_where_the_robot_starts():
    case = CASES["starts within 60 cm, arc"]
    start = improved.start_of(3, case.near_m)
    assert improved.scenario_heading_rad(case) == math.radians(60.0)
    world = run_world(*improved.start_settings(case, 3), "duration_s=0.01", scenario="fig8")
    theta_rad = world.networks[0].robots[0].drive.pose_at(0)[2]
    assert abs(math.remainder(theta_rad - start.theta_rad, math.tau)) < 1e-9


def test_a_line_says_what_is_beyond_its_limits():
    case = improved.Case("name", "fig6", (), improved.Limits(0.25, 0.5, settles=True))
    fine = improved.Result(0.2, True, 0.0)
    assert improved.row(case, [fine] * 20) == ("| name | 0.200 | 0.200 | 0.200 | 20 of 20 | 0.0 |  |", True)
    assert not improved.row(case, [fine, improved.Result(0.2, False, 1.0)])[1]
    assert not improved.row(case, [fine] * 18 + [fine._replace(position_cm=0.6)] * 2)[1]
    assert improved.row(case, [fine] * 19 + [fine._replace(position_cm=0.6)])[1] is False
    assert not improved.row(case, [fine._replace(position_cm=0.3)] * 20)[1]


def test_the_case_of_lost_frames_loses_a_fifth_of_them():
    world = run_world(improved.LOSSY, "duration_s=6.0")
    share = world.networks[0].robots[0].counter(0) / world.networks[0].frames_sent
    assert 0.7 < share < 0.9


@pytest.mark.parametrize(("robots", "expected_s"), [(3, 0.02796), (5, 0.03629)])
def test_the_pilot_is_told_the_delay_of_its_network(robots, expected_s):
    scenario = scenario_file.load("fig6", (f"network.robots={robots}",)).scenario
    assert dead_s(scenario, scenario.networks[0]) == pytest.approx(expected_s, abs=1e-5)
    world = World(scenario, 0, load_hex(image_path()))
    assert world.networks[0].robots[0].pilot.dead_s == dead_s(scenario, scenario.networks[0])


def test_the_cost_is_that_of_both_loops_over_all_periods():
    image = load_hex(image_path())
    plain, ours = (
        chain.world("fig6", "yang_kim", "none", image),
        chain.world("fig6", "body_frame", "ekf", image),
    )
    spent = chain.pair(plain, ours)
    assert plain.finished
    assert ours.finished
    assert spent[2] == 180
    assert min(spent[:2]) > 0.0
