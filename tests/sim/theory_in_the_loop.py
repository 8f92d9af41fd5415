"""Prints what the paper's theory says of whole runs: f against P, the assumptions, direction, chattering.

    python -m tests.sim.theory_in_the_loop [--seeds 10]

Medians over seeds from 0; for each |f_i| the root mean square over a run.
"""

import argparse
import math
import statistics
from itertools import pairwise

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
    *("run", "f1 m/s2 (a period later)", "P1: |f1| above / above P1 |sat s1|"),
    *("f2 rad/s2 (..)", "P2: |f2| above / above P2 |sat s2|"),
    *("near / across", "reversals / back", "chattering m/s2"),
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


def of_disturbance(name):
    """A figure of f."""
    return lambda theory, _: getattr(theory.disturbance, name)


def row(name, seeds):
    """The cells of the table."""
    found = [run(name, seed) for seed in range(seeds)]

    def median(value):
        return statistics.median(value(theory, late) for theory, late in found)

    def shares(*names):
        """Above the gain / above what the layer leaves of it; a dash for a law that has none."""
        if getattr(found[0][0].disturbance, names[0]) is None:
            return "-"
        return " / ".join(f"{100 * median(of_disturbance(name)):.0f} %" for name in names)

    return (
        name,
        f"{median(lambda t, _: t.disturbance.f1_rms_m_s2):.3f} ({median(lambda _, late: late[0]):.3f})",
        f"{found[0][0].disturbance.p1_m_s2 or 0:g}: {shares('f1_above_p1', 'f1_above_authority')}",
        f"{median(lambda t, _: t.disturbance.f2_rms_rad_s2):.2f} ({median(lambda _, late: late[1]):.2f})",
        f"{found[0][0].disturbance.p2_rad_s2 or 0:g}: {shares('f2_above_p2', 'f2_above_authority')}",
        f"{median(lambda t, _: t.assumption_3.frames):g} / {median(lambda t, _: t.assumption_3.crossings):g}",
        f"{median(lambda t, _: t.reversals):g} / {median(lambda t, _: t.backward_s):.2f} s",
        f"{median(lambda t, _: t.chattering_m_s2):.3f}",
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
