"""What law and estimator cost: processor time of the loop with ours beside that of the loop with the paper's.

    python -m benchmarks.chain [--pairs 15] [--scenario fig6] [--law body_frame] [--estimator ekf]

Both loops run in one process, in turn and each period by period, so that whatever else the machine does meets both
alike. A pair's figure is the time that ours takes longer, as a share of the time of the paper's. Given are the median
and the quartiles over the pairs, and the time of a period.
"""

from __future__ import annotations

import argparse
import sys
import time
from statistics import median, quantiles

from miro_exact import engine
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World

LARGEST_SHARE = 0.05


def world(scenario: str, law: str, estimator: str, image: Image) -> World:
    """A run of the scenario with other parts, each with its defaults."""
    sets = (
        f'network.robot.controller={{law="{law}"}}',
        f'network.robot.estimator={{kind="{estimator}"}}',
    )
    if law == "yang_kim":
        sets = sets[1:]
    return World(scenario_file.load(scenario, sets).scenario, 0, image)


def pair(one: World, other: World) -> tuple[float, float, int]:
    """Processor seconds of both runs, and how many periods they have."""
    spent = [0.0, 0.0]
    periods = 0
    while not one.finished:
        for index in ((0, 1), (1, 0))[periods % 2]:
            begin = time.process_time()
            (one, other)[index].step()
            spent[index] += time.process_time() - begin
        periods += 1
    return spent[0], spent[1], periods


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--scenario", default="fig6")
    parser.add_argument("--law", default="body_frame")
    parser.add_argument("--estimator", default="ekf")
    asked = parser.parse_args()
    if engine.active() != "compiled":
        sys.exit("the compiled modules are missing: " + engine.REMEDY)
    image = load_hex(image_path())
    shares, period_s = [], []
    for _ in range(asked.pairs + 1):  # the first one warms up
        plain, ours, periods = pair(
            world(asked.scenario, "yang_kim", "none", image),
            world(asked.scenario, asked.law, asked.estimator, image),
        )
        shares.append(ours / plain - 1.0)
        period_s.append(plain / periods)
    low, _, high = quantiles(shares[1:], n=4)
    print(f"{asked.scenario}: a period of the paper's loop takes {1e3 * median(period_s[1:]):.3f} ms")
    share = median(shares[1:])
    print(f"{asked.law} and {asked.estimator}: {100 * share:+.1f} % ({100 * low:+.1f} to {100 * high:+.1f})")
    if share > LARGEST_SHARE:
        sys.exit(f"more than {100 * LARGEST_SHARE:.0f} %")


if __name__ == "__main__":
    main()
