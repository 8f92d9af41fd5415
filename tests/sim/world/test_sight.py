"""Cameras in the world: what each kind tells the PC, what befalls whole frames, and what is refused."""

import math
from itertools import pairwise

import pytest

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.grabber import Grabber
from miro_host.eye.track import Sighting
from miro_sim.scenario.camera_keys import CalibrationErrorSizes, GeometricCamera
from miro_sim.scenario.file import ScenarioError, parse
from miro_sim.world.sight import calibration_for
from miro_sim.world.world import World
from tests.sim.world.rig import image

ROBOT = """
[[network.robot]]
slot = {}
start_error_x_cm = {}
start_error_y_cm = {}
reference.kind = "line"
"""
NO_ERRORS = "worst_cm = 0.0, centre_px = 0.0, focal_share = 0.0, tilt_deg = 0.0"
HEAD = 'name = "eyes"\nduration_s = 1\n[camera]\n{camera}\n[[network]]\n'


def scenario(camera, robots=((0, 0, 0),), others=()):
    text = HEAD.format(camera=camera) + "".join(ROBOT.format(*robot) for robot in robots)
    if others:
        text += "[[network]]\n" + "".join(ROBOT.format(*robot) for robot in others)
    return parse(text, "eyes.toml")


def world(camera, *robots, others=(), seed=3):
    return World(scenario(camera, robots or ((0, 0, 0),), others), seed, image())


def measured(one, periods=20):
    """(truth one frame ago, measurement) of the first robot, once there are some."""
    found, before = [], None
    for _ in range(periods):
        robot = one.step().robots[0]
        if before is not None and robot.measurement is not None:
            found.append((before, robot.measurement))
        before = robot.truth
    return found


def refusal(camera, robots=((0, 0, 0),), others=()):
    with pytest.raises(ScenarioError) as caught:
        scenario(camera, robots, others)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def off_cm(pair):
    truth, seen = pair
    return 100 * math.hypot(seen.x_m - truth.x_m, seen.y_m - truth.y_m)


def test_a_calibrated_tracker_finds_the_robot_to_a_millimetre_or_two_one_frame_late():
    pairs = measured(world('kind = "pixels"\ncalibration = "exact"'))
    assert len(pairs) == 19
    assert max(off_cm(pair) for pair in pairs) < 0.18
    assert all(isinstance(seen, Sighting) and 0.3 < seen.confidence <= 1.0 for _, seen in pairs)
    assert [seen.tick for _, seen in pairs] == [CONTROL_PERIOD_TICKS * k for k in range(19)]


def test_the_geometric_camera_has_the_field_of_the_calibration_and_no_noise():
    pixels = measured(world('kind = "pixels"'))
    geometric = measured(world('kind = "geometric"'))
    for (_, seen), (truth, read) in zip(pixels, geometric, strict=True):
        assert math.hypot(seen.x_m - read.x_m, seen.y_m - read.y_m) < 0.0025
        assert 0.1 < off_cm((truth, read)) < 2.41
    assert measured(world('kind = "geometric"')) == geometric
    exact = measured(world('kind = "geometric"\ncalibration = "exact"'))
    assert max(off_cm(pair) for pair in exact) < 1e-6


def test_the_calibration_of_1997_is_drawn_once_a_seed():
    def first_error(seed):
        truth, seen = measured(world('kind = "geometric"', seed=seed), 3)[0]
        return (seen.x_m - truth.x_m, seen.y_m - truth.y_m)

    assert first_error(1) == first_error(1)
    assert len({first_error(seed) for seed in range(6)}) == 6


def test_1997_is_a_word_or_a_number():
    word, number = (world(f'kind = "geometric"\ncalibration = {name}') for name in ('"1997"', "1997"))
    assert measured(word) == measured(number)


