"""Searches for gains, with the same budget for every law, to be compared by `python -m benchmarks.gains`.

The paper prints no gains. A search gives a law `Budget` gain sets, from the same starts (Figs. 6 to 10), in the same
loop, with the same seeds as every other law's search of that number; none begins at a known set. One search is a
lottery, so each law has several under a camera, which differ in what they draw and in their seeds.

1. Explore: `Budget.explored` sets, each gain drawn evenly in its logarithm from the middle half of its bounds. Each set
   drives from all five starts, with 3 seeds a start.
2. Refine, once for the line (Figs. 6, 7 and 9) and once for the curve (Figs. 8 and 10): three generations of
   `Budget.first` sets near the best four so far, anywhere within the bounds.
3. Check: the best four drive with 5 other seeds, and the best of them is kept.
4. Hold out: that set drives with `HELD_OUT` seeds, which chose nothing and are the same for all searches.
5. The same search goes on: three generations of `Budget.second` sets, then steps 3 and 4 again.

Steps 1 to 3 compare sets by the error in truth. A run settles if it is within 3 cm and 0.15 rad for its whole last
second. In steps 1 and 2 a set leaves a start after the first run that does not settle, and leaves out the other starts
once it is certain to be worse than the four best. A run ends, and does not settle, where the robot is more than
`LOST_M` off its reference (little of 6 s is left to come back, and a picture without a robot is slow to search) or is
outside in the last second. The cost of a set is the mean over all seeds: of a run that settles its error, of any other
between `MISSED_CM` and `LOST_CM`, the more the farther off it ends, so that a search that settles nowhere yet has a
direction. A seed that was left out counts as the mean of those that did not settle.

All draws come from `miro_exact.rng` by name and index, and gains are rounded to three digits before they are used: a
search does not depend on the process or the machine that makes it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND
from miro_exact.dmath import exp, log, wrap_pi
from miro_exact.rng import Stream
from miro_host.posture import Posture
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.campaign.design import Level
from mirotwin.campaign.plan import plan_of_levels
from mirotwin.campaign.reproduce.plan import STARTS, Start
from mirotwin.campaign.single import run_single
from mirotwin.recording.track import SETTLED_CM, SETTLED_RAD

SEED = 1999
HELD_OUT = range(20)
MISSED_CM, LOST_CM = 4.0, 10.0
HALF_LOST_CM = 20.0
"""Where a run that ends so far off costs half way between these two."""
LOST_M = 1.0
LAST_SECOND = 30
"""Control periods."""
PARENTS = 4
PATHS = {"line": (6, 7, 9), "curve": (8, 10)}
FIGURES = tuple(start.figure for start in STARTS)
GENERATIONS = 3
"""Before each check."""
SPREADS = (0.4, 0.3, 0.2, 0.3, 0.2, 0.1)
"""Standard deviation of the logarithm of a child's gains, by generation."""
CAMERAS = {
    "pixels, 1997": (),
    "pixels, exact": ('camera.calibration="exact"',),
    "white noise": ('camera={kind="gaussian"}',),
}
"""The camera of the scenarios, and two without its constant error."""

Gains = Mapping[str, float]
Bounds = Mapping[str, tuple[float, float]]


def search_seeds(repeat: int) -> range:
    return range(2000 + 3 * repeat, 2003 + 3 * repeat)


def check_seeds(repeat: int) -> range:
    return range(3000 + 5 * repeat, 3005 + 5 * repeat)


class Budget(NamedTuple):
    """Gain sets that each search may try: `explored`, then for each path three generations of `first`, of `second`."""

    explored: int = 30
    first: int = 12
    second: int = 16

    @property
    def sets(self) -> tuple[int, int]:
        """Sets that were tried for a path, at the first check and at the second."""
        first = self.explored + GENERATIONS * self.first
        return first, first + GENERATIONS * self.second


