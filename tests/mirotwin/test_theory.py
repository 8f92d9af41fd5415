"""The paper's theory along a run: its terms beside their slow twin, in the summary and in the recording; chattering."""

import io
import json
import math
from itertools import pairwise

import msgspec
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mcap.reader import make_reader

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_host.posture import Posture
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.periods import Control
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.recording.reader import parse
from mirotwin.recording.recorder import Recorder, RunSource
from mirotwin.recording.theory.chattering import Chattering
from mirotwin.recording.theory.figures import SlidingGains, authority, gains_of, theory_of, theory_text
from mirotwin.recording.theory.track import TheoryTrack
from mirotwin.recording.track import Tracks
from mirotwin.runs import runner
from tests.mirotwin.mutated_files import without_sums
from tests.mirotwin.synthetic import periods, robot
from tests.naive import theory_terms as naive

PERIOD_S = naive.PERIOD_S
PLACES = st.builds(Posture, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-12.0, 12.0))
SPEEDS = st.tuples(st.floats(-0.5, 0.5), st.floats(-4.0, 4.0))
COMMANDS = st.none() | st.builds(
    lambda v, w, left, right: Control(v, w, left, right, {}),
    *(st.floats(-0.5, 0.5), st.floats(-4.0, 4.0), st.integers(-9000, 9000), st.integers(-9000, 9000)),
)


ORIGIN, HERE = Posture(0.0, 0.0, 0.0), Posture(0.5, 0.0, 0.0)
NO_GAINS = SlidingGains()


def period(truth, z=(0.0, 0.0), control=None, reference=HERE):
    changed = {"truth": truth, "v_m_s": z[0], "w_rad_s": z[1], "control": control, "reference": reference}
    return msgspec.structs.replace(robot(0), **changed)


STEPS = st.lists(st.builds(period, PLACES, SPEEDS, COMMANDS), min_size=2, max_size=30)


def track_of(run):
    track = TheoryTrack()
    for index, one in enumerate(run):
        track.add(one, index * CONTROL_PERIOD_TICKS)
    return track


def theory(run, gains=NO_GAINS):
    found = theory_of(track_of(run), gains)
    assert found is not None
    return found


def commanded(v, w=0.0, **inner):
    return Control(v, w, round(11392.75 * v), round(11392.75 * v), inner)


# f of equation (15).


@given(STEPS)
def test_f_is_what_was_commanded_less_what_came_of_it(run):
    track, expected = track_of(run), naive.disturbances(run)
    assert list(track.f1_m_s2) == pytest.approx(list(expected[:, 0]), abs=1e-9)
    assert list(track.f2_rad_s2) == pytest.approx(list(expected[:, 1]), abs=1e-9)


def test_a_robot_that_does_at_once_what_it_is_told_has_no_disturbance():
    speeds = [0.0, 0.1, 0.3, 0.2]
    run = [
        period(HERE, (v, 0.0), commanded(after)) for v, after in zip(speeds, [*speeds[1:], 0.0], strict=True)
    ]
    found = theory(run, SlidingGains(0.05, 1.0)).disturbance
    assert found.f1_largest_m_s2 == pytest.approx(0.0, abs=1e-9)
    assert (found.f1_above_p1, found.f2_above_p2) == (0.0, 0.0)


def test_a_robot_that_is_a_period_late_has_the_change_of_its_command_as_disturbance():
    """Up by 0.1 m/s in one period, which is 3 m/s2, too little; and too much in the next."""
    told, did = [0.1, 0.1, 0.1, 0.1], [0.0, 0.0, 0.1, 0.1]
    run = [period(HERE, (v, 0.0), commanded(given)) for given, v in zip(told, did, strict=True)]
    track = track_of(run)
    assert list(track.f1_m_s2) == pytest.approx([0.1 / PERIOD_S, -0.1 / PERIOD_S, 0.0], abs=1e-9)
    found = theory_of(track, SlidingGains(0.05, None))
    assert found.disturbance.f1_above_p1 == pytest.approx(2 / 3)
    assert found.disturbance.f2_above_p2 is None


SURFACES = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))


