"""The tracker on painted pictures: how well it measures, when it says that a robot is lost, and what it remembers."""

import pytest

from miro_exact import engine
from miro_host.eye.calibration_kinds import none
from miro_host.eye.colours import classes_of
from miro_host.eye.eye_file import EyeError
from miro_host.eye.track import Sighting, Track
from miro_host.posture import Posture
from tests.children import uncompiled
from tests.host.eye.scenes import CAMERA, FRAME, beside, drawn, errors, session, tracker
from tests.naive.painted_frame import PAINTS, PaintedFrame, PaintedRobot, sampled
from tests.states import restore, snapshot

MIDDLE = Posture(0.5, 0.35, 0.4)


def picture(*robots, noise=7):
    return PaintedFrame(robots, noise=noise)


def sight(one, true, slot=0, tick=0):
    """Gives a tracker a sighting."""
    one.tracks[slot].remember(Sighting(true.x_m, true.y_m, true.theta_rad, tick, 1.0))


# ---- how well it measures

BOUNDS = {  # cm and degrees, over all pairs of colours on a green floor and on a grey one
    ("diagonal", "binary", "green"): (0.25, 3.9),
    ("diagonal", "weighted", "green"): (0.15, 2.2),
    ("strip", "weighted", "green"): (0.18, 3.0),
    ("diagonal", "binary", "grey"): (0.18, 3.5),
    ("diagonal", "weighted", "grey"): (0.10, 2.0),
    ("strip", "weighted", "grey"): (0.14, 3.0),
}


@pytest.mark.parametrize(("pattern", "centroid", "floor"), list(BOUNDS))
def test_postures_are_measured_within_bounds(pattern, centroid, floor, monkeypatch):
    if floor == "grey":
        monkeypatch.setitem(PAINTS, "floor", (40, 40, 40))
    colours = classes_of(sampled())
    worst_cm = worst_deg = 0.0
    for index in range(80):
        true, team, number = drawn(index), ("yellow", "blue")[index % 2], index // 2 % 5
        one = tracker(team, (number,), pattern=pattern, centroid=centroid, colours=colours)
        sight(one, beside(true, 0.004, -0.003, 0.1))
        frame = PaintedFrame([PaintedRobot(true, team, number, pattern)], noise=index)
        [sighting] = one.track(frame, FRAME)
        assert frame.windows == 1
        off_cm, off_deg = errors(sighting, true)
        worst_cm, worst_deg = max(worst_cm, off_cm), max(worst_deg, off_deg)
    assert worst_cm <= BOUNDS[pattern, centroid, floor][0]
    assert worst_deg <= BOUNDS[pattern, centroid, floor][1]


def test_a_plain_scale_tracks_too_and_is_off_by_as_much_as_geometry_says():
    true = Posture(1.1, 0.7, 2.0)
    one = tracker(calibration=none(CAMERA))
    for tick in (0, FRAME):
        [sighting] = one.track(picture(PaintedRobot(true)), tick)
    assert 0.5 < errors(sighting, true)[0] < 1.6


def test_confidence_falls_with_a_patch_that_is_too_small():
    [good] = tracker().track(picture(PaintedRobot(MIDDLE)), 0)
    [dim] = tracker().track(PaintedFrame([PaintedRobot(MIDDLE)], noise=7, light=0.6), 0)
    assert 0.6 < good.confidence <= 1.0
    assert 0.0 < dim.confidence < good.confidence


# ---- following and finding


def test_robots_are_found_at_the_start_and_then_followed_in_small_windows():
    robots = [PaintedRobot(drawn(n), "yellow", n) for n in range(3)]
    one = tracker(robots=(0, 1, 2))
    found = one.track(picture(*robots), 0)
    for sighting, robot in zip(found, robots, strict=True):
        assert errors(sighting, robot.posture)[0] < 0.2
    assert (one.searches, one.lost_frames) == (1, 0)
    again = picture(*robots)
    assert one.track(again, FRAME) != [None] * 3
    assert again.windows == 3
    assert one.searches == 1


@pytest.mark.parametrize(("v_m_s", "w_rad_s"), [(1.4, 0.0), (0.3, 9.0), (0.0, 20.0)])
def test_a_fast_robot_is_followed_without_a_search(v_m_s, w_rad_s):
    one, true = tracker(), Posture(0.1, 0.3, 0.0)
    for frame in range(14):
        [sighting] = one.track(picture(PaintedRobot(true), noise=frame), frame * FRAME)
        assert errors(sighting, true)[0] < 0.2
        true = beside(true, v_m_s / 30.0, 0.0, w_rad_s / 30.0)
    assert (one.searches, one.lost_frames) == (1, 0)


def test_a_robot_that_stops_at_once_is_not_lost():
    one = tracker()
    for frame in range(12):
        true = Posture(0.1 + 0.045 * min(frame, 6), 0.3, 0.0)
        [sighting] = one.track(picture(PaintedRobot(true), noise=frame), frame * FRAME)
        assert errors(sighting, true)[0] < 0.2


def test_without_robots_all_are_lost_and_counted():
    one = tracker(robots=(0, 3))
    for frame in range(3):
        assert one.track(picture(noise=frame), frame * FRAME) == [None, None]
    assert (one.lost_frames, one.searches) == (6, 3)


def test_only_the_own_colours_are_the_robot():
    others = [PaintedRobot(MIDDLE, "blue", 0), PaintedRobot(Posture(0.2, 0.2, 1.0), "yellow", 1)]
    assert tracker("yellow", (0,)).track(picture(*others), 0) == [None]