class Family(NamedTuple):
    """A law: `fixed` keys of its table, and the bounds of the gains that are searched for."""

    name: str
    law: str
    fixed: str
    bounds: Bounds

    def settings(self, gains: Gains) -> str:
        """The controller, as a setting of a scenario."""
        words = [f'law="{self.law}"', self.fixed, *(f"{k}={v!r}" for k, v in gains.items())]
        return f"network.robot.controller={{{', '.join(words)}}}"


# the references need 0.2 m/s, and a scenario refuses less
LIMITS: Bounds = {"max_v_m_s": (0.205, 1.2), "max_w_rad_s": (1.07, 13.1)}
EPSILON: Bounds = {
    "epsilon_rad": (0.00141, 3.54),
    "alpha_per_s": (0.125, 32.0),
    "length_m": (0.0112, 4.47),
    "beta_per_s": (0.125, 32.0),
    "layer_sigma_rad2": (0.0001, 1.0),
}
YANG_KIM: Bounds = {
    "gamma1_per_s": (0.125, 32.0),
    "gamma2_per_s": (0.25, 64.0),
    "q1_per_s": (0.005, 50.0),
    "q2_per_s": (0.005, 50.0),
    "p1_m_s2": (0.00913, 8.22),
    "p2_rad_s2": (0.0283, 70.7),
    "layer_s1_m_s": (0.00141, 3.54),
    "layer_s2_rad_s": (0.0112, 4.47),
    "layer_theta_rad": (0.00183, 1.64),
    "cosine_guard": (0.018, 1.0),
}
PAPER = Family("the paper's law", "yang_kim", 'switching="saturation"', {**YANG_KIM, **LIMITS})
RETUNED = Family(
    "epsilon-tracking",
    "epsilon_tracking",
    'sigma="invariant", switching="saturation"',
    {**EPSILON, **LIMITS},
)
FAMILIES = {family.name: family for family in (PAPER, RETUNED)}


def rounded(value: float) -> float:
    """To three digits."""
    return float(f"{value:.3g}")


def drawn(family: Family, repeat: int, number: int) -> Gains:
    """The gain set of that number: evenly in the logarithms, from the middle half of the bounds."""
    stream = Stream(SEED, f"gains/{family.name}/{repeat}/explore")
    first = number * len(family.bounds)
    return {
        name: rounded(low * exp((0.25 + 0.5 * stream.uniform(first + index)) * log(high / low)))
        for index, (name, (low, high)) in enumerate(family.bounds.items())
    }


def child(family: Family, parent: Gains, path: str, repeat: int, generation: int, number: int) -> Gains:
    """A gain set near its parent, within the bounds."""
    stream = Stream(SEED, f"gains/{family.name}/{repeat}/{path}/{generation}")
    first = number * len(family.bounds)
    return {
        name: rounded(
            min(high, max(low, parent[name] * exp(SPREADS[generation] * stream.gauss(first + index))))
        )
        for index, (name, (low, high)) in enumerate(family.bounds.items())
    }


class Task(NamedTuple):
    """A gain set from some starts under a camera: settings of the scenarios.

    `patient`: all runs are made, also after one that does not settle. `limit_cm`: once the cost is certain to be
    larger, the remaining starts are left out.
    """

    settings: tuple[str, ...]
    figures: tuple[int, ...]
    seeds: range
    patient: bool = False
    limit_cm: float = math.inf


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
        return self.settled == self.planned

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
        """The mean of some starts; a start that was left out counts nothing."""
        return cost_cm(self.drives, figures)


def cost_cm(drives: Drives, figures: Sequence[int]) -> float:
    return math.fsum(drives[figure].cost_cm for figure in figures if figure in drives) / len(figures)


def driven(task: Task) -> Drives:
    """All runs of a set. The last starts first: on the line those of Figs. 9 and 7 are harder than that of Fig. 6."""
    drives: dict[int, Drive] = {}
    for start in reversed([start for start in STARTS if start.figure in task.figures]):
        drives[start.figure] = drive_of(task, _runs(start, task))
        if cost_cm(drives, task.figures) > task.limit_cm:
            break
    return drives


class Outcome(NamedTuple):
    """Of one run: whether it settles; its error over the last second if so, else how far off it ends, in cm."""

    settled: bool
    error_cm: float


