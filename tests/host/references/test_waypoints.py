"""The planner: it passes its points within its bounds, and goes nowhere that a slow twin does not go."""

import math
from itertools import pairwise

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from msgspec.structs import astuple

from miro_host.pilot import PERIOD_S
from miro_host.references.speeds import Bounds
from miro_host.references.spline import spline
from miro_host.references.waypoints import CELLS, Waypoint, Waypoints, WaypointsRef, headings
from tests.host.references.test_paths import numbers
from tests.naive import host_paths as naive

POINTS = st.lists(st.tuples(st.floats(0.0, 1.1), st.floats(0.0, 0.7)), min_size=2, max_size=6)
HEADINGS = st.lists(st.none() | st.floats(-3.1, 3.1), min_size=6, max_size=6)
BOUNDS = st.builds(
    Bounds, st.floats(0.05, 1.0), st.floats(0.1, 3.0), st.floats(0.1, 3.0), st.floats(0.5, 6.0)
)
STEPS = ((0.0, 0.0), (0.40, 0.15), (0.70, 0.40), (1.05, 0.50))
USUAL = Bounds(0.2, 0.4, 0.4, 3.0)
BEND = ((0.0, 0.0), (0.30, 0.0), (0.30, 0.30))
ROUND = ((0.3, 0.1), (0.7, 0.2), (0.8, 0.5), (0.4, 0.5))


def far_apart(points):
    return all(math.dist(a, b) >= 0.075 for i, a in enumerate(points) for b in points[:i])


def planned(points, given_headings, bounds, closed):
    assume(far_apart(points))
    try:
        return Waypoints(points, given_headings[: len(points)], bounds, closed)
    except ValueError:  # it turns back on itself, or bends to less than 1 cm
        assume(False)


def whole_s(path):
    return path.pace(0.005, 0.02).until_s


def turned(a, b):
    return abs(math.remainder(a - b, 2.0 * math.pi))


@pytest.mark.slow
@settings(max_examples=60)
@given(POINTS, HEADINGS, BOUNDS, st.booleans())
def test_at_every_camera_frame_speed_accelerations_and_turning_rate_are_within_their_bounds(
    points, given_headings, bounds, closed
):
    path = planned(points, given_headings, bounds, closed)
    for k in range(min(int(whole_s(path) / PERIOD_S) + 2, 3000)):
        r = path.at(k * PERIOD_S)
        assert 0.0 <= r.v_m_s <= bounds.speed_m_s * (1.0 + 1e-12)
        assert abs(r.v_dot_m_s2) <= bounds.accel_m_s2 * (1.0 + 1e-9)
        assert abs(r.v_m_s * r.w_rad_s) <= bounds.lateral_accel_m_s2 * (1.0 + 1e-9)
        assert abs(r.w_rad_s) <= bounds.turn_rad_s * (1.0 + 1e-9)
        assert all(math.isfinite(value) for value in numbers(r))


@settings(max_examples=60)
@given(POINTS, HEADINGS, st.booleans())
def test_the_path_passes_each_point_with_its_heading(points, given_headings, closed):
    path = planned(points, given_headings, USUAL, closed)
    for k, (point, heading) in enumerate(zip(points, given_headings, strict=False)):
        at = path.at(path.start.times_s[k * CELLS]).posture
        assert (at.x_m, at.y_m) == pytest.approx(point, abs=1e-9)
        if heading is not None:
            assert turned(at.theta_rad, heading) < 1e-7


@settings(max_examples=60)
@given(POINTS, HEADINGS, st.floats(0.02, 0.98), st.booleans())
def test_velocities_are_the_derivatives_of_the_posture_and_accelerations_theirs(
    points, given_headings, part, closed
):
    path = planned(points, given_headings, USUAL, closed)
    t, h = part * whole_s(path), 1e-6
    before, here, after = path.at(t - h), path.at(t), path.at(t + h)
    assume(before.v_dot_m_s2 == pytest.approx(here.v_dot_m_s2, abs=1e-9) == after.v_dot_m_s2)  # one cell
    assume(path.start.duration_s not in (t - h, t + h) and here.v_m_s > 0.01)
    bend = abs(here.w_rad_s) / here.v_m_s
    assume(bend < 20.0)
    a, b = before.posture, after.posture
    theta_rad = here.posture.theta_rad
    way = (b.x_m - a.x_m) * math.cos(theta_rad) + (b.y_m - a.y_m) * math.sin(theta_rad)
    # Lengths are by three points of Gauss and Legendre: their error grows with the sixth power of what a cell bends.
    sharp = max(1.0, (path.most_curvature_per_m / 40.0) ** 6)
    assert way / (2 * h) == pytest.approx(here.v_m_s, abs=1e-7 * sharp)
    turn = math.remainder(b.theta_rad - a.theta_rad, 2.0 * math.pi)
    assert turn / (2 * h) == pytest.approx(here.w_rad_s, abs=1e-6 * sharp)
    assert (after.v_m_s - before.v_m_s) / (2 * h) == pytest.approx(here.v_dot_m_s2, abs=1e-7)
    steady = 1e-3 + 1e-3 * abs(here.w_dot_rad_s2)
    if abs(after.w_dot_rad_s2 - before.w_dot_rad_s2) <= steady:  # it jumps from piece to piece
        turned_faster = (after.w_rad_s - before.w_rad_s) / (2 * h)
        assert turned_faster == pytest.approx(here.w_dot_rad_s2, rel=1e-4, abs=1e-5 * sharp)


