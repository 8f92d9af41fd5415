"""What the eye gets wrong: errors of position and heading over the pitch and all headings, cause by cause.

    python -m benchmarks.vision [--count 30000] [--seed 0] [--only NAME,..] [--maps DIR]

Each case renders a robot at random postures (all over the pitch, any heading), lets the tracker find it, and compares.
`still` robots stand; `moving` ones go at up to 1 m/s and turn at up to 4 rad/s, and are compared with the middle of the
exposure. The table is that of benchmarks/vision.csv: rms, 99.9 % and maximum. The tracker's own cases have an exact
calibration and all noise; cases of a wrong calibration say what the field of that calibration adds. `--maps` writes a
picture of each case: error over the pitch, in cells of 5 cm.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from msgspec.structs import replace

from miro_exact.rng import Stream
from miro_host.eye.patterns import PATTERNS
from miro_host.eye.track import Sighting
from miro_host.eye.tracker import Tracker
from miro_host.posture import Posture
from miro_sim.pitch import ground
from miro_sim.pitch.camera import Camera
from miro_sim.pitch.colour_samples import colours_of
from miro_sim.pitch.picture_settings import PictureSettings
from miro_sim.scenario.camera_keys import CalibrationErrorSizes, PixelCamera
from miro_sim.world.sight import StaticField, calibration_for

QUIET = PictureSettings(
    light_falloff=0.0, flicker=0.0, chroma_bandwidth_hz=0.0, luma_noise=0.0, chroma_noise=0.0
)
"""Nothing but pixels."""
FULL = PictureSettings()
EXACT = PixelCamera(calibration="exact", picture=FULL)


class Case(NamedTuple):
    """What is measured: a camera, and whether robots move."""

    camera: PixelCamera
    moving: bool = False
    calibration_seed: int = 0


def _exact(**changed: Any) -> PixelCamera:
    return replace(EXACT, **changed)


def _picture(base: PictureSettings = FULL, **changed: Any) -> PixelCamera:
    return replace(EXACT, picture=replace(base, **changed))


def cases() -> dict[str, Case]:
    """All cases by name."""
    wrong = CalibrationErrorSizes()
    found = {
        "pixels alone": Case(_picture(QUIET)),
        "binary": Case(EXACT),
        "weighted": Case(_exact(centroid="weighted")),
        "strip binary": Case(_exact(pattern="strip")),
        "strip weighted": Case(_exact(pattern="strip", centroid="weighted")),
        "blur": Case(EXACT, moving=True),
        "blur weighted": Case(_exact(centroid="weighted"), moving=True),
        "interlace": Case(_picture(fields=2), moving=True),
        "noise": Case(_picture(QUIET, luma_noise=2.0, chroma_noise=4.0)),
        "chroma bandwidth": Case(_picture(QUIET, chroma_bandwidth_hz=0.6e6)),
        "light falloff": Case(_picture(QUIET, light_falloff=0.6)),
        "flicker (50 Hz)": Case(_picture(QUIET, flicker=0.3, mains_hz=50)),
        "quantisation (5 bits)": Case(_picture(QUIET, bits=5)),
        "line jitter": Case(_picture(QUIET, line_jitter_px=0.5)),
        "height ignored": Case(_exact(calibration_errors=replace(wrong, ignore_height=True))),
        "distortion ignored": Case(_exact(calibration_errors=replace(wrong, ignore_distortion=True))),
        "no calibration": Case(_exact(calibration="none")),
    }
    for seed in range(5):
        found[f"1997, seed {seed}"] = Case(_exact(calibration="1997"), calibration_seed=seed)
    return found


class Errors(NamedTuple):
    """One row a posture: where it was, and how far off the measurement is, in cm and degrees. `lost`: not found."""

    x_cm: Any
    y_cm: Any
    position_cm: Any
    heading_deg: Any
    lost: int


def measure(case: Case, count: int, seed: int) -> Errors:
    """Errors at `count` random postures."""
    rows, lost = [], 0
    camera = case.camera
    eye = Camera(camera.lens, camera.picture, PATTERNS[camera.pattern], Stream(seed, "vision"))
    calibration, _ = calibration_for(camera, 0, case.calibration_seed)
    classes = colours_of(camera.lens, camera.picture, camera.pattern)
    field = StaticField(camera.lens, calibration, camera.pattern)
    tracker = Tracker("yellow", [0], camera.pattern, calibration, classes, camera.centroid, camera.window_px)
    for number, (x_m, y_m, theta, v, w) in enumerate(postures(count, seed, case.moving)):
        eye.clear_robots()
        eye.robot(0, 0, x_m, y_m, theta, v, w)
        tick = 800_800 * (number + 1)
        eye.begin(number, tick)
        tracker.tracks[0].seen = 0
        near = field.read(Posture(x_m, y_m, theta))
        tracker.tracks[0].remember(Sighting(near.x_m, near.y_m, near.theta_rad, tick, 1.0))
        seen = tracker.track(eye, tick)[0]
        if seen is None:
            lost += 1
            continue
        dx, dy = seen.x_m - x_m, seen.y_m - y_m
        turn = math.remainder(seen.theta_rad - theta, 2.0 * math.pi)
        rows.append((100 * x_m, 100 * y_m, 100 * math.hypot(dx, dy), math.degrees(turn)))
    table = np.array(rows)
    return Errors(table[:, 0], table[:, 1], table[:, 2], table[:, 3], lost)


def postures(count: int, seed: int, moving: bool) -> Iterator[tuple[float, float, float, float, float]]:
    """x, y, heading, speed, rate of turn; all squares lie on the pitch."""
    draws = Stream(seed, "postures")
    for number in range(count):
        u = [draws.uniform(5 * number + part) for part in range(5)]
        theta = (2.0 * u[2] - 1.0) * math.pi
        reach = ground.reach_m(theta)
        x_m = ground.LEFT_M + reach + u[0] * (ground.LENGTH_M - 2.0 * reach)
        y_m = ground.BOTTOM_M + reach + u[1] * (ground.WIDTH_M - 2.0 * reach)
        v, w = (2.0 * u[3] - 1.0, 4.0 * (2.0 * u[4] - 1.0)) if moving else (0.0, 0.0)
        yield x_m, y_m, theta, v, w


COLUMNS = (
    "case",
    *(f"{what}_{of}_{unit}" for what, unit in (("position", "cm"), ("heading", "deg")) for of in ("rms", "999", "max")),
    "found",
    "lost",
)  # fmt: skip
"""Of the table; `999`: 99.9 % of the postures have a smaller error."""


def row(name: str, errors: Errors) -> list[str]:
    """A row of the table."""
    cells = [name]
    for values in (errors.position_cm, np.abs(errors.heading_deg)):
        rms, most = math.sqrt(float(np.mean(values**2))), float(np.quantile(values, 0.999))
        cells += [f"{value:.3f}" for value in (rms, most, float(values.max()))]
    return [*cells, f"{len(errors.position_cm)}", f"{errors.lost}"]


def save_map(name: str, errors: Errors, folder: Path) -> Path:
    """Mean error of position and largest of heading in cells of 5 cm, as a picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 3.6), layout="constrained")
    heading = np.abs(errors.heading_deg)
    for axis, values, reduce, label in (
        (axes[0], errors.position_cm, np.mean, "mean position error, cm"),
        (axes[1], heading, np.max, "largest heading error, degrees"),
    ):
        drawn = axis.hexbin(errors.x_cm, errors.y_cm, values, gridsize=(26, 10), reduce_C_function=reduce)
        axis.set_aspect("equal")
        axis.set_xlabel("x, cm")
        axis.set_ylabel("y, cm")
        figure.colorbar(drawn, ax=axis, label=label)
    figure.suptitle(name)
    path = folder / f"vision-{name.replace(' ', '-').replace(',', '').replace('(', '').replace(')', '')}.png"
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description="Errors of the eye, cause by cause.")
    parser.add_argument("--count", type=int, default=30_000, help="postures a case (default 30000)")
    parser.add_argument("--seed", type=int, default=0, help="of postures and noise")
    parser.add_argument("--only", default="", help="cases, separated by commas")
    parser.add_argument("--maps", type=Path, help="folder for a picture of each case")
    args = parser.parse_args()
    wanted = [name.strip() for name in args.only.split(",") if name.strip()]
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(COLUMNS)
    for name, case in cases().items():
        if wanted and not any(name.startswith(part) for part in wanted):
            continue
        errors = measure(case, args.count, args.seed)
        writer.writerow(row(name, errors))
        sys.stdout.flush()
        if args.maps is not None:
            args.maps.mkdir(parents=True, exist_ok=True)
            print(f"  {save_map(name, errors, args.maps)}", file=sys.stderr)


if __name__ == "__main__":
    main()
