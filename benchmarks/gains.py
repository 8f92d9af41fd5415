"""One search for gains, with the same budget for every law: `python -m benchmarks.gains --write docs/gains.md`.

The paper prints no gains. This search gives the paper's law and the three forms of epsilon-tracking the same number of
gain sets, the same starts (Figs. 6 to 10), the same loop and the same seeds, and none of them begins at a known set.

1. Explore: `Budget.explored` sets, each gain drawn evenly in its logarithm between two bounds. Each set drives from all
   five starts, with `SEARCH` seeds a start. The share of these sets that settle from a start is in the first table.
2. Refine, once for the line (Figs. 6, 7 and 9) and once for the curve (Figs. 8 and 10): `Budget.generations` times
   `Budget.children` sets near the best four so far.
3. Check: the best four drive with `CHECK` seeds, and the best of them is kept.
4. Hold out: that set drives with `HELD_OUT` seeds, which chose nothing. They are the seeds of `mirotwin reproduce`.

A run settles if it is within 3 cm and 0.15 rad for its whole last second. A set settles from a start if 80 % of its
runs do; in steps 1 to 3 it leaves a start as soon as that is out of reach. A run ends, and does not settle,
where the robot is more than `LOST_M`
off its reference: little of 6 s is left to come back, and a picture without a robot is slow to search. Sets are
compared by their cost, the mean over all seeds: of a run that settles its error, of any other between `MISSED_CM` and
`LOST_CM`, the more the farther off it ends, so that a search that settles nowhere yet has a direction. A seed that was
left out counts as the mean of those that did not settle.

All draws come from `miro_exact.rng` by name and index, gains are rounded to three digits before they are used, and
results are taken in the order of the sets: the page does not depend on the number of processes or on the machine.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import cache
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import range_of_seeds
from miro_exact.dmath import exp, log, wrap_pi
from miro_exact.rng import Stream
from miro_host.posture import Posture
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.campaign.reproduce.claims import number as shown
from mirotwin.campaign.reproduce.plan import STARTS, Start
from mirotwin.campaign.workers import processes
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD
from mirotwin.shell.processes import cores

SEED = 1999
SEARCH = range(2000, 2005)
CHECK = range(3000, 3010)
HELD_OUT = range(50)
ENOUGH = 0.8
MISSED_CM, LOST_CM = 4.0, 10.0
HALF_LOST_CM = 20.0
"""Where a run that ends so far off costs half way between these two."""
LOST_M = 1.0
LAST_SECOND = 30
"""Control periods."""
PARENTS = 4
PATHS = {"line": (6, 7, 9), "curve": (8, 10)}
FIGURES = tuple(start.figure for start in STARTS)
SPREADS = (0.4, 0.3, 0.2, 0.15)
"""Standard deviation of the logarithm of a child's gains, by generation; the last one stays."""
SPEED_M_S = 0.2  # of the references

Gains = Mapping[str, float]


class Budget(NamedTuple):
    """Gain sets that each law may try: `explored`, and for each path `generations` times `children`."""

    explored: int = 30
    generations: int = 3
    children: int = 12


class Family(NamedTuple):
    """A law in one form: `fixed` keys of its table, and the bounds of the gains that are searched for."""

    name: str
    law: str
    fixed: str
    bounds: Mapping[str, tuple[float, float]]
    keys: Callable[[Gains], Gains]

    def settings(self, gains: Gains) -> str:
        """The controller, as a setting of a scenario."""
        words = [f'law="{self.law}"', self.fixed, *(f"{k}={v!r}" for k, v in self.keys(gains).items())]
        return f"network.robot.controller={{{', '.join(words)}}}"


def as_they_are(gains: Gains) -> Gains:
    return gains


def kept_theory(gains: Gains) -> Gains:
    """`margin` becomes the beta that keeps beta epsilon > 2 |u*|: |u*| is at most that of the arc, at its start."""
    length, speed = gains["length_m"], SPEED_M_S
    largest = math.sqrt(speed * speed + (speed / length) * (speed / length))
    others = {name: value for name, value in gains.items() if name != "margin"}
    return {**others, "beta_per_s": rounded(gains["margin"] * 2.0 * largest / gains["epsilon_rad"])}


