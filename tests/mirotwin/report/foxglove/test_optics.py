"""The camera in Foxglove's words draws a point where our lens draws it."""

import pytest

from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens
from mirotwin.report.foxglove import frames
from mirotwin.report.foxglove.messages import time_of

LENSES = (
    CameraParameters(),
    CameraParameters(k1=0.1, focal_px=500.0, pixel_aspect=1.2, centre_u_px=150.0, centre_v_px=130.0),
    CameraParameters(tilt_x_rad=0.3, tilt_y_rad=-0.2, turn_rad=2.0),
    CameraParameters(x_m=0.2, y_m=0.9, height_m=3.0, tilt_x_rad=-0.1, tilt_y_rad=0.25, turn_rad=-1.0),
)
POINTS = ((0.0, 0.0, 0.0), (1.1, 0.0, 0.075), (0.2, 0.7, 0.05), (0.6, 0.3, 0.0))


def drawn(message, at, point):
    """Where OpenCV's model `plumb_bob` draws a point of the pitch."""
    q, place = at.rotation, at.translation
    away = (point[0] - place.x, point[1] - place.y, point[2] - place.z)
    x, y, z = turned((-q.x, -q.y, -q.z, q.w), away)
    x, y = x / z, y / z
    square = x * x + y * y
    k1, k2, p1, p2, k3 = message.distortion
    grown = 1.0 + k1 * square + k2 * square**2 + k3 * square**3
    x, y = (
        x * grown + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
        y * grown + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
    )
    k = message.intrinsic
    return k[0] * x + k[1] * y + k[2], k[3] * x + k[4] * y + k[5]


def turned(q, v):
    """v' = v + 2 w (u x v) + 2 u x (u x v)."""
    u, w = q[:3], q[3]
    once = cross(u, v)
    twice = cross(u, once)
    x, y, z = (v[i] + 2.0 * w * once[i] + 2.0 * twice[i] for i in range(3))
    return x, y, z


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("lens", LENSES)
def test_a_point_is_drawn_half_a_pixel_from_where_our_lens_draws_it(lens, point):
    at = time_of(0)
    u, v = drawn(frames.calibration(0, lens, at), frames.transform(0, lens, at), point)
    ours = Lens(lens).pixel(*point)  # counts from the edge of the first pixel, OpenCV from its middle
    assert (u + 0.5, v + 0.5) == pytest.approx(ours, abs=1e-9)


def test_the_projection_is_that_of_the_picture_without_distortion(shown):
    (content, *_) = [one.content for one in shown if one.topic == "/foxglove/net1/calibration"]
    k, p = content["K"], content["P"]
    assert [p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]] == k
    assert (p[3], p[7], p[11]) == (0.0, 0.0, 0.0)
    assert content["R"] == [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    assert (content["width"], content["height"]) == (320, 240)
