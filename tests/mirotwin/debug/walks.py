"""Random walks through a run: at each stop the state has to be that of a run that never stopped.

`python -m tests.mirotwin.debug.walks --steps 10000`; the tests walk a part of it.
"""

import argparse
import random
import sys
import time

from miro_exact.clock import CYCLE_TICKS
from tests.mirotwin.debug.runs import SECOND, debugger_of, golden_digest, robot_run

MOVES = ("go", "back", "into", "over", "out", "instruction", "goto", "near", "break")


def walk(debugger, steps, end_tick, seed):
    """(tick, state) of each stop of a walk forward and back, with breakpoints that come and go."""
    chance = random.Random(seed)
    timeline, places = debugger.timeline, sorted(debugger.symbols.line_begins)
    for _ in range(steps):
        move, back = chance.choice(MOVES), chance.random() < 0.6 or timeline.tick >= end_tick
        if move == "break":
            debugger.breakpoints.clear()
            address = chance.choice(places)
            debugger.add("one", [address], chance.choice(["", "R7 > 3", "tick % 7 == 0"]))
        elif move in ("go", "back"):
            debugger.go_on(back=move == "back")
        elif move in ("goto", "near"):
            far = (
                chance.randrange(end_tick)
                if move == "goto"
                else timeline.tick + chance.randrange(-50_000, 50_000)
            )
            debugger.go_to(min(max(far, 0), end_tick))
        elif move == "instruction":
            debugger.step(chance.choice(["into", "over"]), back, by_instruction=True)
        elif move != "out" or len(debugger.frames()) > 1:
            debugger.step(move, back)
        yield timeline.tick, timeline.state()


RESET_ENDS = range(35_280, 35_592)
"""The chips' HI after their first reset: when the processor is told of it depends on how a run is cut."""


def differences(stops, unbroken):
    """The ticks of stops whose state a run that goes straight on does not have."""
    found = []
    for tick, state in sorted(stop for stop in stops if stop[0] not in RESET_ENDS):
        unbroken.to(tick)
        if unbroken.world.state.save() != state:
            found.append(tick)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    debugger = debugger_of(robot_run())
    begun = time.process_time()
    stops = list(walk(debugger, given.steps, 2 * SECOND, given.seed))
    spent = time.process_time() - begun
    wrong = differences(stops, robot_run())
    debugger.go_to(debugger.timeline.run.end_tick)
    golden = debugger.timeline.run.world.digest == golden_digest("fig6 6 s seed 7")
    print(f"{given.steps} steps in {spent:.1f} s, {len({tick for tick, _ in stops})} moments")
    print(f"{len(wrong)} states differ; the digest at the end is {'the golden one' if golden else 'another'}")
    print(f"last cycle {debugger.timeline.tick // CYCLE_TICKS}, {debugger.timeline.kept_bytes} bytes kept")
    return 1 if wrong or not golden else 0


if __name__ == "__main__":
    sys.exit(main())
