"""Slicer noise and no host, through the real firmware, for MINUTES of virtual time.

    python -m tests.sim.radio.noise [MINUTES]

An hour at the symbol level is `python -m benchmarks.undetected noise`.
"""

import sys

from miro_sim.world.world import World
from mirotwin.conform.probe import Listening
from mirotwin.runs.spec import silent_scenario
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.verify.checks.monitors import Checks


def listen(seconds, robots, seed=0):
    """How many characters a robot hears, and what its firmware counts: frames accepted, rejected and stale."""
    radio = 'network.radio={carrier = "keyed", bit_error_rate = 0.0, squelch = false}'
    scenario = silent_scenario((f"network.robots={robots}", radio, f"duration_s={seconds}"))
    world = World(scenario, seed, load_firmware())
    (monitor,) = Checks(world, {(0, 0): [Listening()]}).monitors
    while not world.finished:
        robot = world.step().robots[0]
    heard = [event for event in monitor.observed.events if event.what == "received"]
    return len(heard), (robot.accepted, robot.rejected, robot.stale)


if __name__ == "__main__":
    minutes = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for robots in (3, 5):
        heard, counted = listen(60 * minutes, robots)
        print(f"N={robots}: {minutes} min, {heard} characters, (accepted, rejected, stale) {counted}")