LIMITS = {"max_v_m_s": (0.25, 0.95), "max_w_rad_s": (2.0, 7.0)}
EPSILON = {"epsilon_rad": (0.01, 0.5), "alpha_per_s": (0.5, 8.0), "length_m": (0.05, 1.0)}
NOT_TOO_FAST = {
    "epsilon_rad": (0.05, 0.5),
    "length_m": (0.1, 1.0),
}  # smaller ones ask for a beta of thousands
BETA = {"beta_per_s": (0.5, 8.0)}
YANG_KIM = {
    "gamma1_per_s": (0.5, 8.0),
    "gamma2_per_s": (1.0, 16.0),
    "q1_per_s": (0.05, 5.0),
    "q2_per_s": (0.05, 5.0),
    "p1_m_s2": (0.05, 1.5),
    "p2_rad_s2": (0.2, 10.0),
    "layer_s1_m_s": (0.01, 0.5),
    "layer_s2_rad_s": (0.05, 1.0),
    "layer_theta_rad": (0.01, 0.3),
    "cosine_guard": (0.05, 0.4),
}
FAMILIES = (
    Family("the paper's law", "yang_kim", 'switching="saturation"', {**YANG_KIM, **LIMITS}, as_they_are),
    Family(
        "epsilon, naive sigma, sign (as `illustrative`)",
        "epsilon_tracking",
        'sigma="naive", switching="sign"',
        {**EPSILON, **BETA, **LIMITS},
        as_they_are,
    ),
    Family(
        "epsilon, invariant sigma, sign, keeps its theory (as `theory`)",
        "epsilon_tracking",
        'sigma="invariant", switching="sign"',
        {**EPSILON, **NOT_TOO_FAST, "margin": (1.05, 4.0), **LIMITS},
        kept_theory,
    ),
    Family(
        "epsilon, invariant sigma, saturation (as `retuned`)",
        "epsilon_tracking",
        'sigma="invariant", switching="saturation"',
        {**EPSILON, **BETA, "layer_sigma_rad2": (0.001, 0.1), **LIMITS},
        as_they_are,
    ),
)


def rounded(value: float) -> float:
    """To three digits."""
    return float(f"{value:.3g}")


def drawn(family: Family, number: int) -> Gains:
    """The gain set of that number, evenly in the logarithms."""
    stream = Stream(SEED, f"gains/{family.name}/explore")
    first = number * len(family.bounds)
    return {
        name: rounded(low * exp(stream.uniform(first + index) * log(high / low)))
        for index, (name, (low, high)) in enumerate(family.bounds.items())
    }


def child(family: Family, parent: Gains, path: str, generation: int, number: int) -> Gains:
    """A gain set near its parent, within the bounds."""
    stream = Stream(SEED, f"gains/{family.name}/{path}/{generation}")
    spread = SPREADS[min(generation, len(SPREADS) - 1)]
    first = number * len(family.bounds)
    return {
        name: rounded(min(high, max(low, parent[name] * exp(spread * stream.gauss(first + index)))))
        for index, (name, (low, high)) in enumerate(family.bounds.items())
    }


class Task(NamedTuple):
    """A gain set from some starts. `patient`: all runs are made, also where too few can settle."""

    settings: str
    figures: tuple[int, ...]
    seeds: range
    patient: bool = False


class Drive(NamedTuple):
    """What one set did from one start: errors of runs that settle, and where the others ended, both in cm."""

    errors_cm: tuple[float, ...]
    ends_cm: tuple[float, ...]
    planned: int

    @property
    def runs(self) -> int:
        return len(self.errors_cm) + len(self.ends_cm)

    @property
    def settled(self) -> int:
        return len(self.errors_cm)

    @property
    def settles(self) -> bool:
        return self.settled >= ENOUGH * self.planned

    @property
    def cost_cm(self) -> float:
        missed = [MISSED_CM + (LOST_CM - MISSED_CM) * end / (end + HALF_LOST_CM) for end in self.ends_cm]
        each = math.fsum(missed) / len(missed) if missed else 0.0
        return (math.fsum(self.errors_cm) + each * (self.planned - self.settled)) / self.planned


Drives = Mapping[int, Drive]
"""By figure."""