@given(
    st.lists(st.tuples(st.floats(-0.5, 0.5), SURFACES), min_size=2, max_size=20),
    st.floats(0.0, 20.0),
    st.floats(0.01, 2.0),
)
def test_inside_a_layer_f_is_measured_against_the_part_of_p_that_is_left(told, p1, layer):
    run = [period(HERE, (0.0, 0.0), commanded(v, s1=s1, s2=s2)) for v, (s1, s2) in told]
    found = theory(run, SlidingGains(p1, None, layer, None)).disturbance
    f1 = naive.disturbances(run)[:, 0]
    left = [p1 * min(abs(s1) / layer, 1.0) for _, (s1, _) in told[:-1]]
    sure = [abs(f) > bound for f, bound in zip(f1, left, strict=True) if abs(abs(f) - bound) > 1e-6]
    unsure = len(left) - len(sure)
    assert sum(sure) <= round(found.f1_above_authority * len(left)) <= sum(sure) + unsure
    assert found.f1_above_p1 is not None
    assert found.f1_above_authority >= found.f1_above_p1
    assert found.f2_above_authority is None


def test_without_a_layer_all_of_p_is_left_wherever_the_surface_is_not_zero():
    run = [period(HERE, (0.0, 0.0), commanded(0.001, s1=s1, s2=0.0)) for s1 in (0.01, -0.01, 0.0, 0.0)]
    found = theory(run, SlidingGains(0.05, None)).disturbance
    assert (found.f1_above_p1, found.f1_above_authority) == (0.0, 0.0)
    assert authority(0.01, 0.05, None) == 0.05
    assert authority(0.0, 0.05, None) == 0.0


def test_of_a_law_that_does_not_say_its_surfaces_no_authority_is_known():
    run = [period(HERE, (0.0, 0.0), commanded(0.1)) for _ in range(3)]
    found = theory(run, SlidingGains(0.05, 1.0, 0.1, 0.1)).disturbance
    assert (found.f1_above_authority, found.f2_above_authority) == (None, None)


def test_a_period_without_a_command_has_no_f():
    run = [period(HERE, (0.0, 0.0), commanded(0.1)), period(HERE, (0.3, 0.0)), period(HERE, (0.3, 0.0))]
    track = track_of(run)
    assert len(track.f1_m_s2) == 1
    assert (track.now.f1_m_s2, track.now.f2_rad_s2) == (None, None)


# The assumptions.


def on_the_seam(angles):
    """Whether a rounding decides on which side of pi an angle, or a change of it, is."""
    changes = [after - before for before, after in pairwise(angles)]
    return any(abs(abs(value) - math.pi) < 1e-9 for value in (*angles, *changes))


def off_the_borders(posture):
    """Whether no rounding decides about assumptions 2 and 3."""
    distance = abs(naive.across(posture))
    return distance > 1e-7 and abs(distance - 0.1) > 1e-7 and math.hypot(posture.x_m, posture.y_m) > 1e-6


PLAIN_STEPS = st.lists(
    st.builds(period, PLACES.filter(off_the_borders), SPEEDS, COMMANDS), min_size=2, max_size=30
)


def ends_of(frames):
    """When the first and the last of those frames is."""
    found = [index * PERIOD_S for index, one in enumerate(frames) if one]
    return pytest.approx((found[0], found[-1])) if found else (None, None)


@pytest.mark.slow
@given(PLAIN_STEPS)
def test_the_assumptions_are_those_of_the_slow_twin(run):
    run = [msgspec.structs.replace(run[0], control=commanded(0.0), reference=ORIGIN), *run[1:]]
    distances = [naive.across(one.truth) for one in run]
    rho = [math.hypot(one.truth.x_m, one.truth.y_m) for one in run]
    headings = [math.remainder(one.truth.theta_rad, math.tau) for one in run]
    bearings = [math.atan2(one.truth.y_m, one.truth.x_m) for one in run]
    assume(not on_the_seam(headings))
    assume(not on_the_seam(bearings))
    found = theory(run)
    near = [abs(distance) < 0.1 for distance in distances]
    assert found.assumption_3.frames == sum(near)
    assert (found.assumption_3.first_s, found.assumption_3.last_s) == ends_of(near)
    assert found.assumption_3.nearest_rad == pytest.approx(min(map(abs, distances)), abs=1e-7)
    assert found.assumption_3.crossings == sum(a * b < 0 for a, b in pairwise(distances))
    assert found.assumption_2.broken_s == pytest.approx(PERIOD_S * sum(one <= 0.024 for one in rho[1:]))
    sides = [naive.outside(headings), naive.outside(bearings)]
    assert found.assumption_1.seams == sides[0][1] + sides[1][1]
    outside = sides[0][0] | sides[1][0]
    assert found.assumption_1.broken_s == pytest.approx(PERIOD_S * sum(outside))
    assert (found.assumption_1.first_s, found.assumption_1.last_s) == ends_of(outside)


