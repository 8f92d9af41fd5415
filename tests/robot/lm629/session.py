"""A long mixed session that depends on nothing but a number, for comparing engines and snapshots.

`python -m tests.robot.lm629.session ENGINE SEED STEPS` prints the digest of everything the session saw.
"""

import hashlib
import random
import sys

from miro_exact import engine


def steps(seed, count):
    """(kind, a, b, c, d): what the session does, one step after the other."""
    draw = random.Random(seed)
    return [tuple(draw.getrandbits(32) for _ in range(5)) for _ in range(count)]


def play(bench, step):
    """One step on a `Bench`."""
    kind, a, b, c, d = step
    running = bench.chip.mode == 2
    kind %= 10
    if kind == 0 and running:
        bench.start(0x002A | (a & 0x1801), b % 0x20000, c % 0x100000, d % 2000 - 1000, samples=0)
    elif kind == 1 and running:
        bench.start(0x0828 | (a & 0x1000), 0x4000, c % 0x80000, samples=0)
    elif kind == 2 and running:
        bench.filter(a % 200, b % 200, c % 400, d % 0x8000, a % 3)
    elif kind == 3 and running:
        bench.start((0, 0x100, 0x200, 0x400)[a % 4], samples=0)
    elif kind == 4:
        bench.write(a % 2, b % 256)
    elif kind == 5:
        bench.read(a % 2)
    elif kind == 6 and running:
        bench.command(("MSKI", "RSTI", "LPES", "LPEI")[a % 4], b % 128)
    elif kind == 7:
        bench.turn(a % 100 if b % 3 else -(a % 100), 20 + c % 60)
    elif kind == 8:
        bench.chip.set_index(bench.tick, a % 2)
        if running and b % 4 == 0:
            bench.command("SIP")
    else:
        bench.wait(a % 60000)


def digest(seed, count):
    from tests.robot.lm629.bench import Bench
    from tests.states import snapshot  # a hot module: not before the engine was chosen

    bench = Bench()
    bench.chip.set_encoder(0, 0, 0)
    bench.reset()
    seen = hashlib.sha256()
    for step in steps(seed, count):
        if bench.chip.mode == 0:
            bench.reset()
        play(bench, step)
        seen.update(repr((bench.tick, snapshot(bench.chip))).encode())
    seen.update(repr((bench.edges, bench.chip.commands)).encode())
    return seen.hexdigest()


if __name__ == "__main__":
    engine.select(sys.argv[1])
    print(engine.active(), digest(int(sys.argv[2]), int(sys.argv[3])))
