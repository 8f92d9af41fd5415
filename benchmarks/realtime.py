"""How much faster than real time the built-in scenarios run, with and without recording: best of N.

    python benchmarks/realtime.py [RUNS]

One process, one core. The clock covers the loop over control periods, as `wall_s` in summary.json does. Runs with slip,
and runs with the gaussian camera, alternate with those of the scenario as it is.
"""

import io
import sys
import time
from statistics import median

from miro_exact import engine
from miro_exact.clock import seconds
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World
from mirotwin.recording.recorder import Recorder, RunSource
from mirotwin.runs import runner

VARIED = ("network.robot.drive.tyre.grip=0.8", 'camera={kind="gaussian"}')


def ratio(name: str, recorded: bool, *settings: str) -> float:
    """Simulated seconds per second of one run."""
    image = load_hex(image_path())
    text = scenario_file.load(name, settings)
    world = World(text.scenario, 0, image)
    source = RunSource(name, text.text, 0, image.path.read_bytes(), image.sha256)
    with Recorder(io.BytesIO(), source) as recorder:
        start = time.perf_counter()
        runner.run(world, recorder if recorded else None)
        elapsed = time.perf_counter() - start
    return seconds(world.tick) / elapsed


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    print(f"engine {engine.active()}, best of {runs}")
    for name in ("fig6", "fig8"):
        for recorded in (True, False):
            best = max(ratio(name, recorded) for _ in range(runs))
            print(f"{name} {'recorded' if recorded else 'bare    '} {best:6.1f} x real time")
    for setting in VARIED:
        pairs = [(ratio("fig6", False), ratio("fig6", False, setting)) for _ in range(runs)]
        share = median(varied / plain for plain, varied in pairs)
        best = max(varied for _, varied in pairs)
        print(
            f"fig6 bare, {setting}: {best:.1f} x real time, {share:.2f} of the speed without (median of pairs)"
        )


if __name__ == "__main__":
    main()
