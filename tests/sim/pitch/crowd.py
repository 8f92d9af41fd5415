"""Six robots of two teams and both trackers: `python -m tests.sim.pitch.crowd --frames 100000`.

A robot drives at up to 1.46 m/s, gains and loses 6 m/s2 and turns at up to 8 rad/s. It likes to be near another one, so
that two are often in one window; where it would touch, or leave the pitch, it stops at once and thinks again.
"""

import argparse
import math
import random
import sys
import time
from dataclasses import dataclass, field
from itertools import combinations

from msgspec.structs import astuple

from miro_exact.clock import CAMERA_FRAME_TICKS
from miro_exact.rng import Stream
from miro_host.estimators.predict import moved
from miro_host.eye import calibration_kinds
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.patterns import PATTERNS, TEAMS
from miro_host.eye.tracker import Tracker
from miro_host.posture import Posture
from miro_sim.pitch import ground
from miro_sim.pitch.camera import Camera
from miro_sim.pitch.colour_samples import colours_of
from miro_sim.pitch.contact import touch
from miro_sim.pitch.picture_settings import PictureSettings

PERIOD_S = 1001.0 / 30000.0
MOST_M_S, MOST_RAD_S, SLOPE_M_S2 = 1.46, 8.0, 6.0
GAP_M = 0.004
"""Robots stay at least so far from touching."""
WRONG_M = 3 * 0.0018
WRONG_RAD = 3 * math.radians(3.5)
TOGETHER_M = 0.13


@dataclass
class Driver:
    """One robot, where it is and what it wants."""

    team: int
    number: int
    at: Posture
    v_m_s: float = 0.0
    w_rad_s: float = 0.0
    wants: tuple[float, float] = (0.0, 0.0)
    frames: int = 0


@dataclass
class Counts:
    """What came out, over all robots and frames."""

    frames: int = 0
    seen: int = 0
    lost: int = 0
    wrong: int = 0
    swapped: int = 0
    together: int = 0
    stops: int = 0
    fastest_m_s: float = 0.0
    worst_m: float = 0.0
    worst_rad: float = 0.0
    wrong_at: list[str] = field(default_factory=list)