def test_a_robot_cannot_jump_but_is_believed_when_time_has_passed():
    one, there = tracker(), Posture(0.9, 0.5, 1.0)
    one.track(picture(PaintedRobot(MIDDLE)), 0)
    assert one.track(picture(PaintedRobot(there)), FRAME) == [None]
    [sighting] = one.track(picture(PaintedRobot(there)), 10 * FRAME)
    assert errors(sighting, there)[0] < 0.2


def test_two_robots_that_look_alike_are_none():
    one = tracker()
    assert one.track(picture(PaintedRobot(MIDDLE), PaintedRobot(Posture(0.9, 0.5, 1.0))), 0) == [None]


# ---- robots that touch


@pytest.mark.parametrize("turn", [0.0, 1.6, 3.1, -1.6])
@pytest.mark.parametrize("other", [("yellow", 1), ("blue", 0), ("blue", 1)])
@pytest.mark.parametrize("side", [(-0.0755, 0.0), (0.0755, 0.0), (0.0, 0.0755), (0.0, -0.0755)])
def test_a_touching_robot_is_right_or_lost_and_never_wrong(side, other, turn):
    neighbour = beside(MIDDLE, *side, turn)
    frame = picture(PaintedRobot(MIDDLE), PaintedRobot(neighbour, *other))
    fresh, following = tracker(), tracker()
    sight(following, beside(MIDDLE, 0.01, 0.005, 0.2))
    for one in (fresh, following):
        [sighting] = one.track(frame, FRAME)
        if sighting is not None:
            off_cm, off_deg = errors(sighting, MIDDLE)
            assert off_cm < 0.4
            assert off_deg < 5.0


def test_a_team_patch_serves_one_robot_and_the_better_one_keeps_it():
    """Behind robot 0 drives robot 1 of the same heading: 0's identity patch is as far from both team patches."""
    one = tracker(robots=(0, 1))
    behind = beside(MIDDLE, -0.0755, 0.0)
    sight(one, MIDDLE, 0)
    sight(one, behind, 1)
    first, second = one.track(picture(PaintedRobot(MIDDLE), PaintedRobot(behind, "yellow", 1)), FRAME)
    assert errors(first, MIDDLE)[0] < 0.2
    assert errors(second, behind)[0] < 0.2


# ---- memory


def test_sightings_in_the_wrong_order_are_no_state():
    one = tracker()
    one.tracks[0].seen, one.tracks[0].tick, one.tracks[0].before_tick = 2, 5, 5
    data = snapshot(one)
    with pytest.raises(ValueError, match="the sighting before tick 5 has tick 5"):
        restore(tracker(), data)


@pytest.mark.slow
@pytest.mark.skipif(engine.active() != "compiled", reason="nothing is compiled here")
def test_compiled_and_uncompiled_trackers_see_the_same():
    assert uncompiled("from tests.host.eye.scenes import session; print(session())").strip() == session()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"team": "red"}, "team = 'red'"),
        ({"robots": ()}, "robots = "),
        ({"robots": (0, 0)}, "robots = "),
        ({"robots": (5,)}, "robots = "),
        ({"pattern": "cross"}, "pattern = 'cross'"),
        ({"centroid": "none"}, "centroid = 'none'"),
        ({"window_px": 65}, "window_px = 65"),
    ],
)
def test_a_tracker_of_something_else_is_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        tracker(**changes)


def test_a_colour_without_a_class_is_refused_by_name():
    few = classes_of({name: pixels for name, pixels in sampled().items() if name != "cyan"})
    with pytest.raises(EyeError, match=r"colours\.cyan: no class of this colour; sample it"):
        tracker(robots=(0, 1), colours=few)


def test_predictions_go_on_at_constant_velocity_for_a_tenth_of_a_second():
    track = Track()
    track.remember(Sighting(0.0, 0.0, 0.0, 0, 1.0))
    assert track.predicted(FRAME) == (0.0, 0.0, 0.0)
    track.remember(Sighting(0.03, 0.0, 0.1, FRAME, 1.0))
    assert track.predicted(2 * FRAME) == pytest.approx((0.06, 0.0, 0.2))
    assert 0.11 < track.predicted(50 * FRAME)[0] < 0.13
    assert track.predicted(60 * FRAME) == track.predicted(50 * FRAME)


def test_two_sightings_far_apart_in_time_tell_no_velocity():
    track = Track()
    track.remember(Sighting(0.0, 0.0, 0.0, 0, 1.0))
    track.remember(Sighting(0.03, 0.0, 0.1, 7 * FRAME, 1.0))
    assert track.predicted(8 * FRAME) == (0.03, 0.0, 0.1)


def test_a_sighting_older_than_the_last_one_begins_anew():
    track = Track()
    for tick in (800_800, 1_601_600, 100):
        track.remember(Sighting(0.3, 0.2, 0.1, tick, 1.0))
    assert track.seen == 1
    assert track.predicted(800_900) == (track.x_m, track.y_m, track.theta_rad)


def test_a_prediction_for_a_time_before_the_last_sighting_is_the_sighting():
    track = Track()
    track.remember(Sighting(0.3, 0.2, 0.1, 1 << 60, 1.0))
    track.remember(Sighting(0.4, 0.2, 0.2, (1 << 60) + 1, 1.0))
    assert track.predicted(800_800) == (track.x_m, track.y_m, track.theta_rad)