def drive_of(task: Task, outcomes: Iterable[Outcome]) -> Drive:
    """Takes runs until one does not settle, if the task is not patient."""
    settled: list[float] = []
    others: list[float] = []
    for outcome in outcomes:
        (settled if outcome.settled else others).append(outcome.error_cm)
        if others and not task.patient:
            break
    return Drive(tuple(settled), tuple(others), len(task.seeds))


@cache
def _image() -> Image:
    return load_hex(image_path())


def _runs(start: Start, task: Task) -> Iterator[Outcome]:
    scenario = load(start.proposed, settings_of(start, task)).scenario
    for seed in task.seeds:
        yield outcome_of(World(scenario, seed, _image()))


def settings_of(start: Start, task: Task) -> tuple[str, ...]:
    """Those of the start's scenario for a task."""
    return (
        f"network.robot.start_error_x_cm={start.x_cm}",
        f"network.robot.start_error_y_cm={start.y_cm}",
        f"network.robot.start_error_theta_rad={start.theta_rad}",
        *task.settings,
    )


def outcome_of(world: World) -> Outcome:
    """Errors are of the position; over the last second, root mean square."""
    squares: list[float] = []
    distance_m, inside = 0.0, 0  # periods in a row within the limits
    left = math.ceil(world.scenario.duration_s * TICKS_PER_SECOND / CONTROL_PERIOD_TICKS)
    while not world.finished:
        robot = world.step().robots[0]
        distance_m, heading_rad = _off(robot.truth, robot.reference)
        within = 100.0 * distance_m <= SETTLED_CM and heading_rad <= SETTLED_RAD
        inside = inside + 1 if within else 0
        left -= 1
        if distance_m > LOST_M or inside + left < LAST_SECOND:
            break
        squares.append(distance_m * distance_m)
    if inside < LAST_SECOND:
        return Outcome(False, 100.0 * distance_m)
    last = squares[-LAST_SECOND:]
    return Outcome(True, 100.0 * math.sqrt(math.fsum(last) / len(last)))


def _off(truth: Posture, reference: Posture) -> tuple[float, float]:
    x_m, y_m = truth.x_m - reference.x_m, truth.y_m - reference.y_m
    return math.sqrt(x_m * x_m + y_m * y_m), abs(wrap_pi(truth.theta_rad - reference.theta_rad))


class HeldOut(msgspec.Struct, frozen=True):
    """Whole runs of a set: how many, and of each that settles its errors of the last second and its chattering.

    `camera_cm`: the measurements against the reference at their exposure; not there if the camera lost the robot.
    """

    runs: int
    truth_cm: tuple[float, ...]
    camera_cm: tuple[float, ...]
    chattering_m_s2: tuple[float, ...]

    @property
    def settled(self) -> int:
        return len(self.truth_cm)

    def __add__(self, other: HeldOut) -> HeldOut:
        return HeldOut(*(getattr(self, name) + getattr(other, name) for name in self.__struct_fields__))


def held_out(task: Task) -> dict[int, HeldOut]:
    """All runs of a set, to their ends, by figure. Raises BadInput for one that cannot be made."""
    starts = [start for start in STARTS if start.figure in task.figures]
    return {start.figure: _held_out(start, task) for start in starts}


def _held_out(start: Start, task: Task) -> HeldOut:
    plan = plan_of_levels("gains", [Level(start.name, settings_of(start, task), start.proposed)], task.seeds)
    outcomes = [run_single(plan.work(run)) for run in range(plan.runs)]
    for outcome in outcomes:
        if outcome.error:
            raise BadInput("", f"run {outcome.run}", outcome.error)
    settled = [outcome.figures for outcome in outcomes if outcome.figures["settled"]]
    columns = ("rms_position_cm", "seen_position_cm", "chattering_m_s2")
    figures = (tuple(row[name] for row in settled if row[name] is not None) for name in columns)
    return HeldOut(plan.runs, *figures)


