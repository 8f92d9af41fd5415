"""The lens, from the ground to a pixel and back; calibrations: files, fits, and the wrong ones of experiments."""

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.rng import Stream
from miro_host.eye import calibration, eye_file
from miro_host.eye.calibration import Calibration
from miro_host.eye.calibration_kinds import (
    CalibrationErrors,
    drawn_1997,
    exact,
    none,
    worst_error_m,
    wrong,
)
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.eye_file import EyeError
from miro_host.eye.fit import IN_PLANE, IN_SPACE, ControlPoint, fit, parse_points, read_points
from miro_host.eye.least_squares import NoConvergenceError, minimised
from miro_host.eye.lens import Lens
from tests.example_count import examples

cameras = st.builds(
    CameraParameters,
    height_m=st.floats(1.8, 3.0),
    tilt_x_rad=st.floats(-0.05, 0.05),
    tilt_y_rad=st.floats(-0.05, 0.05),
    turn_rad=st.floats(-3.1, 3.1),
    pixel_aspect=st.floats(0.9, 1.1),
    k1=st.floats(-0.25, 0.25),
)


@examples(200)
@given(cameras, st.floats(-0.1, 1.2), st.floats(-0.1, 0.8), st.floats(0.0, 0.1))
def test_a_point_is_found_again_from_its_pixel(camera, x_m, y_m, z_m):
    lens = Lens(camera)
    u, v = lens.pixel(x_m, y_m, z_m)
    assert lens.ground(u, v, z_m) == pytest.approx((x_m, y_m), abs=1e-9)


def test_the_pictures_right_is_x_and_its_top_is_y():
    lens = Lens(CameraParameters())
    assert lens.pixel(0.55, 0.35, 0.0) == (160.0, 120.0)
    assert lens.pixel(0.65, 0.35, 0.0)[0] > 160.0
    assert lens.pixel(0.55, 0.45, 0.0)[1] < 120.0


def test_a_point_that_the_lens_would_draw_further_in_again_is_not_drawn():
    lens = Lens(CameraParameters())
    with pytest.raises(ValueError, match="beyond what the lens draws"):
        lens.pixel(4.85, 0.35, 0.075)
    assert lens.pixel(1.2, 0.8, 0.0)[0] < 320.0


CAMERA = CameraParameters()
OTHER = CameraParameters(
    x_m=0.6,
    y_m=0.3,
    height_m=2.1,
    focal_px=470.0,
    centre_u_px=162.0,
    k1=-0.15,
    tilt_x_rad=0.02,
    tilt_y_rad=-0.03,
    turn_rad=0.05,
    pixel_aspect=1.02,
)
HIGH = CameraParameters(height_m=9.0, focal_px=2000.0)


def seen(camera, *heights_m, step=26):
    lens = Lens(camera)
    places = [
        (x / 100, y / 100, z) for z in heights_m for x in range(-10, 121, step) for y in range(-10, 81, 18)
    ]
    return [ControlPoint(*place, *lens.pixel(*place)) for place in places]


# ---- the fit


def test_points_at_two_heights_tell_the_whole_camera():
    found = fit(seen(OTHER, 0.0, 0.075), CAMERA)
    assert found.free == IN_SPACE
    for name in IN_SPACE:
        assert getattr(found.camera, name) == pytest.approx(getattr(OTHER, name), abs=1e-6), name
    assert found.residuals.rms_px < 1e-9


def test_points_in_a_plane_leave_height_and_centre_and_are_right_in_that_plane():
    found = fit(seen(OTHER, 0.075), CAMERA)
    assert found.free == IN_PLANE
    assert (found.camera.height_m, found.camera.centre_u_px) == (CAMERA.height_m, CAMERA.centre_u_px)
    assert worst_error_m(OTHER, found) < 0.0005
    assert found.residuals.points == len(found.residuals.px) == 36
    assert max(found.residuals.px) == found.residuals.max_px


def read_to_a_third(points):
    noise = Stream(5, "points")
    return [
        point._replace(u=point.u + 0.3 * noise.gauss(2 * n), v=point.v + 0.3 * noise.gauss(2 * n + 1))
        for n, point in enumerate(points)
    ]


@pytest.mark.parametrize(
    ("true", "told", "within_m"),
    [(OTHER, CAMERA, 0.003), (HIGH, HIGH, 0.01)],
    ids=["as usual", "high with a long lens"],
)
def test_pixels_read_to_a_third_give_millimetres(true, told, within_m):
    found = fit(read_to_a_third(seen(true, 0.0, 0.075)), told)
    assert worst_error_m(true, found) < within_m
    assert 0.2 < found.residuals.rms_px < 0.5


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([], "points.csv: 0 points for 8 parameters; give at least 5"),
        (seen(OTHER, 0.0)[:4] * 3, "4 points for 8 parameters"),
        (seen(OTHER, 0.0)[:6] * 2, "the points lie on one line; add points beside it"),
        (
            [*seen(OTHER, 0.0), ControlPoint(0.5, 0.5, 2.0, 160.0, 120.0)],
            "point 37: .*not in front of the camera",
        ),
        ([p._replace(u=p.v, v=p.u) for p in seen(CAMERA, 0.0)], "no convergence: .*; "),
    ],
)
def test_points_that_tell_no_camera_are_refused_with_a_remedy(points, said):
    with pytest.raises(EyeError, match=said):
        fit(points, CAMERA, "points.csv")


