"""Scenarios over many seeds, as one row of figures each: `python -m benchmarks.figures fig6 fig8 --seeds 0-49`.

`--set KEY=VALUE` changes keys as `mirotwin run` does, for all scenarios.

rms      position, x, y in cm over the last second, truth against reference: median, and 95 % (the 48th of 50 values in
         order, the last of 20) and worst of the position
never    runs that are outside 3 cm or 0.15 rad at some time of the last second, as a robot that has settled is not
settled  median of the time after which a run stays inside, of the runs that are not counted as never
back     runs in which the robot moves backwards by more than 1 cm/s at some time of the first half
faults   firmware faults, all runs added up
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file
from miro_sim.world.world import World
from mirotwin.campaign.execute import in_order
from mirotwin.campaign.processes import cores, processes
from mirotwin.campaign.seeds import seeds_of
from mirotwin.recording.track import Tracks
from mirotwin.report.summary import tracking_of

BACKWARDS_M_S = -0.01
HEAD = f"{'scenario':12} {'runs':>4}  {'rms position: median 95 % worst':32} {'x':>7} {'y':>7}"
HEAD += "  never  settled  back  faults"


class Outcome(NamedTuple):
    """What one run amounts to. `settled_s` is None for a run that never settles."""

    seed: int
    position_cm: float
    x_cm: float
    y_cm: float
    theta_deg: float
    settled_s: float | None
    backwards: bool
    faults: int


class Row(NamedTuple):
    """What several runs amount to."""

    runs: int
    median_cm: float
    percentile_95_cm: float
    worst_cm: float
    x_cm: float
    y_cm: float
    never: int
    settled_s: float | None
    backwards: int
    faults: int

    def text(self, name: str) -> str:
        settled = "-" if self.settled_s is None else f"{self.settled_s:.2f} s"
        position = f"{self.median_cm:.2f} / {self.percentile_95_cm:.2f} / {self.worst_cm:.2f} cm"
        counts = f"{self.never:6}  {settled:>7}  {self.backwards:4}  {self.faults:6}"
        return f"{name:12} {self.runs:4}  {position:32} {self.x_cm:7.2f} {self.y_cm:7.2f} {counts}"


class Task(NamedTuple):
    """A name or file of a scenario, settings, seed."""

    source: str
    settings: tuple[str, ...]
    seed: int


def drive(task: Task) -> Outcome:
    """One run. Raises BadInput."""
    source, settings, seed = task
    world = World(file.load(source, settings).scenario, seed, load_hex(image_path()))
    tracks, speeds = Tracks(), []
    while not world.finished:
        period = world.step()
        tracks.add(period)
        speeds.append(period.robots[0].v_m_s)
    errors = next(iter(tracks.robots.values())).errors
    tracking = tracking_of(errors)
    last = [sample for sample in errors if sample.tick > errors[-1].tick - TICKS_PER_SECOND]
    figures = (tracking.rms_position_cm, tracking.rms_x_cm, tracking.rms_y_cm, tracking.rms_theta_deg)
    position_cm, x_cm, y_cm, theta_deg = (0.0 if figure is None else figure for figure in figures)
    return Outcome(
        seed=seed,
        position_cm=position_cm,
        x_cm=x_cm,
        y_cm=y_cm,
        theta_deg=theta_deg,
        settled_s=tracking.settling_s if all(sample.settled for sample in last) else None,
        backwards=min(speeds[: len(speeds) // 2], default=0.0) < BACKWARDS_M_S,
        faults=world.counters()["firmware"]["faults"] or 0,
    )


def row(outcomes: Sequence[Outcome]) -> Row:
    """The runs of one scenario, counted up."""
    positions = sorted(outcome.position_cm for outcome in outcomes)
    settled = [outcome.settled_s for outcome in outcomes if outcome.settled_s is not None]
    return Row(
        runs=len(outcomes),
        median_cm=statistics.median(positions),
        percentile_95_cm=positions[min(len(positions) - 1, len(positions) * 95 // 100)],
        worst_cm=positions[-1],
        x_cm=statistics.median(outcome.x_cm for outcome in outcomes),
        y_cm=statistics.median(outcome.y_cm for outcome in outcomes),
        never=len(outcomes) - len(settled),
        settled_s=statistics.median(settled) if settled else None,
        backwards=sum(outcome.backwards for outcome in outcomes),
        faults=sum(outcome.faults for outcome in outcomes),
    )


def outcomes(source: str, settings: Sequence[str], seeds: Iterable[int], jobs: int = 1) -> list[Outcome]:
    """The runs of one scenario, in the order of the seeds, in `jobs` processes."""
    tasks = [Task(source, tuple(settings), seed) for seed in seeds]
    if jobs == 1:
        return [drive(task) for task in tasks]
    return list(in_order(drive, tasks, processes(jobs), 4 * jobs))


def range_of_seeds(text: str) -> range:
    """For the command line."""
    try:
        return seeds_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("scenario", nargs="+", help="built-in scenario or file")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="settings")
    parser.add_argument(
        "--seeds", type=range_of_seeds, default=range(20), metavar="FIRST-LAST", help="0-19 unless told"
    )
    parser.add_argument("--jobs", type=int, default=cores(), help="processes; one a processor unless told")
    parser.add_argument("--each", action="store_true", help="a line for each run as well")
    options = parser.parse_args()
    print(HEAD)
    for source in options.scenario:
        try:
            found = outcomes(source, options.settings, options.seeds, options.jobs)
        except BadInput as error:
            parser.error(str(error))
        for one in found if options.each else ():
            settled = "never" if one.settled_s is None else f"{one.settled_s:.2f} s"
            where = f"{one.position_cm:8.2f} {one.x_cm:8.2f} {one.y_cm:8.2f} cm {one.theta_deg:7.2f} deg"
            print(f"  seed {one.seed:6} {where} {settled:>7}{' back' * one.backwards}")
        print(row(found).text(source), flush=True)


if __name__ == "__main__":
    main()
