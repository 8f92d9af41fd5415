"""A host's measurement of its robots: an exposure of the world in, measurements out, whole frames late.

    pixels      robots of all networks -> picture -> tracker -> grabber
    geometric   own robots -> patches through the lens, back through the calibration -> grabber
    gaussian    own robots -> white noise (`miro_host.vision`)

Robots of the first network wear yellow, those of the second blue; the slot is the number that the patches show.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Protocol

from miro_exact.bad_input import BadInput
from miro_exact.rng import Stream
from miro_exact.state import TICK
from miro_host.eye import calibration_kinds as kinds
from miro_host.eye.calibration import Calibration
from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.grabber import Grabber, Sightings
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import PATTERNS, ROBOT_HEIGHT_M, TEAMS, PatternName
from miro_host.eye.self_calibration import SelfCalibration
from miro_host.eye.top import Top
from miro_host.eye.track import Sighting
from miro_host.eye.tracker import Tracker
from miro_host.posture import Posture
from miro_host.vision import DEGREE, Vision, VisionErrors
from miro_sim.pitch.camera import Camera
from miro_sim.pitch.colour_samples import colours_of
from miro_sim.scenario import camera_keys as keys
from miro_sim.world.robot import Robot

_FRAMES = ("q", 0, 1 << 24)
WRONG = 3.0
"""A measurement further off than this many times the worst case of the calibration is wrong."""
SLACK_M = 0.0035
"""Worst case of the tracker itself, and what a robot goes while it is exposed."""


class Sight(Protocol):
    """A camera and its processing up to the measurement. `frame`: number of exposures so far."""

    frame: int

    def expose(self, tick: int) -> Sequence[Posture | None]:
        """The camera takes a frame; what reaches the PC now, for each of its robots."""

    def counts(self) -> dict[str, int]:
        """For the summary, by name; empty for a camera that neither loses nor mistakes anything."""

    def reseed(self, seed: int) -> None:
        """The noise of another seed from now on; the calibration stays."""


class GaussianSight:
    """White noise on the posture of each robot."""

    STATE = {"visions": [Vision], "frame": _FRAMES}
    NOT_STATE = ("bodies", "streams")

    def __init__(self, camera: keys.GaussianCamera, bodies: Sequence[Robot], seed: int) -> None:
        errors = VisionErrors(
            camera.position_error_cm / 100.0, camera.heading_error_deg * DEGREE, camera.pixel_cm / 100.0
        )
        self.bodies = list(bodies)
        self.visions = [Vision(errors, camera.delay_frames) for _ in bodies]
        self.streams = [Stream(seed, f"net{body.network}/robot{body.slot}/camera") for body in bodies]
        self.frame = 0

    def __repr__(self) -> str:
        return f"GaussianSight({self.visions!r}, frame={self.frame})"

    def expose(self, tick: int) -> Sequence[Posture | None]:
        measured = []
        for place in range(len(self.visions)):
            vision, noise, body = self.visions[place], self.streams[place], self.bodies[place]
            measured.append(vision.expose(body.drive.pose_at(tick), noise, self.frame))
        self.frame += 1
        return measured

    def counts(self) -> dict[str, int]:
        return {}

    def reseed(self, seed: int) -> None:
        for stream in self.streams:
            stream.reseed(seed)


class SeeingSight:
    """A camera with a lens: what befalls whole frames and whole robots on the way to the PC, by chance.

    Counts for the summary: `lost` robots in frames, `dropped` and `repeated` frames, `wrong` measurements (further off
    than three times the worst case of the calibration) and `swapped` ones (nearer to another robot of the team).
    """

    STATE = {
        "grabber": Grabber,
        "frame": _FRAMES,
        "lost": TICK,
        "dropped": TICK,
        "repeated": TICK,
        "wrong": TICK,
        "swapped": TICK,
    }
    NOT_STATE: tuple[str, ...] = ("camera", "bodies", "chances", "worst_m")

    def __init__(self, camera: keys.SeeingCamera, bodies: Sequence[Robot], seed: int, worst_m: float) -> None:
        self.camera = camera
        self.bodies = list(bodies)
        self.grabber = Grabber(len(bodies), camera.delay_frames)
        self.chances = Stream(seed, f"net{bodies[0].network}/grabber")
        self.worst_m = worst_m + SLACK_M
        self.frame = 0
        self.lost = self.dropped = self.repeated = self.wrong = self.swapped = 0

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.grabber!r}, frame={self.frame}, lost={self.lost})"

    def counts(self) -> dict[str, int]:
        names = ("lost", "dropped", "repeated", "wrong", "swapped")
        return {"frames": self.frame, **{name: getattr(self, name) for name in names}}

    def reseed(self, seed: int) -> None:
        self.chances.reseed(seed)

    def look(self, tick: int) -> list[Sighting | None]:
        """The tracker's result for the frame exposed at `tick`."""
        raise NotImplementedError

    def expose(self, tick: int) -> Sequence[Posture | None]:
        robots = len(self.bodies)
        first = self.frame * (robots + 2)
        camera, chance = self.camera, self.chances
        if camera.dropped_frames > 0.0 and chance.uniform(first) < camera.dropped_frames:
            self.dropped += 1
            sightings: Sightings | None = (None,) * robots
        elif camera.repeated_frames > 0.0 and chance.uniform(first + 1) < camera.repeated_frames:
            self.repeated += 1
            sightings = None
        else:
            tracked, share = self.look(tick), camera.lost_robots
            if share > 0.0:
                tracked = [
                    None if chance.uniform(first + 2 + robot) < share else tracked[robot]
                    for robot in range(robots)
                ]
            sightings = tuple(tracked)
            self._count(tick, sightings)
        self.frame += 1
        return self.grabber.take(sightings)

    def _count(self, tick: int, seen: Sightings) -> None:
        """Compares measurements with the true postures, which the PC cannot know."""
        for own in range(len(seen)):
            sighting = seen[own]
            if sighting is None:
                self.lost += 1
                continue
            x_m, y_m = sighting.x_m, sighting.y_m
            way_m = self._distance_m(own, tick, x_m, y_m)
            if way_m > WRONG * self.worst_m:
                self.wrong += 1
            for other in range(len(seen)):
                if other != own and self._distance_m(other, tick, x_m, y_m) < way_m:
                    self.swapped += 1
                    break

    def _distance_m(self, own: int, tick: int, x_m: float, y_m: float) -> float:
        """From where a robot is to a place."""
        body = self.bodies[own]
        true_x_m, true_y_m, _ = body.drive.pose_at(tick)
        dx, dy = true_x_m - x_m, true_y_m - y_m
        return math.sqrt(dx * dx + dy * dy)


