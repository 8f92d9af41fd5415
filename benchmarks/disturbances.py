"""Each disturbance alone, on three controllers: `python -m benchmarks.disturbances`.

Prints a CSV table, that of benchmarks/disturbances.csv: position error (truth against reference, root mean square over
the last second) as the median over the seeds, and in how many runs the robot was outside 3 cm or 0.15 rad in the last
second.
The base is the variant `ideal` with a little white noise on the posture, so that seeds differ: 0.3 cm and 0.6 degrees
at three standard deviations. Estimators are told the delay of the camera and nothing else.

Ctrl-C stops it after the cells that are under way, and prints the rows that are complete. A table takes minutes;
`--only slip --seeds 0-4` is a part.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Iterable, Iterator
from statistics import median
from typing import NamedTuple

from benchmarks.figures import Figure, figure_of, range_of_seeds
from mirotwin.campaign.design import Level
from mirotwin.campaign.drive import outcomes_of
from mirotwin.campaign.plan import plan_of_levels
from mirotwin.campaign.workers import Processes
from mirotwin.shell.processes import cores

FIGURES = ("fig6", "fig8")
FRAME_S = 1001 / 30000
SMALL_NOISE = ("camera.position_error_cm=0.3", "camera.heading_error_deg=0.6")
BODY_FRAME = 'network.robot.controller={law="body_frame"}'
CONTROLLERS = {
    "paper": (),
    "body_frame, predict": (BODY_FRAME, 'network.robot.estimator={kind="predict", age_s=AGE}'),
    "body_frame, ekf": (
        BODY_FRAME,
        'network.robot.estimator={kind="ekf", age_s=AGE, position_noise_m=0.001, heading_noise_rad=0.0035}',
    ),
}
"""Settings of each, AGE being the delay of the camera in s; the first is the paper's law with the scenario's gains."""


class Case(NamedTuple):
    """One disturbance: its group, its name in the table, settings, and the frames of delay that estimators are told."""

    group: str
    name: str
    settings: tuple[str, ...]
    delay_frames: int = 0


def _drive(group: str, name: str, *keys: str) -> Case:
    return Case(group, name, tuple(f"network.robot.drive.{key}" for key in keys))


def _radio(group: str, name: str, *keys: str) -> Case:
    return Case(group, name, tuple(f"network.radio.{key}" for key in keys))


def _delay(frames: int) -> Case:
    return Case(
        "delay",
        f"camera: {frames} frame{'s'[: frames > 1]} of delay",
        (f"camera.delay_frames={frames}",),
        frames,
    )


def _noise(position_cm: float, heading_deg: float) -> Case:
    keys = (f"camera.position_error_cm={position_cm}", f"camera.heading_error_deg={heading_deg}")
    return Case("vision", f"white noise of up to {position_cm:g} cm, {heading_deg:g} degrees", keys)


def _field(calibration: str) -> Case:
    camera = f'camera={{kind="geometric", calibration="{calibration}", delay_frames=0}}'
    return Case("vision", f"calibration `{calibration}`, no noise", (camera,))


CASES = (
    Case("base", "none", ()),
    Case("integration", "equation (15) by `adams_bashforth`", ("host.integration=adams_bashforth",)),
    Case("word", "words of 10 bits (5.6 mm/s)", ("host.word_bits=10",)),
    Case("word", "words of 8 bits (22 mm/s)", ("host.word_bits=8",)),
    Case("control", "control noise 5 cm/s, 0.25 rad/s", ("network.control_noise={v_m_s=0.05, w_rad_s=0.25}",)),
    Case("control", "control noise 20 cm/s, 1 rad/s", ("network.control_noise={v_m_s=0.2, w_rad_s=1.0}",)),
    _noise(0.8, 1.6),
    _noise(2.4, 4.83),
    _field("1997"),
    _field("none"),
    _delay(1),
    _delay(2),
    Case("delay", "30 ms of computing", ("host.compute_s=0.03", "network.radio.keyup_s=0.0")),
    _radio("delay", "30 ms of radio latency", "latency_s=0.03"),
    _radio("loss", "10 % of frames lost", "lost_frames=0.1"),
    _radio("loss", "40 % of frames lost", "lost_frames=0.4"),
    _radio("loss", "bit errors 1e-3", "bit_error_rate=1e-3"),
    _radio("loss", "fading with 10 dB of margin", "profile=fade10", "squelch=true"),
    _drive("wheels", "left wheel 1 % larger", "chassis.left_radius_factor=1.01"),
    _drive("wheels", "left wheel 3 % larger", "chassis.left_radius_factor=1.03"),
    _drive("slip", "grip 0.5", "tyre.grip=0.5"),
    _drive("slip", "grip 0.1", "tyre.grip=0.1"),
    _drive("ball", "ball, friction 0.3", "ball.friction=0.3"),
    _drive("ball", "ball, friction 1", "ball.friction=1"),
    _drive("stiction", "static friction twice sliding", "chassis.stiction_ratio=2"),
    _drive("stiction", "static friction five times sliding", "chassis.stiction_ratio=5"),
    _drive("force", "0.3 N, 10 mNm constant", "disturbance={force_n=0.3, torque_nm=0.01}"),
    _drive("force", "sine of 0.5 N, 20 mNm, 0.5 s", "disturbance={sine_force_n=0.5,sine_torque_nm=0.02,period_s=0.5}"),
    _drive("force", "noise of 1 N, 40 mNm, 0.1 s", "disturbance={noise_force_n=1, noise_torque_nm=0.04, period_s=0.1}"),
    _drive("mass", "20 % more mass and inertia", "chassis.mass_kg=0.6", "chassis.yaw_inertia_kg_m2=5.64e-4"),
    _drive("mass", "20 % less mass and inertia", "chassis.mass_kg=0.4", "chassis.yaw_inertia_kg_m2=3.76e-4"),
    _drive("mass", "three times the mass and inertia", "chassis.mass_kg=1.5", "chassis.yaw_inertia_kg_m2=1.41e-3"),
)  # fmt: skip


def settings_of(case: Case, controller: str) -> list[str]:
    """All settings of a run, in their order."""
    age = f"{case.delay_frames * FRAME_S:.9f}"
    steered = [setting.replace("AGE", age) for setting in CONTROLLERS[controller]]
    return ["variant=ideal", *SMALL_NOISE, *steered, *case.settings]


COLUMNS = ("disturbance", "scenario", "controller", "position_cm", "outside_runs")


def rows(case: Case, cells: dict[tuple[str, str], list[Figure]]) -> Iterator[tuple[str, ...]]:
    """The rows of a case: one for each figure and controller."""
    for (figure, controller), runs in cells.items():
        outside = sum(run.settled_s is None for run in runs)
        yield case.name, figure, controller, f"{median(run.position_cm for run in runs):.2f}", f"{outside}"


def chosen(only: Iterable[str]) -> list[int]:
    """Numbers of the cases of which group or name holds one of the words; all, if there is none."""
    words = [word.strip() for word in only if word.strip()]
    return [
        number
        for number, case in enumerate(CASES)
        if not words or any(word == case.group or word in case.name for word in words)
    ]


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Each disturbance alone, on three controllers.")
    parser.add_argument("--seeds", type=range_of_seeds, default=range(20), help="first and last: 0-19")
    parser.add_argument("--only", default="", help="groups or parts of names, separated by commas")
    parser.add_argument("--jobs", type=int, default=cores(), help="processes (default: all cores)")
    given = parser.parse_args(arguments)
    numbers = chosen(given.only.split(","))
    if not numbers:
        parser.error(
            f"no disturbance is called {given.only!r}; groups: {', '.join(dict.fromkeys(c.group for c in CASES))}"
        )
    if given.jobs < 1:
        parser.error("--jobs must be 1 or above")
    cells = [(number, figure, name) for number in numbers for figure in FIGURES for name in CONTROLLERS]
    levels = [
        Level(f"{cell}", tuple(settings_of(CASES[cell[0]], cell[2])), scenario=cell[1]) for cell in cells
    ]
    plan = plan_of_levels("disturbances", levels, given.seeds)
    found: dict[tuple[int, str, str], list[Figure]] = {}
    begun = time.monotonic()
    interrupted = False
    try:
        outcomes = outcomes_of([plan.work(run) for run in range(plan.runs)], Processes(given.jobs))
        for cell in cells:
            found[cell] = [figure_of(seed, next(outcomes)) for seed in given.seeds]
            left = (time.monotonic() - begun) / len(found) * (len(cells) - len(found))
            text = f"\r{len(found)} of {len(cells)} cells, {left:.0f} s left  "
            print(text, end="", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        interrupted = True
    finally:
        print(file=sys.stderr)
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(COLUMNS)
    for number in numbers:
        line = {
            (figure, name): found.get((number, figure, name), [])
            for figure in FIGURES
            for name in CONTROLLERS
        }
        if all(line.values()):
            writer.writerows(rows(CASES[number], line))
    return 130 if interrupted else 0


if __name__ == "__main__":
    sys.exit(main())
