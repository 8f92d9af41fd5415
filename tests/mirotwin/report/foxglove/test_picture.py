"""The camera in Foxglove's words draws a point where our lens draws it, and the scene lies on the picture."""

import base64
import io
import math

import msgspec
import pytest
from PIL import Image

from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens
from mirotwin.report.foxglove import frames
from mirotwin.report.foxglove.messages import LINE_LIST, CameraCalibration, FrameTransform, time_of

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


class Frame:
    """One recorded frame of network 0, and where points are drawn in it."""

    def __init__(self, shown, number):
        found = [one for one in shown if one.topic == "/foxglove/net0/image"][number]
        self.image = Image.open(io.BytesIO(base64.b64decode(found.content["data"]))).convert("RGB")
        transforms = {one.time_ns: one.content for one in shown if one.topic == "/foxglove/transforms"}
        self.frames = {part["child_frame_id"]: part for part in transforms[found.time_ns]["transforms"]}
        self.camera = msgspec.convert(self.frames["net0/camera"], FrameTransform)
        (calibration, *_) = [one.content for one in shown if one.topic == "/foxglove/net0/calibration"]
        self.optics = msgspec.convert(calibration, CameraCalibration)
        (scene, *_) = [one.content["entities"] for one in shown if one.topic == "/foxglove/scene"]
        self.scene = {entity["id"]: entity for entity in scene}

    def colour(self, frame, point):
        """Of the pixel that shows a point; (0, 0) of OpenCV is the middle of the first pixel."""
        u, v = drawn(self.optics, self.camera, self._on_pitch(frame, point))
        found = self.image.getpixel((round(u), round(v)))
        return found[0], found[1], found[2]

    def _on_pitch(self, frame, point):
        if frame == "pitch":
            return point
        at, q = self.frames[frame]["translation"], self.frames[frame]["rotation"]
        turn = 2.0 * math.atan2(q["z"], q["w"])
        x, y = point[0], point[1]
        return (
            at["x"] + x * math.cos(turn) - y * math.sin(turn),
            at["y"] + x * math.sin(turn) + y * math.cos(turn),
            point[2],
        )


@pytest.fixture(scope="module")
def frame(shown):
    return Frame(shown, 20)


def places(line):
    """Points along a line; off the ends of its pieces, where others meet them."""
    points = [(at["x"], at["y"], at["z"]) for at in line["points"]]
    if line["type"] != LINE_LIST:
        return points
    shares = (0.15, 0.3, 0.7, 0.85)
    return [
        (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2])
        for a, b in zip(points[::2], points[1::2], strict=True)
        for share in shares
    ]


def test_the_lines_of_the_pitch_lie_on_the_bright_pixels(frame):
    floor = frame.colour("pitch", (0.9, 0.1, 0.0))
    lines = frame.scene["pitch"]["lines"]
    points = [at for line in lines for at in places(line)]
    bright = [sum(frame.colour("pitch", at)) > 1.5 * sum(floor) for at in points]
    assert len(bright) > 80
    assert bright.count(False) <= 4  # a robot or the ball may stand there
    off = [(x + 0.03, y + 0.02, z) for x, y, z in points]
    beside = [sum(frame.colour("pitch", at)) > 1.5 * sum(floor) for at in off]
    assert beside.count(True) < 15


@pytest.mark.parametrize("robot", ["net0/robot0", "net0/robot2", "net1/robot1"])
def test_the_patches_of_a_robot_lie_on_pixels_of_their_colour(frame, robot):
    patches = frame.scene[robot]["cubes"][2:]
    assert len(patches) == 2
    for patch in patches:
        at, paint = patch["pose"]["position"], patch["color"]
        seen = frame.colour(robot, (at["x"], at["y"], at["z"]))
        order = sorted(range(3), key=lambda part: (paint["r"], paint["g"], paint["b"])[part])
        assert seen[order[0]] + 30 < seen[order[2]]
        assert seen[order[0]] <= seen[order[1]] <= seen[order[2]] + 25
