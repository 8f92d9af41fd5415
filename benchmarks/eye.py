"""What seeing costs: a window, tracking in it, a frame of six robots, learning the camera, and the share of a run.

    python -m benchmarks.eye [--pairs 21]

Processor times, not wall times. A window is 32 x 32 pixels around a moving robot, with three instants of exposure, its
sides, the ball beside it, television signal and noise. A frame is what one host does with six robots of its own and the
other team: it looks at each of its robots once. Runs of fig6 with pixels and with the gaussian camera alternate; given
are the median and the quartiles of their ratio.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from itertools import count
from statistics import median, quantiles

from miro_exact.rng import Stream
from miro_host.eye import calibration_kinds
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import PATTERNS, TEAMS
from miro_host.eye.self_calibration import SETTLED_FRAMES, SelfCalibration
from miro_host.eye.tracker import Tracker
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.pitch.camera import Camera
from miro_sim.pitch.colour_samples import colours_of
from miro_sim.pitch.picture_settings import PictureSettings
from miro_sim.scenario import file
from miro_sim.world.world import World

LENS, PICTURE = CameraParameters(), PictureSettings()
REPEATS, TIMES = 15, 200


def best_us(work: Callable[[int], object]) -> float:
    """The best of several rounds, for one call, in us: the rest of the machine only adds to it."""
    best = float("inf")
    for _ in range(REPEATS):
        begun = time.process_time()
        for index in range(TIMES):
            work(index)
        best = min(best, time.process_time() - begun)
    return 1e6 * best / TIMES


def camera() -> Camera:
    return Camera(LENS, PICTURE, PATTERNS["diagonal"], Stream(1, "eye"))


def window_us() -> float:
    """One window, as the tracker asks for it."""
    one = camera()
    one.ball(0.3, 0.5)
    u, v = Lens(LENS).pixel(0.35, 0.45, 0.075)

    def work(frame: int) -> None:
        one.clear_robots()
        one.robot(0, 0, 0.35, 0.45, 0.7, 0.8, 3.0)
        one.begin(frame, 800_800 * frame)
        one.window(int(u) - 16, int(v) - 16, 32, 32)

    return best_us(work)


class Kept:
    """A frame whose windows are known already: what is left is the tracker's time."""

    width, height = 320, 240

    def __init__(self, one: Camera) -> None:
        self.camera = one
        self.windows: dict[tuple[int, int, int, int], bytearray] = {}

    def window(self, left: int, top: int, width: int, height: int) -> bytearray:
        place = (left, top, width, height)
        if place not in self.windows:
            self.windows[place] = self.camera.window(*place)
        return self.windows[place]


def tracking_us() -> float:
    """One robot, its window known."""
    one = camera()
    one.robot(0, 0, 0.35, 0.45, 0.7)
    one.begin(0, 0)
    frame = Kept(one)
    tracker = Tracker(
        TEAMS[0],
        [0],
        "diagonal",
        calibration_kinds.exact(LENS),
        colours_of(LENS, PICTURE, "diagonal"),
        "binary",
    )
    tracker.track(frame, 0)
    return best_us(lambda index: tracker.track(frame, index + 1))


def frame_us() -> float:
    """Six robots, three a team: both teams' windows of one frame, and tracking in them."""
    one = camera()
    one.ball(0.55, 0.4)
    colours, exact = colours_of(LENS, PICTURE, "diagonal"), calibration_kinds.exact(LENS)
    trackers = [Tracker(team, [0, 1, 2], "diagonal", exact, colours, "binary") for team in TEAMS]

    frames = count()

    def work(_: int) -> None:
        frame = next(frames)
        one.clear_robots()
        for team in range(2):
            for slot in range(3):  # round a circle of 10 cm, at 1 m/s
                sine, cosine = math.sin(frame / 3.0), math.cos(frame / 3.0)
                x_m, y_m = 0.1 + 0.4 * slot + 0.1 * sine, 0.1 + 0.5 * team - 0.1 * cosine
                one.robot(team, slot, x_m, y_m, frame / 3.0, 1.0, 10.0)
        one.begin(frame, 800_800 * frame)
        for tracker in trackers:
            assert None not in tracker.track(one, 800_800 * frame)

    return best_us(work)


def learning_us() -> tuple[float, float]:
    """Self-calibration from lines and walls: the mean of a frame in its first five seconds, and later."""
    one = camera()
    told = calibration_kinds.drawn_1997(LENS, Stream(0, "benchmark/told"))
    learning = SelfCalibration(told)
    took = []
    for frame in range(600):
        one.begin(frame, 800_800 * frame)
        begun = time.process_time_ns()
        learning.look(one, ())
        took.append(time.process_time_ns() - begun)
    first, later = took[:SETTLED_FRAMES], took[SETTLED_FRAMES:]
    return sum(first) / len(first) / 1000.0, sum(later) / len(later) / 1000.0


def run_s(kind: str, seed: int) -> float:
    """The loop of fig6."""
    world = World(file.load("fig6", [f'camera={{kind="{kind}"}}']).scenario, seed, IMAGE)
    begun = time.process_time()
    while not world.finished:
        world.step()
    return time.process_time() - begun


IMAGE = load_hex(image_path())


def main() -> None:
    parser = argparse.ArgumentParser(description="What seeing costs.")
    parser.add_argument("--pairs", type=int, default=21, help="runs of each kind (default 21)")
    pairs = parser.parse_args().pairs
    print(f"window of one moving robot  {window_us():7.1f} us")
    print(f"tracking in it              {tracking_us():7.1f} us")
    six = frame_us()
    print(f"frame of six robots         {six:7.1f} us, {1e6 / six:.0f} frames/s")
    first, later = learning_us()
    print(
        f"self-calibration, a frame   {first:7.1f} us in its first {SETTLED_FRAMES} frames, {later:.1f} us later"
    )
    ratios = []
    for seed in range(pairs):
        kinds = ("pixels", "gaussian") if seed % 2 else ("gaussian", "pixels")
        took = {kind: run_s(kind, seed) for kind in kinds}
        ratios.append(took["pixels"] / took["gaussian"])
    low, _, high = quantiles(ratios, n=4)
    print(f"fig6, pixels to gaussian    {median(ratios):7.2f} [{low:.2f}..{high:.2f}] of {pairs} pairs")


if __name__ == "__main__":
    main()