@pytest.mark.parametrize(
    ("errors", "least_cm", "most_cm"),
    [
        ("worst_cm = 0.5", 0.0, 0.5),
        (NO_ERRORS, 0.0, 1e-6),
        ("worst_cm = 0.0, focal_share = 0.0, tilt_deg = 0.0", 0.3, 0.5),  # a pixel is 0.42 cm
        (f"{NO_ERRORS}, ignore_height = true", 1.0, 3.2),
        (f"{NO_ERRORS}, ignore_distortion = true", 0.1, 2.7),
    ],
)
def test_each_error_of_the_calibration_is_switched_by_itself(errors, least_cm, most_cm):
    pairs = measured(world(f'kind = "geometric"\ncalibration_errors = {{ {errors} }}'), 4)
    assert all(least_cm <= off_cm(pair) <= most_cm for pair in pairs), [off_cm(pair) for pair in pairs]


def test_a_dropped_frame_is_no_measurement_and_a_lost_robot_is_none_for_it_alone():
    dropped = world('kind = "pixels"\ndropped_frames = 1.0')
    assert measured(dropped) == []
    assert dropped.networks[0].sight.dropped == 20
    lost = world('kind = "geometric"\nlost_robots = 0.5', (0, 0, 0), (1, 30, 0))
    found = [[robot.measurement is not None for robot in lost.step().robots] for _ in range(30)]
    assert {(True, False), (False, True), (True, True)} <= {tuple(pair) for pair in found}
    assert lost.networks[0].sight.lost == pytest.approx(30, abs=15)


def test_a_repeated_frame_brings_the_measurement_before_once_more():
    one = world('kind = "geometric"\nrepeated_frames = 0.5')
    seen = [pair[1] for pair in measured(one, 29)]
    repeats = sum(a == b for a, b in pairwise(seen))
    assert repeats > 4
    assert one.networks[0].sight.repeated >= repeats


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_grabber_is_as_many_frames_late_as_it_says(delay):
    grabber = Grabber(1, delay)
    sent = [(Sighting(0.1 * k, 0.0, 0.0, k, 1.0),) for k in range(8)]
    assert [grabber.take(frame) for frame in sent] == [(None,)] * delay + sent[: 8 - delay]
    assert grabber.take(None) == sent[8 - delay] if delay else sent[7]


def test_each_host_follows_its_own_robots_among_those_of_the_other():
    one = world(
        'kind = "pixels"\ncalibration = "exact"', *((0, 0, 0), (2, 30, 20)), others=((0, 12, 0), (2, 30, 32))
    )
    before = None
    for _ in range(12):
        period = one.step()
        if before is not None:
            for old, robot in zip(before.robots, period.robots, strict=True):
                assert robot.measurement is not None
                assert off_cm((old.truth, robot.measurement)) < 0.2
        before = period
    none = dict.fromkeys(("lost", "dropped", "repeated", "wrong", "swapped"), 0)
    assert [network.sight.counts() for network in one.networks] == [{"frames": 12, **none}] * 2


@pytest.mark.parametrize("kind", ["pixels", "geometric", "gaussian"])
def test_a_world_goes_on_from_a_saved_one_whatever_its_camera(kind):
    camera = f'kind = "{kind}"\ndelay_frames = 2'
    whole, cut = world(camera), world(camera)
    for _ in range(6):
        whole.step()
        cut.step()
    cut.run_to(cut.tick + 333_333)
    again = world(camera)
    again.load(cut.save())
    for _ in range(6):
        whole.step()
        again.step()
    assert again.digest == whole.digest


def test_a_host_that_learns_its_camera_goes_on_from_a_saved_world_and_is_nearer_to_the_truth():
    camera = 'kind = "pixels"\nself_calibration = "lines"'
    whole, cut = world(camera), world(camera)
    for _ in range(22):
        whole.step()
        cut.step()
    again = world(camera)
    again.load(cut.save())
    pairs = measured(again, 12)
    for _ in range(12):
        whole.step()
    assert again.digest == whole.digest
    told = measured(world('kind = "pixels"'), 12)
    assert max(map(off_cm, pairs)) < 0.3 < min(map(off_cm, told))


