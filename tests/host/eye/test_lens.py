"""The lens: from the ground to a pixel and back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_host.eye.camera_parameters import CameraParameters
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
