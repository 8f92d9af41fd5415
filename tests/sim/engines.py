"""Compiled and uncompiled in lockstep on the real firmware: `python -m tests.sim.engines --instructions 1000000`.

Only instructions that were executed count: the firmware sleeps most of the time. A scenario that ends goes on with
the next seed.
"""

import argparse
import hashlib
import itertools
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

from miro_exact import engine
from tests import children

STRIDE_TICKS = 100_003
"""Between checkpoints, 4 ms: eight a control period, and never at the same place of one."""
ROOT = Path(__file__).parents[2]


class Checkpoint(NamedTuple):
    """What a world was at a tick; counts are since the first world's begin."""

    seed: int
    tick: int
    instructions: int
    frames: int  # accepted by the firmware
    commands: int  # completed by both LM629
    sent: int  # bytes that the robot put on its TXD
    sha256: str

    def line(self):
        return " ".join(str(field) for field in self)


def parse(line):
    *numbers, sha256 = line.split()
    return Checkpoint(*map(int, numbers), sha256)


def run(instructions, scenario):
    """Worlds of seed 0, 1, .. in this process's engine, until so many instructions were executed."""
    from miro_robot.firmware import image_path
    from miro_robot.image import load_hex
    from miro_sim.scenario import file as scenario_file
    from miro_sim.world.world import World

    image = load_hex(image_path())
    read = scenario_file.load(scenario).scenario
    done, frames, commands, sent = 0, 0, 0, 0
    for seed in itertools.count():
        world = World(read, seed, image)
        robot = world.networks[0].robots[0]
        tick, executed, accepted = 0, 0, 0
        period = -1
        while not world.finished and done + executed < instructions:
            tick += STRIDE_TICKS
            world.run_to(tick)
            if world.index != period and world.last is not None:
                period, last = world.index, world.last.robots[0]
                commands += len(last.left.commands) + len(last.right.commands)
                sent += sum(len(run.data) for run in world.last.wire if run.direction == "<")
            executed = robot.board.cpu.instructions
            accepted = robot.counter(0) or 0
            sha256 = hashlib.sha256(world.state.save()).hexdigest()
            yield Checkpoint(seed, tick, done + executed, frames + accepted, commands, sent, sha256)
        done += executed
        frames += accepted
        if done >= instructions:
            return


def compare(compiled, python):
    """The checkpoints that both print alike. Raises AssertionError at the first that differs."""
    for ours, theirs in itertools.zip_longest(compiled, python):
        assert ours == theirs, f"the engines part:\ncompiled {ours}python   {theirs}"
        yield parse(ours)


def lockstep(instructions, scenario="fig6"):
    """Both engines over so many instructions. Raises AssertionError where they part, or when one of them fails."""
    command = [sys.executable, "-m", "tests.sim.engines", "--scenario", scenario]
    command += ["--instructions", str(instructions), "--engine"]
    pair = [
        children.start([*command, name], stdout=subprocess.PIPE, text=True, cwd=ROOT)
        for name in engine.ENGINES
    ]
    try:
        yield from compare(pair[0].stdout, pair[1].stdout)
        assert [process.wait() for process in pair] == [0, 0]
    finally:
        for process in pair:
            process.kill()
            process.wait()


def main():
    """Prints figures; exit code 1 if the engines part."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--instructions", type=int, default=1_000_000, help="to execute, at least")
    parser.add_argument("--scenario", default="fig6", help="built-in scenario or file")
    parser.add_argument("--engine", choices=engine.ENGINES, help="print this engine's checkpoints only")
    options = parser.parse_args()
    if options.engine:
        engine.select(options.engine)
        for checkpoint in run(options.instructions, options.scenario):
            print(checkpoint.line(), flush=True)
        return 0
    begin = time.monotonic()
    count, last = 0, None
    try:
        for last in lockstep(options.instructions, options.scenario):
            count += 1
            if count % 20 == 0:
                shown = f"\r{last.instructions} of {options.instructions} instructions "
                print(shown, end="", file=sys.stderr, flush=True)
    except AssertionError as error:
        print(f"\n{error}")
        return 1
    print(file=sys.stderr)
    print(
        f"{options.scenario}: equal state hashes at {count} checkpoints over {last.instructions} instructions, "
        f"{last.frames} frames accepted, {last.commands} LM629 commands, {last.sent} bytes sent, "
        f"{time.monotonic() - begin:.0f} s"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