def test_least_squares_finds_a_known_minimum_and_says_when_there_is_none():
    found = minimised(lambda v: [v[0] - 2.0, 10.0 * (v[1] - v[0] * v[0])], [-1.0, 1.0])
    assert found == pytest.approx([2.0, 4.0], abs=1e-8)
    with pytest.raises(NoConvergenceError):
        minimised(lambda v: [1.0 / v[0]], [1.0])  # falls for ever
    with pytest.raises(NoConvergenceError, match="math domain error"):
        minimised(lambda v: [math.sqrt(v[0])], [0.0])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_a_file_of_points_is_read_in_any_order_of_columns_with_a_byte_order_mark_or_without(
    tmp_path, encoding
):
    file = tmp_path / "points.csv"
    file.write_text("u_px,v_px,x_cm,y_cm,height_cm\n160,120,55,35,7.5\n\n1,2,3,4,0\n", encoding)
    assert read_points(file) == [
        ControlPoint(0.55, 0.35, 0.075, 160.0, 120.0),
        ControlPoint(0.03, 0.04, 0.0, 1.0, 2.0),
    ]


HEADER = "x_cm,y_cm,height_cm,u_px,v_px\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "p.csv:1: the columns are ; they must be x_cm"),
        ("x,y\n1,2\n", "p.csv:1: the columns are x, y; they must be"),
        (HEADER + "1,2,3,4,5\n1,2,3\n", "p.csv:3: 3 cells; a line must have 5"),
        (HEADER + "1,2,3,4,here\n", "p.csv:2: v_px: 'here' is no number"),
        (HEADER + "1,nan,3,4,5\n", "p.csv:2: y_cm: 'nan'; write a number within"),
    ],
)
def test_a_file_of_points_that_cannot_be_used_is_refused_by_line(text, said):
    with pytest.raises(EyeError) as caught:
        parse_points(text, "p.csv")
    assert f"{caught.value}".startswith(said)


# ---- files of calibrations


@pytest.mark.parametrize("made", [exact(CAMERA), none(OTHER), fit(seen(OTHER, 0.0), CAMERA)])
def test_a_calibration_reads_back_as_it_was(made, tmp_path):
    file = tmp_path / "camera.toml"
    file.write_text(made.text())
    assert calibration.read(file) == made


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = ", "c.toml: line 1: not TOML: "),
        ("version = 1", "c.toml: camera: this key is missing; add it"),
        ("zoom = 2\n[camera]", "c.toml: zoom: unknown key; keys here: camera, version"),
        ("kamera = 2\n[camera]", "c.toml: kamera: unknown key; did you mean camera?"),
        ("[camera]\nfocal = 400.0", "c.toml: camera.focal: unknown key; remove or correct it"),
        ("[camera]\nk1 = 'much'", "c.toml: camera.k1: expected a number, got a string; mend the value"),
        ("[camera]\nk1 = 0.7", "c.toml: camera.k1: is out of range; must be <= 0.5"),
        ("[camera]\nx_m = nan", "c.toml: camera.x_m: nan is not a number that can be used"),
        ("version = 2\n[camera]", "c.toml: version: invalid enum value 2"),
    ],
)
def test_a_file_that_is_no_calibration_is_refused_by_key(text, said):
    with pytest.raises(EyeError) as caught:
        eye_file.parse(text, Calibration, "c.toml")
    assert f"{caught.value}".startswith(said)


def test_a_file_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(EyeError, match="cannot be read: No such file"):
        calibration.read(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff")
    with pytest.raises(EyeError, match="not UTF-8"):
        calibration.read(tmp_path / "bytes.toml")


# ---- kinds


@pytest.mark.parametrize("seed", range(12))
def test_a_drawn_calibration_is_wrong_by_2_40_cm_at_its_worst(seed):
    found = drawn_1997(CAMERA, Stream(seed, "calibration"))
    assert worst_error_m(CAMERA, found) == pytest.approx(0.0240, abs=1e-9)
    assert not found.ignore_height
    drawn = drawn_1997(CAMERA, Stream(seed, "calibration"), worst_m=0.0)
    factor = (found.camera.focal_px / CAMERA.focal_px - 1.0) / (drawn.camera.focal_px / CAMERA.focal_px - 1.0)
    assert 0.6 < factor < 1.3  # all are about 1 px, 1 % and 0.57 degrees
    assert found == drawn_1997(CAMERA, Stream(seed, "calibration"))


def test_seeds_draw_different_calibrations():
    assert len({drawn_1997(CAMERA, Stream(seed, "calibration")).camera for seed in range(9)}) == 9


def test_each_error_by_itself_moves_what_is_seen_by_as_much_as_geometry_says():
    """1 px is 4.2 mm at the tops; 1 % of 79 cm; 0.57 degrees at 1.925 m; height: 7.5 cm of 2 m, seen from 79 cm off."""
    worst = {
        "centre_u_px": (1.0, 0.0046),
        "focal_share": (0.01, 0.0085),
        "tilt_x_rad": (0.00995, 0.0215),
        "ignore_height": (True, 0.0308),
        "ignore_distortion": (True, 0.0267),
    }
    for name, (value, expected_m) in worst.items():
        found = wrong(CAMERA, CalibrationErrors(**{name: value}))
        assert worst_error_m(CAMERA, found) == pytest.approx(expected_m, rel=0.06), name
    assert worst_error_m(CAMERA, exact(CAMERA)) < 1e-12


def test_height_and_distortion_cancel_in_part_in_a_plain_scale():
    assert 0.011 < worst_error_m(CAMERA, none(CAMERA)) < 0.014


def test_an_error_out_of_range_is_refused():
    with pytest.raises(ValueError, match="calibration errors: Expected float"):
        wrong(CAMERA, CalibrationErrors(tilt_x_rad=0.6))
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"tilt": 1.0}, CalibrationErrors)