class StaticField:
    """The error of a calibration alone: postures are read from patches that are measured without error.

    It depends on the posture and nothing else.
    """

    NOT_STATE = ("*",)

    def __init__(self, true: CameraParameters, calibration: Calibration, pattern: PatternName) -> None:
        self.lens = Lens(true)
        self.top = Top(pattern, calibration)

    def __repr__(self) -> str:
        return f"StaticField({self.lens!r}, {self.top!r})"

    def read(self, true: Posture) -> Posture:
        """The posture as it is read. Raises ValueError for one whose patches are outside the picture."""
        team_x, team_y, identity_x, identity_y = self.top.places(true.x_m, true.y_m, true.theta_rad)
        pixels = (*self._drawn(team_x, team_y), *self._drawn(identity_x, identity_y))
        return Posture(*self.top.posture(*pixels))

    def _drawn(self, x_m: float, y_m: float) -> tuple[float, float]:
        u, v = self.lens.pixel(x_m, y_m, ROBOT_HEIGHT_M)
        if not (0.0 <= u <= WIDTH and 0.0 <= v <= HEIGHT):
            raise ValueError(f"({x_m:.3f}, {y_m:.3f}) m is outside the picture")
        return u, v


class GeometricSight(SeeingSight):
    """The true patches, drawn by the lens, read through the calibration."""

    NOT_STATE = ("field",)

    def __init__(self, camera: keys.GeometricCamera, bodies: Sequence[Robot], seed: int) -> None:
        calibration, worst_m = calibration_for(camera, bodies[0].network, seed)
        super().__init__(camera, bodies, seed, worst_m)
        self.field = StaticField(camera.lens, calibration, camera.pattern)

    def look(self, tick: int) -> list[Sighting | None]:
        return [self._see(body, tick) for body in self.bodies]

    def _see(self, body: Robot, tick: int) -> Sighting | None:
        try:
            read = self.field.read(Posture(*body.drive.pose_at(tick)))
        except ValueError:  # it has left the view
            return None
        return Sighting(read.x_m, read.y_m, read.theta_rad, tick, 1.0)


