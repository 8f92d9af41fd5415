"""Any part on its bench, moved in any way: edges of its pins, what a test may put, waits.

`digest` is for comparing engines:
`python -m tests.robot.parts.any_edges ENGINE SEED STEPS NAME..` prints the digest of all states of each part.
"""

import hashlib
import random
import sys

import msgspec

from miro_exact import engine

WAITS = (1, 2, 24, 360, 720, 1440, 11_520, 24_000, 120_000, 480_000, 20_000_000)
"""Ticks of 24 MHz: microseconds, slots of a one-wire bus, milliseconds, most of a second."""


def made(name, seed=0):
    """The bench, and the nets that a test drives."""
    from miro_sim.scenario.parts import PARTS
    from tests.robot.parts.bench import Bench  # hot modules: not before the engine was chosen

    keys = PARTS.find(name)()
    nets = {pin.name: pin.name for pin in keys.PINS if pin.name != "body"}  # of a car, which is no net
    driven = [name for number, name in enumerate(nets) if keys.pin_kind(number) != 1]  # STRONG
    return Bench({"chip": (keys, nets)}, driven, 24_000_000, seed), driven


def values(kind, draw):
    """A value of a type in PUTS."""
    info = msgspec.inspect.type_info(kind)
    if isinstance(info, msgspec.inspect.LiteralType):
        return draw.choice(info.values)
    if isinstance(info, msgspec.inspect.BoolType):
        return draw.random() < 0.5
    if isinstance(info, msgspec.inspect.StrType):
        return "".join(draw.choice("0123456789abcdef") for _ in range(2 * draw.randrange(9)))
    low, high = (bound if bound is not None else other for bound, other in ((info.ge, -9), (info.le, 9)))
    value = draw.choice((low, high, draw.uniform(low, high)))
    return int(value) if isinstance(info, msgspec.inspect.IntType) else float(value)


def step(board, driven, draw):
    """One thing that happens to the part, and what is seen of it then."""
    keys = board.named["chip"].keys
    board.run(board.tick + draw.choice(WAITS))
    what = draw.random()
    if what < 0.1 and keys.PUTS:
        key = draw.choice(sorted(keys.PUTS))
        board.put(f"chip.{key}", values(keys.PUTS[key], draw))
    elif what < 0.12:
        board.power(draw.randrange(2))
    else:
        some = draw.sample(driven, min(len(driven), draw.randint(1, 3)))
        board.drive_all({net: draw.choice((0, 0, 1, None)) for net in some})
    return [board.read(f"chip.{key}") for key in keys.READS]


def digest(name, seed, count):
    board, driven = made(name, seed)
    draw = random.Random(seed)
    seen = hashlib.sha256()
    for _ in range(count):
        reads = step(board, driven, draw)
        seen.update(board.save() + repr((board.tick, reads, board.nets.levels[: board.nets.count])).encode())
    return seen.hexdigest()


if __name__ == "__main__":
    engine.select(sys.argv[1])
    print(engine.active(), *(digest(name, int(sys.argv[2]), int(sys.argv[3])) for name in sys.argv[4:]))