def turned(*angles):
    return theory([period(Posture(0.5, 0.0, angle), control=commanded(0.0)) for angle in angles])


def test_a_heading_that_turns_past_half_a_turn_breaks_assumption_1_until_it_comes_back():
    found = turned(3.0, 3.1, 3.2, 3.3, 3.1).assumption_1
    assert (found.seams, found.broken_s) == (2, pytest.approx(2 * PERIOD_S))
    assert (found.first_s, found.last_s) == pytest.approx((2 * PERIOD_S, 3 * PERIOD_S))


def test_a_robot_in_the_origin_and_a_reference_that_starts_elsewhere_break_assumption_2():
    as_it_should = [period(HERE, control=commanded(0.0), reference=at) for at in (ORIGIN, HERE)]
    assert theory(as_it_should).assumption_2.broken_s == 0.0
    late = [period(HERE, control=commanded(0.0), reference=at) for at in (HERE, HERE)]
    assert theory(late).assumption_2.first_s == 0.0
    standing = [period(HERE, control=commanded(0.0), reference=at) for at in (ORIGIN, ORIGIN)]
    assert theory(standing).assumption_2.first_s == pytest.approx(PERIOD_S)
    near = [period(at, control=commanded(0.0), reference=HERE) for at in (HERE, Posture(0.02, 0.01, 0.0))]
    found = theory(near).assumption_2
    assert found.nearest_cm == pytest.approx(100.0 * math.hypot(0.02, 0.01))
    assert found.last_s == pytest.approx(PERIOD_S)


def test_a_heading_across_the_line_of_sight_breaks_assumption_3_and_passing_it_is_a_crossing():
    found = turned(1.3, 1.5, 1.6, 2.0).assumption_3
    assert (found.frames, found.crossings) == (2, 1)
    assert (found.first_s, found.last_s) == pytest.approx((PERIOD_S, 2 * PERIOD_S))
    assert found.nearest_rad == pytest.approx(1.6 - math.pi / 2)


# Forward and backward.


def test_a_change_of_direction_counts_and_trembling_at_rest_does_not():
    speeds = [0.0, 0.001, -0.002, 0.2, 0.005, -0.005, 0.1, -0.1, -0.2, 0.3]
    found = theory([period(HERE, (v, 0.0), commanded(0.0)) for v in speeds])
    assert found.reversals == 2
    assert found.backward_s == pytest.approx(2 * PERIOD_S)


# What is said of them.


def test_a_robot_that_nobody_steers_has_no_theory():
    track = track_of([period(HERE), period(HERE)])
    assert theory_of(track, SlidingGains()) is None
    assert track.now is None


def test_the_line_on_the_screen_names_what_does_not_hold():
    told, did = [0.1, 0.1, 0.1, 0.1], [0.0, -0.2, 0.1, 0.1]
    run = [
        period(Posture(0.5, 0.0, angle), (v, 0.0), commanded(given), reference=at)
        for given, v, angle, at in zip(told, did, (1.3, 1.5, 1.6, 2.0), (ORIGIN, *[HERE] * 3), strict=True)
    ]
    assert theory_text(theory(run, SlidingGains(0.05, 1.0))) == (
        "assumption 3 within 0.1 rad in 2 frames, crossed 1 x; |f1| > P1 in 67 %; |f2| > P2 in 0 %;"
        " backward for 0.03 s"
    )
    layered = [msgspec.structs.replace(one, control=commanded(0.1, s1=0.001, s2=0.0)) for one in run]
    assert "|f1| > P1 in 0 % (> P1 |sat(s1)| in 67 %)" in theory_text(
        theory(layered, SlidingGains(10.0, 1.0, 0.1, 0.1))
    )
    still = [period(HERE, (0.0, 0.0), commanded(0.0), reference=at) for at in (ORIGIN, HERE, HERE)]
    assert theory_text(theory(still)) == ""


def test_the_gains_are_those_of_each_robots_law():
    scenario = load("fig6").scenario
    assert gains_of(scenario) == {(0, 0): SlidingGains(0.77, 1.48, 0.4, 0.149)}
    signs = load("fig6", ['network.robot.controller.switching="sign"']).scenario
    assert gains_of(signs) == {(0, 0): SlidingGains(0.77, 1.48)}
    other = load("fig6", ['network.robot.controller={law="body_frame"}']).scenario
    assert gains_of(other) == {(0, 0): SlidingGains(None, None)}


# In the recording.

SOURCE = RunSource("fig6", "name = 'fig6'\n", 1, b":00000001FF\r\n", "ab" * 32)