class PixelSight(SeeingSight):
    """The picture of all robots, and the tracker of this host's. `everyone`: bodies of all networks.

    `watch`, if there is one, is called with frame number and tick after each exposure; it may read the picture and what
    the tracker noted, and changes no bit of a run.
    """

    STATE = {"tracker": Tracker}
    NOT_STATE = ("eye", "everyone", "watch")

    def __init__(self, camera: keys.PixelCamera, bodies: Sequence[Robot], seed: int) -> None:
        network = bodies[0].network
        calibration, worst_m = calibration_for(camera, network, seed)
        super().__init__(camera, bodies, seed, worst_m)
        self.everyone = list(bodies)
        self.watch: Callable[[int, int], None] | None = None
        self.eye = Camera(
            camera.lens, camera.picture, PATTERNS[camera.pattern], Stream(seed, f"net{network}/pixels")
        )
        if camera.ball is not None:
            self.eye.ball(camera.ball.x_cm / 100.0, camera.ball.y_cm / 100.0)
        self.tracker = Tracker(
            TEAMS[network],
            [body.slot for body in bodies],
            camera.pattern,
            SelfCalibration(calibration) if camera.self_calibration == "lines" else calibration,
            colours_of(camera.lens, camera.picture, camera.pattern, camera.ball is not None),
            camera.centroid,
            camera.window_px,
        )

    def expose(self, tick: int) -> Sequence[Posture | None]:
        arrived = SeeingSight.expose(self, tick)
        if self.watch is not None:
            self.watch(self.frame - 1, tick)
        return arrived

    def reseed(self, seed: int) -> None:
        SeeingSight.reseed(self, seed)
        self.eye.sensor.stream.reseed(seed)

    def look(self, tick: int) -> list[Sighting | None]:
        return self.tracker.track(self.picture_at(self.frame, tick), tick)

    def picture_at(self, frame: int, tick: int) -> Camera:
        """The picture of the world as it stands at `tick`, with the noise of this frame number."""
        eye = self.eye
        eye.clear_robots()
        for body in self.everyone:
            x_m, y_m, theta_rad = body.drive.pose_at(tick)
            v_m_s, w_rad_s = body.drive.velocity_at(tick)
            eye.robot(body.network, body.slot, x_m, y_m, theta_rad, v_m_s, w_rad_s)
        eye.begin(frame, tick)
        return eye


@lru_cache(maxsize=16)
def calibration_for(camera: keys.SeeingCamera, network: int, seed: int) -> tuple[Calibration, float]:
    """A host's calibration of its camera, and its worst error over the pitch, in m.

    Finding the errors of 1997 takes longer than the rest of a world: a seed's calibration is cached.
    """
    try:
        calibration = _calibration(camera, network, seed)
        return calibration, kinds.worst_error_m(camera.lens, calibration)
    except ValueError as error:
        reason = f"no calibration of this camera can be so wrong: {error}"
        raise BadInput("", "camera.calibration_errors", reason, "make the errors smaller") from None


def _calibration(camera: keys.SeeingCamera, network: int, seed: int) -> Calibration:
    errors = camera.calibration_errors
    if str(camera.calibration) == "1997":
        calibration = kinds.drawn_1997(
            camera.lens,
            Stream(seed, f"net{network}/calibration"),
            errors.centre_px,
            errors.focal_share,
            errors.tilt_deg * DEGREE,
            errors.worst_cm / 100.0,
        )
    else:
        calibration = kinds.none(camera.lens) if camera.calibration == "none" else kinds.exact(camera.lens)
    ignored = kinds.CalibrationErrors(
        ignore_height=errors.ignore_height or calibration.ignore_height,
        ignore_distortion=errors.ignore_distortion,
    )
    return kinds.wrong(calibration.camera, ignored)


def sight_of(camera: keys.Camera, bodies: Sequence[Robot], seed: int) -> Sight:
    """The camera of one host."""
    if isinstance(camera, keys.PixelCamera):
        return PixelSight(camera, bodies, seed)
    if isinstance(camera, keys.GeometricCamera):
        return GeometricSight(camera, bodies, seed)
    return GaussianSight(camera, bodies, seed)