class Tried(NamedTuple):
    """A gain set and what it did."""

    gains: Gains
    drives: Drives

    def cost_cm(self, figures: Sequence[int]) -> float:
        """The mean of some starts."""
        return math.fsum(self.drives[figure].cost_cm for figure in figures) / len(figures)


def driven(task: Task) -> Drives:
    """All runs of a set."""
    starts = [start for start in STARTS if start.figure in task.figures]
    return {start.figure: drive_of(task, _runs(start, task)) for start in starts}


class Outcome(NamedTuple):
    """Of one run: whether it settles; its error over the last second if so, else how far off it ends, in cm."""

    settled: bool
    error_cm: float


def drive_of(task: Task, outcomes: Iterable[Outcome]) -> Drive:
    """Takes runs until the set can no longer settle, if the task is not patient."""
    planned = len(task.seeds)
    most_lost = planned - math.ceil(ENOUGH * planned)
    settled: list[float] = []
    others: list[float] = []
    for outcome in outcomes:
        (settled if outcome.settled else others).append(outcome.error_cm)
        if not task.patient and len(others) > most_lost:
            break
    return Drive(tuple(settled), tuple(others), planned)


@cache
def _image() -> Image:
    return load_hex(image_path())


def _runs(start: Start, task: Task) -> Iterator[Outcome]:
    errors = (
        f"network.robot.start_error_x_cm={start.x_cm}",
        f"network.robot.start_error_y_cm={start.y_cm}",
        f"network.robot.start_error_theta_rad={start.theta_rad}",
    )
    scenario = load(start.proposed, (*errors, task.settings)).scenario
    for seed in task.seeds:
        yield outcome_of(World(scenario, seed, _image()))


def outcome_of(world: World) -> Outcome:
    """Errors are of the position; over the last second, root mean square."""
    squares: list[float] = []
    distance_m, inside = 0.0, 0  # periods in a row within the limits
    while not world.finished:
        robot = world.step().robots[0]
        distance_m, heading_rad = _off(robot.truth, robot.reference)
        within = 100.0 * distance_m <= SETTLED_CM and heading_rad <= SETTLED_RAD
        inside = inside + 1 if within else 0
        if distance_m > LOST_M:
            break
        squares.append(distance_m * distance_m)
    if inside < LAST_SECOND:
        return Outcome(False, 100.0 * distance_m)
    last = squares[-LAST_SECOND:]
    return Outcome(True, 100.0 * math.sqrt(math.fsum(last) / len(last)))


def _off(truth: Posture, reference: Posture) -> tuple[float, float]:
    x_m, y_m = truth.x_m - reference.x_m, truth.y_m - reference.y_m
    return math.sqrt(x_m * x_m + y_m * y_m), abs(wrap_pi(truth.theta_rad - reference.theta_rad))


Runner = Callable[[str, Sequence[Task]], Sequence[Drives]]
"""Makes the runs of some tasks, in their order; the text says what they are for."""


def ranked(tried: Sequence[Tried], figures: Sequence[int]) -> list[Tried]:
    """The best first. Of equals the earlier one."""
    return sorted(tried, key=lambda one: one.cost_cm(figures))


class Best(NamedTuple):
    """What a law's search came to on one path."""

    gains: Gains
    held_out: Drives


class Found(NamedTuple):
    """What a law's search came to: share of explored sets by figure, best sets by path, sets tried, runs made."""

    family: Family
    explored: int
    shares: Mapping[int, float]
    best: Mapping[str, Best]
    sets: int
    runs: int