def test_looking_at_the_picture_changes_no_bit():
    quiet, watched = world('kind = "pixels"'), world('kind = "pixels"')
    for _ in range(8):
        quiet.step()
        watched.step()
        sight = watched.networks[0].sight
        sight.picture_at(sight.frame, watched.tick).window(0, 0, 320, 240)
    assert quiet.digest == watched.digest


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        ("lens.height_m = 1.0", "camera.lens: does not see the pitch's corner (-10, -10) cm; hang it above"),
        ("lens.x_m = 2.0", "camera.lens: hangs at (200, 35) cm, beside the pitch; hang it above the pitch"),
        ("lens.tilt_y_rad = 0.4", "camera.lens: does not see the pitch's corner"),
        (
            "lens = { focal_px = 60.0, k1 = -0.5 }",
            "camera.lens: pixel (0.0, 0.0) lies beyond what the lens draws",
        ),
        ("lens.height_m = 0.1", "camera.lens.height_m: 0.1 is out of range; must be >= 0.5 in metres"),
        ("picture.bits = 9", "camera.picture.bits: 9 is out of range; must be <= 8"),
        (
            'calibration = "1998"',
            "camera.calibration: '1998' is not one of the choices; use 1997, exact or none",
        ),
        (
            "lens = { height_m = 1.0, y_m = -0.1, focal_px = 50.0, k1 = 0.5, centre_v_px = 200.0, tilt_x_rad = 0.5 }",
            "camera.lens: pixel (",
        ),
        ("lens = { k1 = -0.3, height_m = 0.5, focal_px = 400.0 }", "does not see the pitch's corner"),
        ("picture.chroma_bandwidth_hz = 1e-160", "must be 0 (not limited) or >= 250000 in hertz"),
        ("window_px = 8", "camera.window_px: 8 is out of range; must be >= 16"),
        ('pattern = "dots"', "camera.pattern: 'dots' is not one of the choices; use diagonal or strip"),
    ],
)
def test_a_camera_that_cannot_be_is_refused_with_place_and_remedy(camera, said):
    assert said in refusal(f'kind = "pixels"\n{camera}')


def test_a_robot_that_starts_outside_the_view_is_refused():
    lens = "lens = { focal_px = 470.0, x_m = 0.50 }"
    said = refusal(f'kind = "pixels"\n{lens}', ((0, 115, 60),))
    assert "network[0].robot[0].start_error_x_cm: the robot starts outside the camera's view" in said


def test_colours_that_cannot_be_told_apart_are_refused():
    with pytest.raises(ValueError, match=r"camera\.picture"):
        world('kind = "pixels"\npicture = { chroma_noise = 60.0, gain = 0.1 }')


def test_without_a_ball_its_colour_need_not_be_told_from_others():
    dim = 'kind = "pixels"\npicture = { light_falloff = 0.9 }\n'
    assert world(dim).finished is False
    with pytest.raises(ValueError, match="orange"):
        world(dim + "ball = { x_cm = 55, y_cm = 35 }")


def test_a_third_team_has_no_colour():
    text = HEAD.format(camera='kind = "pixels"') + ROBOT.format(0, 0, 0)
    text += 2 * ("[[network]]\n" + ROBOT.format(0, 30, 20))
    with pytest.raises(ScenarioError, match=r"camera\.kind: 3 networks, but patches have the"):
        parse(text, "eyes.toml")


def test_a_calibration_that_cannot_be_is_refused_with_the_key():
    camera = GeometricCamera(lens=CameraParameters(focal_px=50.0, height_m=0.5, k1=0.0))
    said = []
    for seed in range(8):
        try:
            calibration_for(camera, 0, seed)
        except BadInput as error:
            said.append(str(error))
    assert said
    assert all("no calibration of this camera can be so wrong" in message for message in said)


@pytest.mark.parametrize("seed", range(8))
def test_errors_under_which_the_pitch_cannot_be_seen_are_scaled_down_and_not_to_nothing(seed):
    errors = CalibrationErrorSizes(centre_px=20.0, focal_share=0.2, tilt_deg=10.0)
    camera = GeometricCamera(lens=CameraParameters(focal_px=230.0, height_m=1.0), calibration_errors=errors)
    assert calibration_for(camera, 0, seed)[1] == pytest.approx(0.0240, abs=1e-6)


def test_a_small_error_alone_is_scaled_up_to_the_worst_case():
    small = "calibration_errors = { centre_px = 0.2, focal_share = 0, tilt_deg = 0 }"
    sight = world('kind = "geometric"\n' + small).networks[0].sight
    assert sight.worst_m == pytest.approx(0.0240 + 0.0035, abs=1e-6)
