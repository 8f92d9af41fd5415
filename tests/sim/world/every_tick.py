"""Worlds saved at every tick of a window, and run on: `python -m tests.sim.world.every_tick --window-ms 2`."""

import argparse
import random
import sys

from miro_exact.clock import CONTROL_PERIOD_TICKS, ticks
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World

SETTINGS = ("duration_s=1.0", "network.radio.profile=lossy")


def differing(first_tick, count, seed, image, progress=lambda tick: None):
    """The ticks at which a world that is saved and goes on in another one does not end as one that never stopped."""

    def fresh():
        return World(load("fig6", SETTINGS).scenario, seed, image)

    end_tick = (first_tick + count) // CONTROL_PERIOD_TICKS * CONTROL_PERIOD_TICKS + CONTROL_PERIOD_TICKS
    whole, stopping, other = fresh(), fresh(), fresh()
    whole.run_to(end_tick)
    found = []
    for tick in range(first_tick, first_tick + count):
        stopping.run_to(tick)
        other.load(stopping.save())
        other.run_to(end_tick)
        if other.digest != whole.digest:
            found.append(tick)
        progress(tick)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--window-ms", type=float, default=2.0)
    parser.add_argument("--seed", type=int, default=7, help="of the world, and of where the window is")
    given = parser.parse_args()
    count = ticks(given.window_ms / 1000.0)
    first_tick = random.Random(given.seed).randrange(ticks(0.9))

    def progress(tick):
        if tick % 100 == 0 or tick == first_tick + count - 1:
            print(f"\r{tick - first_tick + 1} of {count} ticks  ", end="", file=sys.stderr, flush=True)

    found = differing(first_tick, count, given.seed, load_hex(image_path()), progress)
    print(file=sys.stderr)
    print(f"ticks {first_tick} to {first_tick + count - 1}: {len(found)} differ {found[:10] or ''}")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