@settings(max_examples=40)
@given(POINTS, HEADINGS)
def test_posture_speed_and_turning_rate_do_not_jump_anywhere(points, given_headings):
    path = planned(points, given_headings, USUAL, False)
    for t in path.lap.times_s[:: CELLS // 4]:
        a, b = path.at(t - 1e-9), path.at(t + 1e-9)
        assert math.hypot(a.posture.x_m - b.posture.x_m, a.posture.y_m - b.posture.y_m) < 1e-8
        assert turned(a.posture.theta_rad, b.posture.theta_rad) < 1e-6
        assert abs(a.v_m_s - b.v_m_s) < 1e-8
        assert abs(a.w_rad_s - b.w_rad_s) < 1e-5


@settings(max_examples=8)
@given(
    st.lists(st.tuples(st.floats(0.0, 1.1), st.floats(0.0, 0.7)), min_size=2, max_size=4),
    st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4),
    st.floats(0.1, 0.9),
)
def test_the_slow_twin_goes_the_same_way_in_the_same_time(points, aside, part):
    assume(all(math.dist(a, b) >= 0.2 for i, a in enumerate(points) for b in points[:i]))
    chords = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(points)]
    given_headings = [chord + turn for chord, turn in zip([chords[0], *chords], aside, strict=False)]
    path = planned(points, given_headings, USUAL, False)
    assume(path.most_curvature_per_m < 20.0)
    twin = naive.pieces(points, given_headings)
    for piece, (length, cx, cy) in zip(path.pieces, twin, strict=True):
        shape, u = piece.shape(part), part * length
        found = (shape.x_m, shape.y_m), (shape.dx, shape.dy), (shape.d2x, shape.d2y), (shape.d3x, shape.d3y)
        for order, place in enumerate(found):
            expected = [float(naive.value(c, u, order) * length**order) for c in (cx, cy)]
            assert place == pytest.approx(expected, abs=1e-9)
    times, ways = naive.quickest(twin, *astuple(USUAL))
    assert sum(path.ways_m) == pytest.approx(ways[-1], rel=1e-3)
    assert 0.995 * times[-1] < path.lap.duration_s < 1.05 * times[-1]


def test_headings_that_are_not_given_are_those_of_circles():
    a, b, c = (0.1, 0.2), (0.5, 0.15), (0.6, 0.6)
    found = headings((a, b, c), (None, None, None), False)
    assert found[1] == pytest.approx(float(naive.circle_heading(a, b, c)), abs=1e-12)
    on_circle = [(0.3 * math.cos(angle), 0.3 * math.sin(angle)) for angle in (0.0, 0.4, 1.5, 1.9, 3.0)]
    tangents = [math.pi / 2 + angle for angle in (0.0, 0.4, 1.5, 1.9, 3.0)]
    for heading, tangent in zip(headings(on_circle, [None] * 5, False), tangents, strict=True):
        assert turned(heading, tangent) < 1e-12
    assert headings(((0.0, 0.0), (0.3, 0.3)), (None, None), False) == pytest.approx([math.pi / 4] * 2)


def test_points_on_a_circle_give_nearly_the_circle():
    places = [(0.3 * math.cos(k * math.pi / 4), 0.3 * math.sin(k * math.pi / 4)) for k in range(8)]
    for piece in spline(places, headings(places, [None] * 8, True), True):
        for k in range(11):
            shape = piece.shape(k / 10.0)
            assert math.hypot(shape.x_m, shape.y_m) == pytest.approx(0.3, abs=2e-6)
            assert shape.curvature()[0] == pytest.approx(1.0 / 0.3, rel=2e-4)


