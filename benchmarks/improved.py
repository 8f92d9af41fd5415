"""The improved chain, a law and an estimator of ours, in the whole loop: how near to the path it ends.

    python -m benchmarks.improved [--seeds 0-49] [--law body_frame] [--estimator ekf] [--only "CASE;.."]

Runs on all cores; says on standard error how far it is, and prints a Markdown table. Errors are positions in truth,
root mean square over the last second, in cm. The exit code is 1 if a case is beyond its limits. Starts drawn at random
are a function of the seed: headings over the whole circle, places evenly over what of the pitch is near enough.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable, Sequence
from statistics import median
from typing import NamedTuple

from msgspec.structs import replace

from benchmarks.figures import range_of_seeds
from miro_exact.bad_input import BadInput
from miro_exact.rng import Stream
from miro_host.posture import Posture
from miro_sim.pitch import ground
from miro_sim.scenario import file as scenario_file
from miro_sim.scenario.build import reference_for
from mirotwin.campaign.design import Level
from mirotwin.campaign.drive import outcomes_of
from mirotwin.campaign.plan import plan_of_levels
from mirotwin.campaign.worker import RunOutcome, Work
from mirotwin.campaign.workers import Processes

ANYWHERE_M = 10.0
WHITE = 'camera={kind="gaussian"}'
CALIBRATED = 'camera.calibration="exact"'
ROUND = (
    "duration_s=12.0",
    'network.robot.controller={law="body_frame"}',  # one that may pass the origin
    'network.robot.reference={kind="waypoints",closed=true,speed_m_s=0.2,points=['
    "{x_cm=0.0,y_cm=0.0,heading_deg=-40.0},{x_cm=45.0,y_cm=0.0},{x_cm=75.0,y_cm=25.0},{x_cm=45.0,y_cm=50.0},"
    "{x_cm=0.0,y_cm=30.0}]}",
)
"""A closed path of 2.1 m over most of the pitch."""
FIGURES = {"6": ("fig6", ()), "7": ("fig7", ()), "8": ("fig8", ())}
LEARNING = 'camera.self_calibration="lines"'
WHEELS_5 = "network.robot.wheel_radius_mismatch=0.05"
SPREAD_5 = 0.029  # of an even spread of 5 %
UNEVEN = (
    "network.robot.wheel_radius_mismatch=0.0",
    "network.robot.drive.chassis.left_radius_factor=1.05",
    "network.robot.drive.chassis.right_radius_factor=0.95",
)
NOISY = "network.control_noise={v_m_s=0.05,w_rad_s=0.5}"
LOSSY = "network.radio.bit_error_rate=1.72e-3"  # 1 - (1 - p)^130 = 20 %


class Limits(NamedTuple):
    """Largest median and 95th percentile in cm, and whether every run has to settle."""

    median_cm: float = math.inf
    most_cm: float = math.inf
    settles: bool = False


class Case(NamedTuple):
    """A line of the table. `near_m`: random starts so near to the start of the reference, 0: as the scenario says."""

    name: str
    scenario: str
    sets: tuple[str, ...]
    limits: Limits = Limits()
    near_m: float = 0.0
    wheel_spread: float | None = None
    runs_a_seed: int = 1


class Result(NamedTuple):
    """One run."""

    position_cm: float
    settled: bool
    off_pitch_s: float


def cases() -> list[Case]:
    """All lines, in the order of the table."""
    found = []
    for camera, word, limits in (
        (WHITE, "white noise", Limits(0.25, 0.5)),
        (CALIBRATED, "calibrated", Limits(0.08, 0.15)),
    ):
        found += [Case(f"{word}, Fig. {n}", s, (camera, *more), limits) for n, (s, more) in FIGURES.items()]
    for wheels, word in (((WHEELS_5,), "5 % wheels"), (UNEVEN, "wheels 1.05 and 0.95")):
        for camera, of in ((WHITE, "white noise"), (CALIBRATED, "calibrated")):
            for number in ("6", "8"):
                name = f"{word}, {of}, Fig. {number}"
                sets = (camera, *wheels)
                found.append(Case(name, f"fig{number}", sets, Limits(median_cm=0.3), wheel_spread=SPREAD_5))
    settles = Limits(settles=True)
    found += [
        Case("starts within 60 cm, line", "fig6", (WHITE,), settles, near_m=0.6, runs_a_seed=4),
        Case("starts within 60 cm, arc", "fig8", (WHITE,), settles, near_m=0.6, runs_a_seed=4),
        Case("1997, self-calibration, Fig. 6", "fig6", (LEARNING,), Limits(0.15, math.inf)),
        Case("1997, self-calibration, Fig. 7", "fig7", (LEARNING,), Limits(0.15, math.inf)),
        Case("1997, self-calibration, Fig. 8", "fig8", (LEARNING,), Limits(0.15, math.inf)),
        Case("starts anywhere, closed path, 12 s", "fig6", (WHITE, *ROUND), settles, ANYWHERE_M),
    ]
    for camera, of in ((WHITE, "white noise"), (CALIBRATED, "calibrated")):
        found += [
            Case(f"control noise, {of}, Fig. 6", "fig6", (camera, NOISY)),
            Case(f"20 % of frames lost, {of}, Fig. 6", "fig6", (camera, LOSSY)),
        ]
    return found


def start_of(seed: int, near_m: float) -> Posture:
    """A start on the pitch, as an error against a reference that starts in the origin with heading 0."""
    draws = Stream(seed, "benchmark/start")
    index = 0
    while True:
        theta_rad = math.tau * draws.uniform(index + 2) - math.pi
        x_m = ground.LEFT_M + draws.uniform(index) * ground.LENGTH_M
        y_m = ground.BOTTOM_M + draws.uniform(index + 1) * ground.WIDTH_M
        start = Posture(x_m, y_m, theta_rad)
        if math.hypot(x_m, y_m) <= near_m and ground.holds(start):
            return start
        index += 3


def works(case: Case, seeds: range, law: str, estimator: str, keys: str = "") -> list[Work]:
    """The runs of a case. `keys`: further ones of the estimator's table."""
    spread = "" if case.wheel_spread is None or estimator == "none" else f",wheel_spread={case.wheel_spread}"
    controller = () if law == "yang_kim" else (f'network.robot.controller={{law="{law}"}}',)
    more = f",{keys}" if keys else ""
    sets = (*case.sets, *controller, f'network.robot.estimator={{kind="{estimator}"{spread}{more}}}')
    plan = plan_of_levels(case.name, [Level(case.name, sets, case.scenario)], seeds)
    found = [plan.work(run) for run in range(plan.runs)]
    if case.near_m:
        found = [replace(one, settings=(*one.settings, *start_settings(case, one.seed))) for one in found]
    return found


