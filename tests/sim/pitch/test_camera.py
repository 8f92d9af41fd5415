"""What the camera sees: the bytes of its slow twin, however it is asked, what each setting does, and its tables."""

import cmath
import math
import random
import statistics
from statistics import NormalDist

import pytest
from msgspec.structs import replace

from miro_exact import engine
from miro_exact.rng import Stream
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import PATTERNS
from miro_sim.pitch import sensor
from miro_sim.pitch.camera import Camera
from miro_sim.pitch.picture_settings import PictureSettings
from tests.children import uncompiled
from tests.naive.camera import Body
from tests.sim.pitch.crowd import Crowd
from tests.sim.pitch.scenes import Rig, Scene, check_rig, digest

LENS = CameraParameters()
QUIET = PictureSettings(
    light_falloff=0.0, flicker=0.0, chroma_bandwidth_hz=0.0, luma_noise=0.0, chroma_noise=0.0
)
RUNS_COMPILED = pytest.mark.skipif(engine.active() != "compiled", reason="takes minutes uncompiled")


def camera(picture=QUIET, lens=LENS):
    return Camera(lens, picture, PATTERNS["diagonal"], Stream(3, "test"))


def seen(one, x_m, y_m, z_m, side=1):
    """The pixels (Y, Cb, Cr) around a place, a square of so many."""
    u, v = Lens(one.parameters).pixel(x_m, y_m, z_m)
    data = one.window(int(u) - side // 2, int(v) - side // 2, side, side)
    return [tuple(data[at : at + 3]) for at in range(0, len(data), 3)]


def luma(one, *place):
    return seen(one, *place)[0][0]


@RUNS_COMPILED
@pytest.mark.parametrize("seed", range(12))
def test_a_window_is_that_part_of_the_picture_and_the_slow_twins(seed):
    assert check_rig(random.Random(seed), windows=40) == 205


@RUNS_COMPILED
@pytest.mark.parametrize("seed", range(4))
def test_robots_that_stand_as_in_the_frame_before_are_drawn_as_by_a_camera_that_is_new(seed):
    """From frame to frame at most one thing changes: a robot's posture, speed or colour, the ball, who is there."""
    draw, kept = random.Random(seed), camera(PictureSettings())
    places = ((0.30, 0.20), (0.38, 0.21), (0.90, 0.60), (0.95, 0.69), (0.60, 0.45))
    bodies = [Body(at & 1, at, x_m, y_m, 0.3 * at, 0.0, 0.0) for at, (x_m, y_m) in enumerate(places)]
    corners = [Lens(LENS).pixel(x_m, y_m, 0.075) for x_m, y_m in places[::2]]
    windows = [(int(u) - 20, int(v) - 20, 40, 40) for u, v in corners]
    changes = ("none", "x_m", "theta_rad", "v_m_s", "identity", "ball", "there")
    there, ball = len(bodies), []
    for frame in range(60):
        change, at = draw.choice(changes), draw.randrange(5)
        if change == "ball":
            ball = [metres + draw.uniform(0.0, 0.08) for metres in places[at]]
            kept.ball(*ball)
        elif change == "there":
            there = draw.randint(3, 5)
        elif change == "identity":
            bodies[at] = bodies[at]._replace(identity=draw.randrange(5))
        elif change != "none":
            moved = getattr(bodies[at], change) + draw.uniform(-0.01, 0.01)
            bodies[at] = bodies[at]._replace(**{change: moved})
        new = camera(PictureSettings())
        if ball:
            new.ball(*ball)
        for one in (kept, new):
            one.clear_robots()
            for body in bodies[:there]:
                one.robot(*body)
            one.begin(frame, 0)
        for window in draw.choice((windows, windows[::-1])):
            assert kept.window(*window) == new.window(*window), (frame, change, at, window)


@pytest.mark.slow
@RUNS_COMPILED
def test_both_engines_draw_the_same_bytes():
    code = "from tests.sim.pitch.scenes import digest; print(digest())"
    assert uncompiled(code).strip() == digest()


def test_patches_top_sides_and_floor_are_where_they_should_be():
    one = camera()
    one.robot(0, 0, 0.9, 0.35, 0.0)
    one.begin(0, 0)
    yellow = seen(one, 0.919, 0.369, 0.075)[0]
    magenta = seen(one, 0.881, 0.331, 0.075)[0]
    black = seen(one, 0.919, 0.331, 0.075)[0]
    floor = seen(one, 0.9, 0.6, 0.0)[0]
    side = seen(one, 0.8625, 0.35, 0.04)[0]  # the side that faces the middle of the pitch
    assert yellow[0] > 180
    assert yellow[1] < 60  # little blue
    assert magenta[2] > 200  # much red
    assert black[0] < 60
    assert side[0] > 140
    assert abs(side[1] - 128) < 8
    assert floor[1] < 128
    assert floor[2] < 115  # green


def test_a_robot_hides_the_floor_and_the_ball_behind_it_and_the_ball_hides_a_side():
    hidden, alone, before = camera(), camera(), camera()
    hidden.robot(0, 0, 1.0, 0.35, 0.0)
    hidden.ball(1.06, 0.35)  # outside of it: the top, which is nearer to the camera, hides half of it
    alone.ball(1.06, 0.35)
    before.robot(0, 0, 1.0, 0.35, 0.0)
    before.ball(0.939, 0.35)
    for each in (hidden, alone, before):
        each.begin(0, 0)
    orange = seen(alone, 1.05, 0.35, 0.02)[0]
    assert orange[2] > 170
    assert seen(hidden, 1.05, 0.35, 0.02)[0][2] < 150
    assert seen(before, 0.945, 0.35, 0.025)[0][2] > 165


def test_walls_are_white_inside_and_black_on_top_and_the_goal_is_open():
    one = camera()
    one.begin(0, 0)
    assert luma(one, 0.25, -0.1, 0.025) > 150
    assert luma(one, 0.25, -0.115, 0.05) < 60
    assert luma(one, -0.17, 0.35, 0.0) == luma(one, 0.2, 0.2, 0.0)  # the floor of the goal


def test_noise_has_its_deviation_and_is_another_in_each_frame_and_pixel():
    one = camera(replace(QUIET, luma_noise=4.0, chroma_noise=8.0))
    one.begin(0, 0)
    first = one.window(60, 150, 40, 40)
    assert statistics.stdev(first[0::3]) == pytest.approx(4.0, rel=0.1)
    assert statistics.stdev(first[1::3]) == pytest.approx(8.0, rel=0.1)
    assert statistics.stdev(first[2::3]) == pytest.approx(8.0, rel=0.1)
    one.begin(1, 0)
    again = one.window(60, 150, 40, 40)
    different = sum(a != b for a, b in zip(first, again, strict=True))
    assert different > 0.8 * len(first)
    one.begin(0, 0)
    assert one.window(60, 150, 40, 40) == first


def test_lamps_flicker_at_twice_the_mains_unless_the_exposure_is_whole_periods():
    def levels(**changed):
        one = camera(replace(QUIET, flicker=0.5, **changed))
        found = set()
        for frame in range(0, 240, 20):
            one.begin(frame, frame * 800_800)
            found.add(luma(one, 0.2, 0.2, 0.0))
        return found

    assert len(levels(mains_hz=60)) == 1  # 1/60 s is two periods
    assert len(levels(mains_hz=50)) > 1
    assert len(levels(mains_hz=60, exposure_s=0.004)) > 1


def test_a_moving_robot_is_blurred_and_a_second_field_shows_a_comb():
    def picture(v_m_s=1.2, **changed):
        one = camera(replace(QUIET, **changed))
        one.robot(0, 0, 0.55, 0.35, 0.0, v_m_s)
        one.begin(0, 0)
        u, v = Lens(LENS).pixel(0.55, 0.35, 0.075)
        return one.window(int(u) - 20, int(v) - 16, 40, 32)

    sharp, blurred = picture(exposure_s=0.0), picture()
    assert sharp != blurred
    assert picture(fields=2) != blurred
    assert picture(0.0) == picture(0.0, fields=2)


def test_chroma_bleeds_sideways_and_luma_does_not():
    def beside(bandwidth_hz):
        one = camera(replace(QUIET, chroma_bandwidth_hz=bandwidth_hz))
        one.robot(0, 0, 0.55, 0.35, 0.7853981633974483)
        one.begin(0, 0)
        return one.window(130, 100, 60, 40)

    def coloured(data):
        return sum(cr - 128 > 8 for cr in data[2::3])

    sharp, soft = beside(0.0), beside(0.6e6)
    assert sharp[0::3] == soft[0::3]
    assert coloured(soft) > coloured(sharp) + 10


def test_what_cannot_be_is_refused():
    one = camera()
    most, least = (1 << 63) - 1, -1 << 63
    beside = (-1, 0, 4, 4), (0, 0, 0, 4), (300, 0, 21, 1), (0, 239, 1, 2)
    far = (most, 0, 1, 1), (1, most, 1, 1), (1, 0, most, 1), (0, 1, 1, most), (0, 0, least, least)
    for bad in beside + far:
        with pytest.raises(ValueError, match="is not inside 320 x 240"):
            one.window(*bad)
    with pytest.raises(ValueError, match="no robot 5 of team 0 has colours"):
        one.robot(0, 5, 0.0, 0.0, 0.0)
    for number in range(10):
        one.robot(number // 5, number % 5, 0.1 * number, 0.0, 0.0)
    with pytest.raises(ValueError, match="room for 10 robots"):
        one.robot(0, 0, 0.0, 0.5, 0.0)


@pytest.mark.parametrize("fields", [1, 2])
@pytest.mark.parametrize("sub_exposures", [1, 3])
@pytest.mark.parametrize(
    ("x_m", "v_m_s"), [(0.55, 5000.0), (0.55, -1e12), (600.0, 0.0), (-1e9, 0.0), (0.55, 0.0), (0.55, 1000.0)]
)
def test_robots_that_are_far_or_leave_within_an_exposure_are_drawn_as_the_slow_twin_draws_them(
    x_m, v_m_s, sub_exposures, fields
):
    picture = replace(QUIET, sub_exposures=sub_exposures, fields=fields)
    drawn = Rig(LENS, picture, PATTERNS["diagonal"], Stream(3, "test"))
    bodies = [Body(0, 0, x_m, 0.35, 0.4, v_m_s, 0.0), Body(1, 2, 0.62, 0.38, 0.0, 0.0, 0.0)]
    one = Scene(bodies, None, 5, 4711, (140, 110, 24, 12))
    eye = drawn.camera()
    one.put(eye)
    assert eye.window(*one.window) == one.drawn_by(drawn.naive())


@pytest.mark.parametrize("wrong", [{"luma_noise": 65.0}, {"fields": 3}, {"sub_exposures": 4}, {"bits": 0}])
def test_settings_out_of_their_range_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        camera(replace(QUIET, **wrong))


def test_an_exposure_of_no_time_shows_the_lamps_as_they_are_then():
    flickering = replace(QUIET, flicker=1.0)
    short, none = (camera(replace(flickering, exposure_s=exposure_s)) for exposure_s in (1e-18, 0.0))
    for tick in range(0, 800_800, 50_000):
        short.begin(0, tick)
        none.begin(0, tick)
        assert short.window(100, 100, 8, 8) == none.window(100, 100, 8, 8)


def test_a_camera_that_looks_near_to_the_horizon_is_refused():
    with pytest.raises(ValueError, match="too near to the horizon"):
        camera(lens=CameraParameters(focal_px=50.0, height_m=10.0, k1=0.0, tilt_x_rad=0.3))


def test_the_draws_of_noise_are_quantiles_of_a_standard_normal():
    normals = sensor._normals()
    expected = [NormalDist().inv_cdf((step + 0.5) / 4096) for step in range(4096)]
    assert [value / 65536 for value in sorted(normals)] == pytest.approx(expected, abs=1e-3)
    assert sum(normals) == 0


@pytest.mark.parametrize("bandwidth_hz", [0.25e6, 0.4e6, 0.6e6, 1.3e6])
def test_the_low_pass_lets_all_of_a_flat_colour_through_and_is_3_db_down_at_its_bandwidth(bandwidth_hz):
    taps = sensor._taps(bandwidth_hz)
    sides = [*reversed(taps[1:]), *taps]
    assert sum(sides) == 65536
    turn = 2 * math.pi * bandwidth_hz / sensor.PIXELS_PER_SECOND
    gain = abs(sum(tap * cmath.exp(1j * turn * place) for place, tap in enumerate(sides))) / 65536
    assert 20 * math.log10(gain) == pytest.approx(-3.01, abs=0.15)


def test_without_a_bandwidth_nothing_is_filtered():
    assert sensor._taps(0.0) == [65536]


def test_the_gamma_curve_goes_from_black_to_white():
    shown, _, _ = sensor._tables(0.45, 0.0, 0.0)
    assert (shown[0], shown[4095]) == (0, 4080)
    assert shown == sorted(shown)
    assert shown[2048] == math.floor(4080 * (2048 / 4095) ** 0.45 + 0.5)


@RUNS_COMPILED
@pytest.mark.parametrize(("centroid", "dropped", "mains_hz"), [("binary", 0.0, 60), ("weighted", 0.05, 50)])
def test_in_a_crowd_no_robot_is_swapped_or_wrong_and_few_are_lost(centroid, dropped, mains_hz):
    crowd = Crowd(7, PictureSettings(mains_hz=mains_hz), centroid)
    drops = random.Random(8)
    for frame in range(1, 401):
        crowd.step(frame, drops.random() < dropped)
    counts = crowd.counts
    assert counts.together > 100
    assert counts.fastest_m_s > 1.3
    assert (counts.swapped, counts.wrong) == (0, 0), counts.wrong_at
    assert counts.seen > 0.99 * (counts.seen + counts.lost) > 2000
