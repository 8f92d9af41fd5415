"""What saving, loading and hashing a state cost: `python -m benchmarks.state`.

Prints CPU microseconds, the least of several rounds, and the share of a run's CPU time that its digests take.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from itertools import cycle

from miro_exact import engine
from miro_exact.state import Flat
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World

ROUNDS = 15
CALLS = 300


def least_us(call: Callable[[], object]) -> float:
    """CPU microseconds a call takes, in the quickest of several rounds."""
    rounds = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        for _ in range(CALLS):
            call()
        rounds.append(time.process_time() - begin)
    return 1e6 * min(rounds) / CALLS


def digest_share(world: World) -> float:
    """The part of a run's CPU time that is spent on the digests of its periods."""
    total = hashing = 0.0
    hashed = world.state.hashed

    def timed() -> bytes:
        nonlocal hashing
        begin = time.process_time()
        state = hashed()
        hashlib.sha256(state).digest()
        hashing += time.process_time() - begin
        return b""  # it was hashed already

    world.state.hashed = timed  # type: ignore[method-assign]
    begin = time.process_time()
    while not world.finished:
        world.step()
    total = time.process_time() - begin
    return hashing / total


def main() -> None:
    """Prints the table."""
    image = load_hex(image_path())
    scenario = scenario_file.load("fig6").scenario
    world = World(scenario, 0, image)
    world.run_to(3_000_001)
    board = Flat(world.networks[0].robots[0].board)
    state, saved = board.save(), world.save()
    print(f"engine {engine.active()}, fig6, a board of {len(state)} bytes, a saved world of {len(saved)}")
    print(f"board save    {least_us(board.save):7.2f} us")
    states, worlds = (cycle((one, bytes(bytearray(one)))) for one in (state, saved))
    print(
        f"board load    {least_us(lambda: board.load(next(states))):7.2f} us; the same bytes again: ", end=""
    )
    print(f"{least_us(lambda: board.load(state)):.2f} us")
    print(f"World state   {least_us(world.state.save):7.2f} us")
    print(f"World.save    {least_us(world.save):7.2f} us")
    print(
        f"World.load    {least_us(lambda: world.load(next(worlds))):7.2f} us; the same bytes again: ", end=""
    )
    print(f"{least_us(lambda: world.load(saved)):.2f} us")
    print(f"digests: {100 * digest_share(World(scenario, 0, image)):.1f} % of a run")


if __name__ == "__main__":
    main()
