"""Prints what the paper's theory says of whole runs: f against P, the assumptions, direction, chattering.

    python -m tests.sim.theory_in_the_loop [--seeds 10]

Medians over seeds from 0; for each |f_i| the root mean square over a run.
"""

import argparse
import math
import statistics
from functools import cache
from itertools import pairwise
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from mirotwin.recording.theory.figures import gains_of, theory_of
from mirotwin.recording.theory.track import PERIOD_S
from mirotwin.recording.track import Tracks
from tests.sim.world.rig import world_of

CONTROLLER = "network.robot.controller"
BODY = [f'{CONTROLLER}={{law="body_frame"}}', 'network.robot.estimator={kind="predict"}']
RUNS = {
    "fig6": ("fig6", []),
    "fig6, sign functions": ("fig6", [f'{CONTROLLER}.switching="sign"']),
    "fig7": ("fig7", []),
    "fig8": ("fig8", []),
    "fig6, body_frame and predict": ("fig6", BODY),
    "fig8, body_frame and predict": ("fig8", BODY),
}
COLUMNS = (
    *("run", "f1 rms, m/s2", "|f1| > P1; > P1 |sat s1|"),
    *("f2 rms, rad/s2", "|f2| > P2; > P2 |sat s2|"),
    *("frames near across / crossings", "reversals / backward", "chattering, m/s2"),
)


def run(name, seed):
    """The theory of a run, and the rms of f1 and f2 if commands are compared with the motion a period later."""
    scenario, settings = RUNS[name]
    world, tracks, robots = world_of(scenario, *settings, seed=seed), Tracks(), []
    while not world.finished:
        period = world.step()
        tracks.add(period)
        robots.append(period.robots[0])
    commands = [(0.0, 0.0)] + [(robot.control.v_m_s, robot.control.w_rad_s) for robot in robots]
    speeds = [(robot.v_m_s, robot.w_rad_s) for robot in robots[1:]]
    late = []
    for axis in (0, 1):
        squares = []
        for (before, command), (first, second) in zip(pairwise(commands), pairwise(speeds), strict=False):
            f = (command[axis] - before[axis] - second[axis] + first[axis]) / PERIOD_S
            squares.append(f * f)
        late.append(math.sqrt(math.fsum(squares) / len(squares)))
    return theory_of(tracks.robots[0, 0].theory, gains_of(world.scenario)[0, 0]), late


class Medians(NamedTuple):
    """Of the runs of one kind. Shares of frames are 0 to 1, None for a law without P."""

    f1_m_s2: float
    f1_late_m_s2: float
    f2_rad_s2: float
    f2_late_rad_s2: float
    p1_m_s2: float | None
    p2_rad_s2: float | None
    f1_above_p1: float | None
    f1_above_authority: float | None
    f2_above_p2: float | None
    f2_above_authority: float | None
    near: float
    crossings: float
    reversals: float
    backward_s: float
    chattering_m_s2: float


@cache
def medians(name, seeds):
    """Medians of the runs of one kind."""
    found = [run(name, seed) for seed in range(seeds)]

    def median(value):
        values = [value(theory, late) for theory, late in found]
        return None if None in values else statistics.median(values)

    def of_disturbance(name):
        return median(lambda theory, _: getattr(theory.disturbance, name))

    return Medians(
        f1_m_s2=of_disturbance("f1_rms_m_s2"),
        f1_late_m_s2=median(lambda _, late: late[0]),
        f2_rad_s2=of_disturbance("f2_rms_rad_s2"),
        f2_late_rad_s2=median(lambda _, late: late[1]),
        p1_m_s2=found[0][0].disturbance.p1_m_s2,
        p2_rad_s2=found[0][0].disturbance.p2_rad_s2,
        **{one: of_disturbance(one) for one in Medians._fields[6:10]},
        near=median(lambda theory, _: theory.assumption_3.frames),
        crossings=median(lambda theory, _: theory.assumption_3.crossings),
        reversals=median(lambda theory, _: theory.reversals),
        backward_s=median(lambda theory, _: theory.backward_s),
        chattering_m_s2=median(lambda theory, _: theory.chattering_m_s2),
    )


def row(name, seeds):
    """The cells of the table."""
    m = medians(name, seeds)

    def above(p, alone, left):
        """Above the gain, and above what the layer leaves of it; a dash for a law that has none."""
        return "-" if alone is None else f"{100 * alone:.0f} % of {p:g}; {100 * left:.0f} %"

    return (
        name,
        f"{m.f1_m_s2:.3f} ({m.f1_late_m_s2:.3f})",
        above(m.p1_m_s2, m.f1_above_p1, m.f1_above_authority),
        f"{m.f2_rad_s2:.2f} ({m.f2_late_rad_s2:.2f})",
        above(m.p2_rad_s2, m.f2_above_p2, m.f2_above_authority),
        f"{m.near:g} / {m.crossings:g}",
        f"{m.reversals:g} / {m.backward_s:.2f} s",
        f"{m.chattering_m_s2:.3f}",
    )


def main():
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--seeds", type=int, default=10)
    seeds = arguments.parse_args().seeds
    table = Table(*COLUMNS, box=None, pad_edge=False)
    for name in RUNS:
        table.add_row(*row(name, seeds))
    Console(width=200).print(table)


if __name__ == "__main__":
    main()