def start_settings(case: Case, seed: int) -> tuple[str, ...]:
    """The start that is drawn for a seed."""
    start = start_of(seed, case.near_m)
    turned_rad = math.remainder(start.theta_rad - scenario_heading_rad(case), math.tau)
    return (
        f"network.robot.start_error_x_cm={100.0 * start.x_m!r}",
        f"network.robot.start_error_y_cm={100.0 * start.y_m!r}",
        f"network.robot.start_error_theta_rad={turned_rad!r}",
    )


def result_of(outcome: RunOutcome) -> Result:
    """Raises BadInput for a run that could not be made."""
    if outcome.error:
        raise BadInput("", f"run {outcome.run}", outcome.error)
    found = outcome.figures
    return Result(found["rms_position_cm"], found["settled"], found["off_pitch_s"])


def scenario_heading_rad(case: Case) -> float:
    """Heading of a case's reference at its start."""
    scenario = scenario_file.load(case.scenario, case.sets).scenario
    return reference_for(scenario.networks[0].robot[0], scenario.duration_s).at(0.0).posture.theta_rad


def row(case: Case, results: Sequence[Result]) -> tuple[str, bool]:
    """The case's line of the table, and whether it is within its limits."""
    errors = sorted(result.position_cm for result in results)
    middle, most = median(errors), errors[min(len(errors) - 1, int(0.95 * len(errors)))]
    settled = sum(result.settled for result in results)
    off_s = max(result.off_pitch_s for result in results)
    limits = case.limits
    good = middle <= limits.median_cm and most <= limits.most_cm
    good = good and (settled == len(results) or not limits.settles)
    return (
        f"| {case.name} | {middle:.3f} | {most:.3f} | {errors[-1]:.3f} | {settled} of {len(results)} | "
        f"{off_s:.1f} | {'' if good else 'beyond its limits'} |"
    ), good


def table(chosen: Iterable[Case], seeds: range, *parts: str) -> bool:
    """Prints the lines as they are finished; whether all are within their limits."""
    print("| case | median | 95 % | worst | settled | longest off the pitch, s | |")
    print("|---|---|---|---|---|---|---|")
    all_good = True
    for case in chosen:
        count = len(seeds) * case.runs_a_seed
        jobs = works(case, range(seeds.start, seeds.start + count), *parts)
        results = []
        for outcome in outcomes_of(jobs, Processes()):
            results.append(result_of(outcome))
            print(f"\r{case.name}: {len(results)} of {count}   ", end="", file=sys.stderr, flush=True)
        print("\r\033[K", end="", file=sys.stderr, flush=True)
        line, good = row(case, results)
        print(line, flush=True)
        all_good = all_good and good
    return all_good


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=range_of_seeds, default=range(50), help="first and last: 0-49")
    parser.add_argument("--law", default="body_frame")
    parser.add_argument("--estimator", default="ekf")
    parser.add_argument("--keys", default="", help="of the estimator, as in rim_noise_m_s=0.02")
    parser.add_argument("--only", default="", help="parts of the names of cases, with ; between them")
    asked = parser.parse_args()
    chosen = [case for case in cases() if any(word in case.name for word in asked.only.split(";"))]
    if not chosen:
        parser.error("no case has such a name")
    if not table(chosen, asked.seeds, asked.law, asked.estimator, asked.keys):
        sys.exit(1)


if __name__ == "__main__":
    main()
