"""What checks cost: processor time of the loop with them beside that of the loop without.

    python -m benchmarks.checks [--pairs 15] [--scenario fig6]

Measured are those that are always on (limit: 3 %) and then all of ours, whose judges read every event of the logs.
Both loops of a pair run in one process, in turn and each period by period (`benchmarks.chain.pair`).
"""

from __future__ import annotations

import argparse
import sys
from statistics import median, quantiles

from benchmarks.chain import pair
from miro_exact import engine
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World
from mirotwin.verify.checks.monitors import Checks

LARGEST_SHARE = 0.03
ALL = (
    *("failsafe_stop_ms=true", "motors_off_ms=true", "moves_only_when_fresh=true", "accepts_only_sent=true"),
    *(
        "acts_within_ms=true",
        "back_in_sync_within_ms=true",
        "frames_accepted_min=1",
        "answers_within_ms=true",
    ),
    *("answers_only_in_turn=true", "wheels_within_m_s=1.5", "tracks_within_cm=100.0", "settles_within_s=1.0"),
    "inside_pitch=true",
)


def shares(scenario: str, sets: tuple[str, ...], pairs: int, image: Image) -> list[float]:
    """What the checks of a scenario with these settings take longer, as a share of the loop without."""
    found = []
    for _ in range(pairs + 1):  # the first one warms up
        plain, watched = (World(scenario_file.load(scenario, sets).scenario, 0, image) for _ in range(2))
        checks = Checks(watched)
        without, with_checks, _ = pair(plain, watched)
        checks.finish()
        assert plain.digest == watched.digest
        found.append(with_checks / without - 1.0)
    return found[1:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--scenario", default="fig6")
    asked = parser.parse_args()
    if engine.active() != "compiled":
        sys.exit("the compiled modules are missing: " + engine.REMEDY)
    image = load_hex(image_path())
    always = shares(asked.scenario, ("expect={}",), asked.pairs, image)
    everything = shares(asked.scenario, tuple(f"expect.{one}" for one in ALL), asked.pairs, image)
    for name, found in (("those that are always on", always), ("all of ours", everything)):
        low, _, high = quantiles(found, n=4)
        share = 100 * median(found)
        print(f"{asked.scenario}: {name}: {share:+.1f} % ({100 * low:+.1f} to {100 * high:+.1f})")
    if median(always) > LARGEST_SHARE:
        sys.exit(f"more than {100 * LARGEST_SHARE:.0f} %")


if __name__ == "__main__":
    main()