class Crowd:
    """The robots, the camera and both trackers."""

    def __init__(self, seed, picture, centroid="binary"):
        self.draw = random.Random(seed)
        lens = CameraParameters()
        self.camera = Camera(lens, picture, PATTERNS["diagonal"], Stream(seed, "crowd"))
        colours = colours_of(lens, picture, "diagonal")
        calibration = calibration_kinds.exact(lens)
        numbers = [self.draw.sample(range(5), 3) for _ in TEAMS]
        self.trackers = [
            Tracker(team, numbers[index], "diagonal", calibration, colours, centroid)
            for index, team in enumerate(TEAMS)
        ]
        self.drivers = [
            Driver(team, numbers[team][slot], Posture(0.1 + 0.4 * slot, 0.1 + 0.5 * team, 0.0))
            for team in range(2)
            for slot in range(3)
        ]
        self.counts = Counts()

    def step(self, frame, dropped=False):
        """One camera period: everybody drives on, then both teams look, unless the frame is dropped."""
        for driver in self.drivers:
            self._drive(driver)
        if dropped:
            return
        self.camera.clear_robots()
        for driver in self.drivers:
            at = driver.at
            self.camera.robot(
                driver.team, driver.number, at.x_m, at.y_m, at.theta_rad, driver.v_m_s, driver.w_rad_s
            )
        tick = frame * CAMERA_FRAME_TICKS
        self.camera.begin(frame, tick)
        for team, tracker in enumerate(self.trackers):
            own = [driver for driver in self.drivers if driver.team == team]
            for index, sighting in enumerate(tracker.track(self.camera, tick)):
                self._judge(own, index, sighting, frame)
        self.counts.frames += 1
        pairs = combinations(self.drivers, 2)
        self.counts.together += any(_distance(a.at, b.at) < TOGETHER_M for a, b in pairs)

    def _drive(self, driver):
        driver.frames -= 1
        if driver.frames <= 0:
            self._think(driver)
        v, w = driver.wants
        most = SLOPE_M_S2 * PERIOD_S
        v = min(max(v, driver.v_m_s - most), driver.v_m_s + most)
        after = moved(driver.at, v * PERIOD_S, w * PERIOD_S)
        if not self._free(driver, after):
            self.counts.stops += v != 0.0
            v, w, after = 0.0, 0.0, driver.at
            driver.frames = 0
        driver.at, driver.v_m_s, driver.w_rad_s = after, v, w
        self.counts.fastest_m_s = max(self.counts.fastest_m_s, abs(v))

    def _think(self, driver):
        """Towards another robot, or anywhere."""
        draw = self.draw
        driver.frames = draw.randint(3, 25)
        other = draw.choice(self.drivers)
        turn = math.remainder(
            math.atan2(other.at.y_m - driver.at.y_m, other.at.x_m - driver.at.x_m) - driver.at.theta_rad,
            2 * math.pi,
        )
        if draw.random() < 0.5 and other is not driver:
            driver.wants = (draw.uniform(0.1, MOST_M_S), min(max(3.0 * turn, -MOST_RAD_S), MOST_RAD_S))
        else:
            driver.wants = (draw.uniform(-MOST_M_S, MOST_M_S), draw.uniform(-MOST_RAD_S, MOST_RAD_S))

    def _free(self, driver, at):
        if not ground.holds(at):
            return False
        for other in self.drivers:
            if other is not driver and _distance(at, other.at) < 0.12:
                way = _distance(at, other.at)
                share = (way - GAP_M) / way
                nearer = (
                    at.x_m + (other.at.x_m - at.x_m) * share,
                    at.y_m + (other.at.y_m - at.y_m) * share,
                    other.at.theta_rad,
                )
                if touch(astuple(at), nearer):
                    return False
        return True

    def _judge(self, own, index, sighting, frame):
        counts, true = self.counts, own[index].at
        if sighting is None:
            counts.lost += 1
            return
        counts.seen += 1
        ways = [_distance(driver.at, sighting) for driver in own]
        turn = abs(math.remainder(sighting.theta_rad - true.theta_rad, 2 * math.pi))
        counts.worst_m, counts.worst_rad = max(counts.worst_m, ways[index]), max(counts.worst_rad, turn)
        counts.swapped += min(ways) < ways[index]
        if ways[index] > WRONG_M or turn > WRONG_RAD:
            counts.wrong += 1
            counts.wrong_at.append(f"frame {frame}: {true} seen as {sighting}")


def _distance(one, other):
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


def main():
    parser = argparse.ArgumentParser(description="Six robots, two trackers.")
    parser.add_argument("--frames", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dropped", type=float, default=0.0, help="share of frames that are dropped")
    parser.add_argument("--mains-hz", type=int, choices=(50, 60), default=60, help="50: the lamps flicker")
    parser.add_argument("--centroid", choices=("binary", "weighted"), default="binary")
    args = parser.parse_args()
    crowd = Crowd(args.seed, PictureSettings(mains_hz=args.mains_hz), args.centroid)
    drops = random.Random(args.seed + 1)
    began = time.process_time()
    for frame in range(1, args.frames + 1):
        crowd.step(frame, drops.random() < args.dropped)
        if frame % 1000 == 0:
            print(f"\r{frame} frames", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    counts = crowd.counts
    print(
        f"{counts.frames} frames, {counts.seen} sightings: {counts.swapped} swapped, {counts.wrong} wrong,"
        f" {counts.lost} lost; worst {100 * counts.worst_m:.2f} cm, {math.degrees(counts.worst_rad):.1f} degrees"
    )
    print(
        f"two within {100 * TOGETHER_M:.0f} cm in {counts.together} frames; up to {counts.fastest_m_s:.2f} m/s,"
        f" {counts.stops} sudden stops; {sum(tracker.searches for tracker in crowd.trackers)} searches;"
        f" {counts.frames / (time.process_time() - began):.0f} frames/s"
    )
    for line in counts.wrong_at[:5]:
        print(line)
    sys.exit(bool(counts.wrong or counts.swapped))


if __name__ == "__main__":
    main()