class Search:
    """The search for one law."""

    def __init__(self, family: Family, budget: Budget, runner: Runner, held_out: range = HELD_OUT) -> None:
        self.family, self.budget, self.runner, self.held_out = family, budget, runner, held_out
        self.sets = self.runs = 0

    def found(self) -> Found:
        """Runs all of it."""
        sets = [drawn(self.family, number) for number in range(self.budget.explored)]
        explored = self._try("exploring", sets, FIGURES)
        shares = {
            figure: len([1 for one in explored if one.drives[figure].settles]) / len(explored)
            for figure in FIGURES
        }
        best = {path: self._best(explored, path) for path in PATHS}
        return Found(self.family, len(explored), shares, best, self.sets, self.runs)

    def _best(self, explored: Sequence[Tried], path: str) -> Best:
        figures, tried = PATHS[path], list(explored)
        for generation in range(self.budget.generations):
            parents = ranked(tried, figures)[:PARENTS]
            sets = [
                child(self.family, parents[number % len(parents)].gains, path, generation, number)
                for number in range(self.budget.children)
            ]
            tried += self._try(f"refining on the {path}", sets, figures)
        last = [one.gains for one in ranked(tried, figures)[:PARENTS]]
        checked = self._drive(f"checking on the {path}", last, figures, CHECK)
        gains = ranked(checked, figures)[0].gains
        return Best(gains, self._drive("holding out", [gains], figures, self.held_out, True)[0].drives)

    def _try(self, what: str, sets: Sequence[Gains], figures: tuple[int, ...]) -> list[Tried]:
        self.sets += len(sets)
        return self._drive(what, sets, figures, SEARCH)

    def _drive(
        self, what: str, sets: Sequence[Gains], figures: tuple[int, ...], seeds: range, patient: bool = False
    ) -> list[Tried]:
        tasks = [Task(self.family.settings(gains), figures, seeds, patient) for gains in sets]
        made = self.runner(f"{self.family.name}: {what}", tasks)
        self.runs += sum(drive.runs for drives in made for drive in drives.values())
        return [Tried(gains, drives) for gains, drives in zip(sets, made, strict=True)]


def runner_of(executor: Executor) -> Runner:
    """A runner whose runs are made by an executor, which says on standard error how far it is."""

    def made(what: str, tasks: Sequence[Task]) -> list[Drives]:
        cut = [piece for task in tasks for piece in pieces(task)]
        results: list[Drives] = []
        for drives in executor.map(driven, cut):
            results.append(drives)
            if sys.stderr.isatty():
                print(f"\r{what}: {len(results)} of {len(cut)}\033[K", end="", file=sys.stderr, flush=True)
        print(
            f"\r{what}: done\033[K" if sys.stderr.isatty() else f"{what}: done", file=sys.stderr, flush=True
        )
        return joined(tasks, results)

    return made


def pieces(task: Task) -> list[Task]:
    """Tasks of one start each, and of ten seeds where none are left out, so that all processes have work."""
    seeds = task.seeds
    parts = [seeds[n : n + 10] for n in range(0, len(seeds), 10)] if task.patient else [seeds]
    return [task._replace(figures=(figure,), seeds=part) for figure in task.figures for part in parts]


def joined(tasks: Sequence[Task], results: Sequence[Drives]) -> list[Drives]:
    """What the pieces of tasks did, as what the tasks did."""
    rest = iter(results)
    found: list[Drives] = []
    for task in tasks:
        whole: dict[int, Drive] = {}
        for piece in pieces(task):
            (figure,) = piece.figures
            part = next(rest)[figure]
            whole[figure] = _sum(whole[figure], part) if figure in whole else part
        found.append(whole)
    return found


def _sum(one: Drive, two: Drive) -> Drive:
    return Drive(one.errors_cm + two.errors_cm, one.ends_cm + two.ends_cm, one.planned + two.planned)


def median_cm(drive: Drive) -> float | None:
    """Of the runs that settle."""
    ordered = sorted(drive.errors_cm)
    half = len(ordered) // 2
    if not ordered:
        return None
    return ordered[half] if len(ordered) % 2 else 0.5 * (ordered[half - 1] + ordered[half])


HEAD = """\
# The same search for each law

<!-- not run: thousands of runs, a quarter of an hour on two cores; tests/sim/test_benchmarks.py has its parts -->
```sh
python -m benchmarks.gains --write docs/gains.md
```

writes this page, with the same bytes on every computer.

The paper prints no gains, and the shipped ones were found by searches of different kinds. Here the paper's law and the
three forms of epsilon-tracking get the same search: {explored} gain sets drawn from wide bounds, then for the line
(Figs. 6, 7, 9) and for the curve (Figs. 8, 10) {refined} sets each near the best ones. All drive the whole loop (camera
`1997`, radio, firmware, LM629, motors) from the starts of the paper's Figs. 6 to 10. The paper's law has
{papers} gains to search for, epsilon-tracking {fewest} or {most}; the number of sets is the same.

A run *settles* if it is within 3 cm and 0.15 rad for its whole last second. A set settles from a start if
{enough:.0f} % of its runs do. A run that is more than {lost:g} m off its reference is over.

## How many gain sets settle

Of the {explored} sets that were drawn, the share that settles (seeds {search}, {enough:.0f} % of {each}):

"""
BEST = """
## The best sets

Chosen on the search's seeds and on seeds {check}, then driven with seeds {held_out}, which chose nothing: runs that
settle, and the median error of these in cm.

"""
READING = """
Gains of these sets, as keys of `[network.robot.controller]`:
"""


