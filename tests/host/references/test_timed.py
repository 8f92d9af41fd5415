"""A path with a timetable: at its points in time, smooth between them, at rest in its pauses."""

import math
from itertools import accumulate, pairwise

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from miro_host.references.timed import LEAST_STEP_S, MOST_POINTS, STANDS_M_S, Timed, TimedRef

STEPS = st.lists(
    st.tuples(st.floats(0.05, 1.0), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)), min_size=2, max_size=8
)
CIRCLE = [(0.1 * k, 0.4 * math.cos(0.05 * k), 0.4 * math.sin(0.05 * k)) for k in range(60)]
PAUSE = [
    (0.0, 0.0, 0.0),
    (0.5, 0.1, 0.0),
    (1.0, 0.2, 0.05),
    (2.0, 0.2, 0.05),
    (2.5, 0.2, 0.15),
    (3.0, 0.1, 0.2),
]


def table(steps):
    return list(
        accumulate(steps, lambda a, b: tuple(x + y for x, y in zip(a, b, strict=True)), initial=(0.0,) * 3)
    )


@given(STEPS)
def test_it_is_at_each_point_at_its_time(steps):
    points = table(steps)
    path = Timed(points)
    for t_s, x_m, y_m in points:
        at = path.at(t_s).posture
        assert math.dist((at.x_m, at.y_m), (x_m, y_m)) < 1e-9


@settings(max_examples=60)
@given(STEPS, st.floats(0.02, 0.98))
def test_velocities_are_the_derivatives_of_the_posture_and_accelerations_theirs(steps, part):
    path, h = Timed(table(steps)), 1e-5
    t_s = part * path.times_s[-1]
    assume(all(abs(t_s - knot_s) > 2.0 * h for knot_s in path.times_s))
    before, at, after = (path.at(t_s + k * h) for k in (-1, 0, 1))
    assume(min(before.v_m_s, at.v_m_s, after.v_m_s) > 0.05)
    along = math.cos(at.posture.theta_rad), math.sin(at.posture.theta_rad)
    moved = after.posture.x_m - before.posture.x_m, after.posture.y_m - before.posture.y_m
    assert (moved[0] * along[0] + moved[1] * along[1]) / (2 * h) == pytest.approx(at.v_m_s, rel=1e-4)
    assert (moved[1] * along[0] - moved[0] * along[1]) / (2 * h) == pytest.approx(0.0, abs=1e-3)
    turned = math.remainder(after.posture.theta_rad - before.posture.theta_rad, math.tau) / (2 * h)
    assert turned == pytest.approx(at.w_rad_s, rel=1e-3, abs=1e-3)
    assert (after.v_m_s - before.v_m_s) / (2 * h) == pytest.approx(at.v_dot_m_s2, rel=1e-3, abs=1e-3)
    assert (after.w_rad_s - before.w_rad_s) / (2 * h) == pytest.approx(at.w_dot_rad_s2, rel=1e-2, abs=1e-2)


@given(STEPS)
def test_posture_speed_and_turning_rate_do_not_jump_at_a_point(steps):
    path = Timed(table(steps))
    for knot_s in path.times_s[1:-1]:
        before, after = path.at(knot_s - 1e-7), path.at(knot_s + 1e-7)
        assume(before.v_m_s > 0.05)
        assert after.v_m_s == pytest.approx(before.v_m_s, abs=1e-4)
        assert after.w_rad_s == pytest.approx(before.w_rad_s, abs=1e-2 * (1.0 + abs(before.w_dot_rad_s2)))


def test_points_of_a_circle_are_driven_as_a_circle():
    path = Timed(CIRCLE)
    for k in range(10, 50):
        at = path.at(0.1 * k + 0.03)
        assert math.hypot(at.posture.x_m, at.posture.y_m) == pytest.approx(0.4, abs=1e-6)
        assert (at.v_m_s, at.w_rad_s) == (pytest.approx(0.2, rel=1e-3), pytest.approx(0.5, rel=1e-3))


def test_in_a_pause_it_stands_and_comes_to_rest_before():
    path = Timed(PAUSE)
    for t_s in (1.0, 1.3, 1.999, 2.0):
        at = path.at(t_s)
        assert (at.posture.x_m, at.posture.y_m) == (pytest.approx(0.2), pytest.approx(0.05))
        assert (at.v_m_s, at.w_rad_s, at.v_dot_m_s2) == (0.0, 0.0, 0.0)
    assert path.at(0.999).v_m_s < 0.01
    assert path.at(2.001).v_m_s < 0.01
    assert path.at(0.6).v_m_s > 0.1


def test_before_its_first_time_and_after_its_last_it_stands_at_the_ends():
    path = Timed([(1.0, 0.1, 0.2), (2.0, 0.3, 0.2), (3.0, 0.5, 0.3)])
    for t_s, x_m in ((-1.0, 0.1), (0.5, 0.1), (3.5, 0.5), (60.0, 0.5)):
        at = path.at(t_s)
        assert at.posture.x_m == pytest.approx(x_m)
        assert (at.v_m_s, at.w_rad_s, at.v_dot_m_s2, at.w_dot_rad_s2) == (0.0, 0.0, 0.0, 0.0)
    assert path.at(0.0).posture.theta_rad == path.at(1.0).posture.theta_rad


@given(STEPS)
def test_it_has_a_heading_wherever_it_hardly_moves(steps):
    path = Timed(table([*steps, (0.3, 0.0, 0.0), *steps]))
    for a_s, b_s in pairwise(path.times_s):
        at = path.at(0.5 * (a_s + b_s))
        assert at.v_m_s == 0.0 or at.v_m_s >= STANDS_M_S
        assert math.isfinite(at.posture.theta_rad)


@given(STEPS)
def test_within_one_step_of_its_pace_it_goes_no_further_than_asked(steps):
    path = Timed(table(steps))
    pace = path.pace(0.005, 0.02)
    assert pace.until_s == path.times_s[-1]
    assume(pace.step_s > LEAST_STEP_S)
    t_s = 0.0
    for _ in range(200):
        a, b = path.at(t_s).posture, path.at(t_s + pace.step_s).posture
        assert math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) <= 0.005
        t_s += max(pace.step_s, pace.until_s / 200.0)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (((0.0, 0.0, 0.0),), "points: there are 1; give 2 to 5000"),
        (((0.0, 0.0, 0.0),) * (MOST_POINTS + 1), "points: there are 5001; give 2 to 5000"),
        (
            ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
            r"points\[1\]: 0 s is not 1 ms after the point before; sort by time",
        ),
        (((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), r"points\[0\]: the time -1 s is out of range; give 0 to 86400"),
        (
            ((0.0, 0.0, 0.0), (1.0, 1e4, 0.0)),
            r"points\[1\]: \(10000, 0\) cm is out of range; give -1000 to 1000",
        ),
        (((0.0, 0.0, math.nan), (1.0, 1.0, 0.0)), r"points\[0\]: \(0, nan\) cm is out of range"),
    ],
)
def test_what_is_no_timetable_is_refused_with_the_point(points, message):
    with pytest.raises(ValueError, match=message):
        TimedRef(points=points)
