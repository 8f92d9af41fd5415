"""Scenarios over many seeds, as one row of figures each: `python -m benchmarks.figures fig6 fig8 --seeds 0-49`.

`--set KEY=VALUE` changes keys as `mirotwin run` does, for all scenarios.

rms      position, x, y in cm over the last second, truth against reference: median, and 95 % (the 48th of 50 values in
         order, the last of 20) and worst of the position
never    runs that have not settled: outside 3 cm or 0.15 rad at some time of the last second
settled  median of the time after which a run stays inside, of the runs that are not counted as never
back     runs in which the robot moves backwards by more than 1 cm/s at some time
faults   firmware faults, all runs added up
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Sequence
from typing import NamedTuple

from miro_exact.bad_input import BadInput
from mirotwin.campaign.design import Level
from mirotwin.campaign.drive import outcomes_of
from mirotwin.campaign.plan import plan_of_levels
from mirotwin.campaign.ranges import seeds_of
from mirotwin.campaign.single import run_single
from mirotwin.campaign.worker import RunOutcome
from mirotwin.campaign.workers import Processes
from mirotwin.shell.processes import cores

RMS = ("rms_position_cm", "rms_x_cm", "rms_y_cm", "rms_theta_deg")
HEAD = f"{'scenario':12} {'runs':>4}  {'rms position: median 95 % worst':32} {'x':>7} {'y':>7}"
HEAD += "  never  settled  back  faults"


class Figure(NamedTuple):
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


def figure_of(seed: int, outcome: RunOutcome) -> Figure:
    """What a run of a campaign amounts to. Raises BadInput for one that could not be made."""
    if outcome.error:
        raise BadInput("", f"seed {seed}", outcome.error)
    found = outcome.figures
    position_cm, x_cm, y_cm, theta_deg = (0.0 if found[name] is None else found[name] for name in RMS)
    return Figure(
        seed=seed,
        position_cm=position_cm,
        x_cm=x_cm,
        y_cm=y_cm,
        theta_deg=theta_deg,
        settled_s=found["settling_s"],
        backwards=bool(found["backward_s"]),
        faults=found["faults"] or 0,
    )


def row(outcomes: Sequence[Figure]) -> Row:
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


def figures(source: str, settings: Sequence[str], seeds: range, jobs: int = 1) -> list[Figure]:
    """The runs of one scenario, in the order of the seeds, in `jobs` processes. Raises BadInput."""
    plan = plan_of_levels(source, [Level(source, scenario=source)], seeds, settings)
    works = [plan.work(run) for run in range(plan.runs)]
    outcomes = map(run_single, works) if jobs == 1 else outcomes_of(works, Processes(jobs))
    return [figure_of(seed, outcome) for seed, outcome in zip(seeds, outcomes, strict=True)]


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
            found = figures(source, options.settings, options.seeds, options.jobs)
        except BadInput as error:
            parser.error(str(error))
        for one in found if options.each else ():
            settled = "never" if one.settled_s is None else f"{one.settled_s:.2f} s"
            where = f"{one.position_cm:8.2f} {one.x_cm:8.2f} {one.y_cm:8.2f} cm {one.theta_deg:7.2f} deg"
            print(f"  seed {one.seed:6} {where} {settled:>7}{' back' * one.backwards}")
        print(row(found).text(source), flush=True)


if __name__ == "__main__":
    main()