def page(found: Sequence[Found], budget: Budget, held_out: range) -> str:
    """The whole text."""
    counts = [len(one.family.bounds) for one in found]
    head = HEAD.format(
        explored=budget.explored,
        refined=budget.generations * budget.children,
        papers=counts[0],
        fewest=min(counts),
        most=max(counts[1:], default=counts[0]),
        enough=100 * ENOUGH,
        lost=LOST_M,
        search=span(SEARCH),
        each=len(SEARCH),
    )
    best = BEST.format(check=span(CHECK), held_out=span(held_out))
    lines = [*_shares(found), best.rstrip("\n"), "", *_best_lines(found), *_gain_lines(found)]
    return head.rstrip("\n") + "\n\n" + "\n".join(lines) + "\n"


def span(seeds: range) -> str:
    return f"{seeds[0]} to {seeds[-1]}"


def _shares(found: Sequence[Found]) -> Iterator[str]:
    yield (
        "| law | sets drawn | "
        + " | ".join(f"Fig. {figure}" for figure in FIGURES)
        + " | sets in all | runs |"
    )
    yield "|---" * (4 + len(FIGURES)) + "|"
    for one in found:
        shares = " | ".join(f"{100 * one.shares[figure]:.0f} %" for figure in FIGURES)
        yield f"| {one.family.name} | {one.explored} | {shares} | {one.sets} | {one.runs} |"


def _best_lines(found: Sequence[Found]) -> Iterator[str]:
    yield "| law | " + " | ".join(f"Fig. {figure}" for figures in PATHS.values() for figure in figures) + " |"
    yield "|---" * (1 + len(FIGURES)) + "|"
    for one in found:
        drives = [one.best[path].held_out[figure] for path, figures in PATHS.items() for figure in figures]
        yield f"| {one.family.name} | " + " | ".join(_cell(drive) for drive in drives) + " |"


def _cell(drive: Drive) -> str:
    return f"{drive.settled} of {drive.runs}: {shown(median_cm(drive))}"


def _gain_lines(found: Sequence[Found]) -> Iterator[str]:
    yield READING
    yield "| law | path | gains |\n|---|---|---|"
    for one in found:
        for path, best in one.best.items():
            gains = ", ".join(f"{name} {value:g}" for name, value in one.family.keys(best.gains).items())
            yield f"| {one.family.name} | {path} | {gains} |"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--write", type=Path, metavar="PAGE", help="docs/gains.md; left out: on the screen")
    parser.add_argument(
        "--only", default="", help="a part of the names of laws, for a look; not with --write"
    )
    parser.add_argument("--jobs", type=int, default=cores(), help="processes (default: all cores)")
    parser.add_argument(
        "--budget", type=int, nargs=3, default=Budget(), metavar=("DRAWN", "GENERATIONS", "CHILDREN")
    )
    parser.add_argument("--held-out", type=range_of_seeds, default=HELD_OUT, help="first and last: 0-49")
    given = parser.parse_args(arguments)
    families = [family for family in FAMILIES if given.only in family.name]
    budget = Budget(*given.budget)
    if not families or (given.only and given.write):
        parser.error(
            "--only: no law has such a name" if not families else "--only and --write do not go together"
        )
    if given.jobs < 1 or budget.explored < 1 or budget.generations < 0 or budget.children < 1:
        parser.error("--jobs, and the numbers of sets, must be 1 or above")
    with processes(given.jobs) as executor:
        found = [Search(family, budget, runner_of(executor), given.held_out).found() for family in families]
    text = page(found, budget, given.held_out)
    if given.write:
        given.write.write_text(text, encoding="utf-8")
    else:
        print(text, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
