"""The scene lies on the picture: what is drawn in 3D falls on the pixels that show it."""

import base64
import io
import math

import msgspec
import pytest
from PIL import Image

from mirotwin.report.foxglove.messages import LINE_LIST, CameraCalibration, FrameTransform
from tests.mirotwin.report.foxglove.test_optics import drawn


class Frame:
    """One recorded frame of network 0, and where points are drawn in it."""

    def __init__(self, shown, number):
        found = [one for one in shown if one.topic == "/foxglove/net0/image"][number]
        self.image = Image.open(io.BytesIO(base64.b64decode(found.content["data"]))).convert("RGB")
        transforms = next(
            one.content["transforms"]
            for one in shown
            if one.topic == "/foxglove/transforms" and one.time_ns == found.time_ns
        )
        self.frames = {part["child_frame_id"]: part for part in transforms}
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
    bright = [sum(frame.colour("pitch", at)) > 1.5 * sum(floor) for line in lines for at in places(line)]
    assert len(bright) > 80
    assert bright.count(False) <= 4  # a robot or the ball may stand there
    beside = [
        sum(frame.colour("pitch", (at[0] + 0.03, at[1] + 0.02, at[2]))) > 1.5 * sum(floor)
        for line in lines
        for at in places(line)
    ]
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