def recorded(count, with_theory):
    stream, tracks = io.BytesIO(), Tracks()
    with Recorder(stream, SOURCE) as recorder:
        for one in periods(count, [(0, 0), (1, 2)]):
            recorder.write(one)
            tracks.add(one)
            if with_theory:
                recorder.write_theories(tracks.theories())
    return stream.getvalue()


@pytest.mark.parametrize("count", [2, 10, 23])
def test_a_recording_has_the_terms_and_reads_the_same_with_and_without_them(count):
    """So recordings of before they were written are read as they were."""
    data = recorded(count, True)
    assert data != recorded(count, False)
    assert parse(data, "run.mcap") == parse(recorded(count, False), "run.mcap")
    found = [
        (channel.topic, json.loads(message.data))
        for _, channel, message in make_reader(io.BytesIO(data)).iter_messages()
        if channel.topic.endswith("/theory")
    ]
    assert len(found) == 2 * (count - 1)  # nothing is commanded in the first period
    ticks = [content["tick"] for topic, content in found if topic == "/net0/robot0/theory"]
    assert ticks == [index * CONTROL_PERIOD_TICKS for index in range(1, count)]


def test_terms_that_make_no_sense_do_not_spoil_a_recording():
    data = recorded(2, True)
    changed = data.replace(b'"holds_1":true', b'"holds_1":7777')
    assert changed != data
    assert parse(without_sums(changed), "run.mcap") == parse(data, "run.mcap")


def test_the_terms_of_a_whole_run_follow_from_its_recording():
    """Fig. 6 in the whole loop: written along the run, and computed again from what was read back."""
    text = load("fig6", ["duration_s=1.5"])
    world, stream, tracks = World(text.scenario, 3, load_hex(image_path())), io.BytesIO(), Tracks()
    with Recorder(stream, SOURCE) as recorder:
        runner.run(world, recorder, on_period=tracks.add)
    again = Tracks(parse(stream.getvalue(), "run.mcap").periods)
    gains = gains_of(text.scenario)[0, 0]
    one, other = (theory_of(each.robots[0, 0].theory, gains) for each in (tracks, again))
    assert one == other
    assert 0.1 < one.disturbance.f1_largest_m_s2 < 8.0
    assert one.assumption_3.frames == 0


# The chattering index: what it counts, and what it does not

WHEEL = st.integers(-16633, 16633)


def after(commands):
    chattering = Chattering()
    for left, right in commands:
        chattering.add(left, right)
    return chattering


def index(commands):
    return after(commands).index(PERIOD_S)


@given(st.lists(st.tuples(WHEEL, WHEEL), min_size=2, max_size=60))
def test_the_effort_is_the_mean_size_of_the_commanded_acceleration_of_a_wheel(commands):
    found = after(commands)
    assert found.effort(PERIOD_S) == pytest.approx(naive.effort(commands), rel=1e-9, abs=1e-12)
    assert found.effort(PERIOD_S) >= found.index(PERIOD_S)


@given(st.lists(st.tuples(WHEEL, WHEEL), min_size=2, max_size=60))
def test_it_is_the_variation_less_the_net_motion_of_each_window(commands):
    assert index(commands) == pytest.approx(naive.chattering(commands), rel=1e-9, abs=1e-12)


@given(st.lists(st.tuples(WHEEL, WHEEL), min_size=2, max_size=60))
def test_speeds_that_only_rise_do_not_chatter(commands):
    left, right = (sorted(wheel) for wheel in zip(*commands, strict=True))
    assert index(zip(left, right, strict=True)) == 0.0


def test_a_swing_of_one_wheel_at_every_frame_counts_both_ways():
    """1139 units are 0.1 m/s. One wheel that changes by so much in every frame makes 3 m/s2, half of it a wheel."""
    commands = [(1139 * (k % 2), 0) for k in range(301)]
    assert index(commands) == pytest.approx(0.5 * 0.1 / PERIOD_S, rel=1e-3)


def test_a_slow_movement_there_and_back_counts_hardly():
    """1 m/s up in a second and down in a second: at most one window holds the turn."""
    slow = [(380 * min(k, 60 - k), 0) for k in range(61)]
    assert index(slow) == 0.0
    assert index(slow[5:]) < 0.2 * naive.chattering([(22800 * (k % 2), 0) for k in range(3)])


def test_one_command_says_nothing():
    assert index([]) is None
    assert index([(1, 1)]) is None
    assert after([(1, 1)]).effort(PERIOD_S) is None
    assert index([(1, 1), (1, 1)]) == 0.0