def ranked(tried: Sequence[Tried], figures: Sequence[int]) -> list[Tried]:
    """The best first. Of equals the earlier one."""
    return sorted(tried, key=lambda one: one.cost_cm(figures))


class Best(msgspec.Struct, frozen=True):
    """The set that a search came to on one path, and its runs by figure."""

    gains: dict[str, float]
    held_out: dict[int, HeldOut]

    def whole(self) -> HeldOut:
        """The runs of all figures."""
        first, *others = self.held_out.values()
        return sum(others, first)


class Found(msgspec.Struct, frozen=True):
    """What a search came to: share of explored sets that settle by figure; by path the best at each check."""

    shares: dict[int, float]
    best: dict[str, tuple[Best, Best]]
    runs: int


class Job(NamedTuple):
    """A search: names in FAMILIES and CAMERAS, its number, and what it may do."""

    family: str
    camera: str
    repeat: int
    budget: Budget = Budget()
    held_out: range = HELD_OUT


class Search:
    """One search. `drive`, `hold_out`: make the runs of a task, `driven` and `held_out`."""

    def __init__(
        self,
        job: Job,
        drive: Callable[[Task], Drives] = driven,
        hold_out: Callable[[Task], dict[int, HeldOut]] = held_out,
    ) -> None:
        self.job, self.drive, self.hold_out = job, drive, hold_out
        self.family = FAMILIES[job.family]
        self.runs = 0

    def found(self) -> Found:
        """Runs all of it."""
        sets = [drawn(self.family, self.job.repeat, number) for number in range(self.job.budget.explored)]
        explored = self._try(sets, FIGURES, search_seeds(self.job.repeat))
        shares = {
            figure: len([1 for one in explored if one.drives[figure].settles]) / len(explored)
            for figure in FIGURES
        }
        best = {path: self._best(explored, path) for path in PATHS}
        return Found(shares, best, self.runs)

    def _best(self, explored: Sequence[Tried], path: str) -> tuple[Best, Best]:
        tried = list(explored)
        self._refine(tried, path, range(GENERATIONS), self.job.budget.first)
        first = self._checked(tried, path)
        self._refine(tried, path, range(GENERATIONS, 2 * GENERATIONS), self.job.budget.second)
        return first, self._checked(tried, path, first)

    def _refine(self, tried: list[Tried], path: str, generations: range, children: int) -> None:
        figures, repeat = PATHS[path], self.job.repeat
        for generation in generations:
            parents = ranked(tried, figures)[:PARENTS]
            sets = [
                child(self.family, parents[number % len(parents)].gains, path, repeat, generation, number)
                for number in range(children)
            ]
            limit_cm = parents[-1].cost_cm(figures)  # a set that is worse is of no use
            tried += self._try(sets, figures, search_seeds(repeat), limit_cm=limit_cm)

    def _checked(self, tried: Sequence[Tried], path: str, known: Best | None = None) -> Best:
        """The best set of those tried. `known`: one that was held out before."""
        figures = PATHS[path]
        last = [one.gains for one in ranked(tried, figures)[:PARENTS]]
        checked = self._try(last, figures, check_seeds(self.job.repeat), patient=True)
        gains = dict(ranked(checked, figures)[0].gains)
        if known is not None and known.gains == gains:
            return known
        best = Best(gains, self.hold_out(self._task(gains, figures, self.job.held_out)))
        self.runs += best.whole().runs
        return best

    def _try(self, sets: Sequence[Gains], figures: tuple[int, ...], seeds: range, **how: Any) -> list[Tried]:
        """`how`: the further fields of tasks."""
        tasks = [self._task(gains, figures, seeds)._replace(**how) for gains in sets]
        tried = [Tried(gains, self.drive(task)) for gains, task in zip(sets, tasks, strict=True)]
        self.runs += sum(drive.runs for one in tried for drive in one.drives.values())
        return tried

    def _task(self, gains: Gains, figures: tuple[int, ...], seeds: range) -> Task:
        return Task((*CAMERAS[self.job.camera], self.family.settings(gains)), figures, seeds)