def test_an_open_path_stands_before_its_start_and_after_its_end():
    path = Waypoints(STEPS, [None] * 4, USUAL)
    for t in (-1.0, -1e-9, path.lap.duration_s + 1e-9, 1e6):
        r = path.at(t)
        assert (r.v_m_s, r.w_rad_s, r.v_dot_m_s2, r.w_dot_rad_s2) == (0.0, 0.0, 0.0, 0.0)
    assert (path.at(0.0).v_m_s, path.at(0.0).v_dot_m_s2) == (0.0, pytest.approx(0.4))
    end = path.at(1e6).posture
    assert (end.x_m, end.y_m) == pytest.approx(STEPS[-1], abs=1e-12)


def test_a_closed_path_is_driven_lap_after_lap_without_a_stop():
    path = Waypoints(ROUND, [None] * 4, USUAL, closed=True)
    lap_s, first_s = path.lap.duration_s, path.start.duration_s
    for t in (first_s + 0.01, first_s + 0.3 * lap_s, first_s + 0.99 * lap_s):
        assert numbers(path.at(t + 3.0 * lap_s)) == pytest.approx(numbers(path.at(t)), abs=1e-9)
        assert path.at(t).v_m_s > 0.1
    before, after = path.at(first_s - 1e-9), path.at(first_s + 1e-9)
    assert before.v_m_s == pytest.approx(after.v_m_s, abs=1e-8)
    assert (path.at(first_s).posture.x_m, path.at(first_s).posture.y_m) == pytest.approx(ROUND[0], abs=1e-9)


def test_a_closed_path_that_needs_more_than_a_lap_to_get_up_to_speed_takes_them():
    slow = Bounds(0.4, 0.02, 3.0, 6.0)
    path = Waypoints(ROUND, [None] * 4, slow, closed=True)
    laps = (len(path.start.times_s) - 1) // len(path.ways_m)
    assert laps > 1
    assert path.start.speeds_m_s[-1] == path.lap.speeds_m_s[0]
    assert all(speed <= 0.4 for speed in path.start.speeds_m_s)


def test_it_is_slow_where_the_path_bends_and_as_fast_as_allowed_where_not():
    path = Waypoints(BEND, [0.0, None, math.pi / 2], Bounds(0.6, 1.0, 0.2, 3.0))
    speeds = path.lap.speeds_m_s
    bent = min(range(CELLS // 2, 3 * CELLS // 2), key=lambda k: speeds[k])
    assert abs(bent - CELLS) < CELLS // 2
    assert speeds[bent] < 0.7 * max(speeds)
    straight = Waypoints(((0.0, 0.0), (1.0, 0.0)), [None, None], USUAL)
    assert max(straight.lap.speeds_m_s) == 0.2
    assert straight.lap.duration_s == pytest.approx(1.0 / 0.2 + 0.2 / 0.4, rel=1e-3)


def ref(*points, **keys):
    made = [Waypoint(**dict(zip(("x_cm", "y_cm", "heading_deg"), point, strict=False))) for point in points]
    return WaypointsRef(points=tuple(made), **keys)


def test_keys_are_in_centimetres_and_degrees():
    path = ref((0.0, 0.0, 90.0), (40.0, 15.0), speed_m_s=0.3).trajectory(1.0)
    assert path.at(0.0).posture.theta_rad == pytest.approx(math.pi / 2)
    end = path.at(1e3).posture
    assert (end.x_m, end.y_m) == pytest.approx((0.4, 0.15))
    assert path.bounds == Bounds(0.3, 0.4, 0.4, 3.0)


@pytest.mark.parametrize(
    ("points", "closed", "expected"),
    [
        ([(0, 0)], False, "points: there are 1; give 2 to 200"),
        ([(8 * k, 0) for k in range(201)], False, "points: there are 201; give 2 to 200"),
        ([(0, 0), (7.4, 0)], False, r"points\[1\]: less than 7.5 cm from points\[0\]"),
        ([(0, 0), (50, 0), (5, 3)], True, r"points\[0\]: less than 7.5 cm from points\[2\]"),
        ([(0, math.nan), (50, 0)], False, r"points\[0\].y_cm: nan is not a number that can be used"),
        ([(0, 0), (50, 0, math.inf)], False, r"points\[1\].heading_deg: inf is not a number"),
        ([(0, 0), (40, 0), (0, 0)], False, r"points\[1\]: the path turns back on itself here; give heading"),
        ([(0, 0), (40, 0), (8, 0)], False, r"points\[\d\]: behind this point, at .* bends to less than 1 cm"),
    ],
)
def test_points_that_make_no_path_are_named(points, closed, expected):
    with pytest.raises(ValueError, match=expected):
        ref(*points, closed=closed)


def test_a_way_there_and_back_is_a_path_with_headings():
    path = ref((20.0, 20.0, 90.0), (60.0, 20.0, -90.0), closed=True).trajectory(1.0)
    assert path.lap.duration_s > 4.0
