"""Runs that are cut anywhere, beside the same run that is not: `python -m tests.sim.world.random_cuts --count 10000`.

`--window-ms 2` saves a world at every tick of a random window instead, and goes on from there.

Input that is announced early keeps a frame of the station off the air which late input would meet, so only a silent
host is told at random moments; a controller is told everything at the begin.
"""

import argparse
import random
import sys

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, ticks
from miro_protocol.frames import TeamFrame, encode
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load, parse
from miro_sim.world.world import World

PERIODS = 12
CUTS, INJECTIONS = 40, 10
"""Of one run."""
SCENARIO = """
name = "cuts"
duration_s = 0.5
stop_on_fault = false

[[network]]
host = "{host}"
radio.profile = "{profile}"

[[network.robot]]
slot = 0
reference.kind = "line"

[[network.robot]]
slot = 2
reference.kind = "arc"
"""
HOSTS, PROFILES = ("silent", "controller"), ("wire", "late", "fade10", "slicer", "lossy")


def drawn_input(draw):
    """(tick, characters) that do not overlap: frames, half of them with something else in front, and garbage."""
    found, tick = [], 100_000
    for seq in range(INJECTIONS):
        frame = encode(TeamFrame(0, seq, tuple((draw.randrange(-900, 900),) * 2 for _ in range(3))), 3)
        data = draw.choice((frame, draw.randbytes(3) + frame, draw.randbytes(draw.randrange(1, 40))))
        found.append((tick, data))
        tick += len(data) * HOST_CHARACTER_TICKS + draw.randrange(1, 900_000)
    return [(tick, data) for tick, data in found if tick < (PERIODS - 2) * CONTROL_PERIOD_TICKS]


def told(world, tick, data):
    """Injects what the transmitter can send then."""
    try:
        world.inject(data, at_tick=tick)
    except ValueError:  # into a frame of the station
        assert world.scenario.networks[0].host == "controller"


def in_one_piece(world, sent):
    """The digest of a run that is told everything at its start."""
    for tick, data in sent:
        told(world, tick, data)
    world.run_to(PERIODS * CONTROL_PERIOD_TICKS)
    return world.digest


def in_pieces(fresh, sent, draw):
    """The same run, stopped `CUTS` times, sometimes saved and gone on with in another world."""
    world = fresh()
    early = world.scenario.networks[0].host == "controller"
    at = {tick: 0 if early else draw.randrange(max(1, tick - 60_000)) for tick, _ in sent}
    stops = sorted({draw.randrange(PERIODS * CONTROL_PERIOD_TICKS) for _ in range(CUTS)} | set(at.values()))
    for stop in stops:
        world.run_to(stop)
        for tick, data in sent:
            if at[tick] == stop:
                told(world, tick, data)
        if draw.random() < 0.1:
            saved, world = world.save(), fresh()
            world.load(saved)
    world.run_to(PERIODS * CONTROL_PERIOD_TICKS)
    return world.digest


def differing(count, seed, image, progress):
    """Runs whose digests differ, among as many as have `count` stops and injections together."""
    found, done, number = [], 0, 0
    while done < count:
        draw = random.Random(seed * 1_000_003 + number)
        host, profile = draw.choice(HOSTS), draw.choice(PROFILES)
        scenario = parse(SCENARIO.format(host=host, profile=profile), "cuts")

        def fresh(scenario=scenario, number=number):
            return World(scenario, number, image)

        sent = drawn_input(draw)
        if in_one_piece(fresh(), sent) != in_pieces(fresh, sent, draw):
            found.append(f"run {number}: {host}, {profile}")
        done += CUTS + len(sent)
        number += 1
        progress(done)
    return found


def differing_ticks(first_tick, count, seed, image, progress=lambda done: None):
    """The ticks at which a world that is saved and goes on in another one does not end as one that never stopped."""
    scenario = load("fig6", ("duration_s=1.0", "network.radio.profile=lossy")).scenario
    end_tick = ((first_tick + count) // CONTROL_PERIOD_TICKS + 1) * CONTROL_PERIOD_TICKS
    whole, stopping, other = (World(scenario, seed, image) for _ in range(3))
    whole.run_to(end_tick)
    found = []
    for tick in range(first_tick, first_tick + count):
        stopping.run_to(tick)
        other.load(stopping.save())
        other.run_to(end_tick)
        if other.digest != whole.digest:
            found.append(f"tick {tick}")
        progress(tick - first_tick + 1)
    return found


def main():
    """Prints what differs; exit code 1 if anything does."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000, help="stops and injections together")
    parser.add_argument("--window-ms", type=float, help="save at every tick of a window of this length")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    image = load_hex(image_path())

    def progress(done):
        print(f"\r{done} ", end="", file=sys.stderr, flush=True)

    if options.window_ms:
        first_tick, count = random.Random(options.seed).randrange(ticks(0.9)), ticks(options.window_ms / 1000)
        what = f"{count} stops from tick {first_tick} on"
        found = differing_ticks(first_tick, count, options.seed, image, progress)
    else:
        what = f"{options.count} stops and injections"
        found = differing(options.count, options.seed, image, progress)
    print(file=sys.stderr)
    print("\n".join(found) or f"{what}: every digest is that of the run in one piece")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
