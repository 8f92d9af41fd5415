"""Saved worlds with something changed: `python -m tests.sim.mutated_worlds --count 10000 --resealed 3000`.

What belongs here: two kinds of change, and what must come of them.

* Bytes are changed. `World.load` must refuse each of them.
* Values are changed (numbers, types, lengths, keys) and the checksum is made right again. `World.load` must refuse them
  with a ValueError, or the world must run for a control period.

Neither may crash, hang, raise anything else, or touch memory that is not its own: run it with modules that were built
with the address sanitizer (CONTRIBUTING.md).
"""

from __future__ import annotations

import argparse
import faulthandler
import random
import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

import msgspec

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import SAVE_BEGIN, World, sealed

LIMIT_S = 120
"""So long a load and a period may take; then the process ends with a traceback and exit code 1."""
SAVED_AT = (5_000, 801_000, 1_321_777, 2_500_001, 4_004_003)
SCENARIO = """
name = "mutated"
duration_s = 1.0
stop_on_fault = false

[[network]]
radio.profile = "{profile}"

[[network.robot]]
slot = 0
reference.kind = "line"

[[network.robot]]
slot = 2
reference.kind = "arc"
"""
NUMBERS = (
    0,
    1,
    -1,
    2,
    12,
    0x7F,
    0xFF,
    0x100,
    0xFFFF,
    0x10000,
    1 << 20,
    (1 << 31) - 1,
    1 << 31,
    -(1 << 31),
    1 << 32,
)
NUMBERS += (1 << 40, 1 << 54, 1 << 61, 1 << 62, (1 << 63) - 1, -(1 << 63), (1 << 64) - 1)
REALS = (0.0, -0.0, float("nan"), float("inf"), float("-inf"), 1e300, -1e300, 1e18, -1e9, 5e-324, 0.5)
OTHERS: tuple[object, ...] = (None, True, "", "x" * 50, b"", b"\x00" * 300, [], {}, {"": 0}, [[]], 0, -1, 1.5)
Node = tuple[Any, Any]
"""A dict or a list, and a key or an index of it."""


def fresh(profile: str = "wire") -> World:
    """A world of two robots at tick 0, firmware and seed always the same."""
    scenario = scenario_file.parse(SCENARIO.format(profile=profile), "mutated")
    return World(scenario, 11, load_hex(image_path()))


def saved_worlds(profile: str = "wire") -> list[bytes]:
    """One world, saved at several ticks: in the middle of characters, frames and interrupts."""
    world = fresh(profile)
    saves = []
    for tick in SAVED_AT:
        world.run_to(tick)
        saves.append(world.save())
    return saves


def with_bytes_changed(saved: bytes, draw: random.Random) -> bytes:
    """Some bytes replaced, removed or put in, or the end cut off; never what was given."""
    data = bytearray(saved)
    for _ in range(draw.choice((1, 1, 1, 2, 8))):
        place = draw.choice((draw.randrange(len(data)), draw.randrange(min(len(data), 64))))
        kind = draw.randrange(6)
        if kind < 3:
            data[place] ^= 1 << draw.randrange(8)
        elif kind == 3:
            data[place] = draw.randrange(256)
        elif kind == 4:
            data[place:place] = draw.randbytes(draw.randrange(1, 9))
        else:
            del data[place : place + draw.choice((1, 2, 100, len(data)))]
        data = data or bytearray(b"?")
    return bytes(data) if bytes(data) != saved else saved[:-1]


def with_values_changed(saved: bytes, draw: random.Random) -> bytes:
    """One to three values of the state are others; the checksum is right."""
    content = msgspec.msgpack.decode(saved[len(SAVE_BEGIN) + 32 :])
    for _ in range(draw.choice((1, 1, 2, 3))):
        nodes = _nodes(content["state"])
        if nodes:
            _change(*draw.choice(nodes), draw)
    return sealed(msgspec.msgpack.encode(content))


def _nodes(tree: Any) -> list[Node]:
    """Every place of a tree."""
    keys = list(tree) if isinstance(tree, dict) else list(range(len(tree))) if isinstance(tree, list) else []
    found: list[Node] = []
    for key in keys:
        found.append((tree, key))
        found += _nodes(tree[key])
    return found


def _change(holder: Any, key: Any, draw: random.Random) -> None:
    value = holder[key]
    if draw.random() < 0.15:
        holder[key] = draw.choice(OTHERS)
    elif draw.random() < 0.05 and isinstance(holder, dict):
        holder[draw.choice(("", "x", "restore", "snapshot", "ticks", "commands"))] = holder.pop(key)
    elif draw.random() < 0.05:
        del holder[key]
    elif isinstance(value, bool):
        holder[key] = not value
    elif isinstance(value, int):
        near = value + draw.choice((1, -1, 7, -7, 1000, -1000, 1 << draw.randrange(62)))
        holder[key] = draw.choice((draw.choice(NUMBERS), max(-(1 << 63), min(near, (1 << 64) - 1))))
    elif isinstance(value, float):
        holder[key] = draw.choice((draw.choice(REALS), value * draw.choice((-1.0, 1.001, 1e3, 1e9))))
    elif isinstance(value, bytes):
        short = value[: draw.randrange(len(value) + 1)]
        holder[key] = draw.choice(
            (b"", short, value + b"\xff", value * 9, bytes(100_000), draw.randbytes(len(value)))
        )
    elif isinstance(value, list):
        item = value[-1] if value else draw.choice((0, [0, 0, 0], None))
        longer = [*value, *[item] * draw.choice((1, 5000))]
        many = [*range(200_000)]
        holder[key] = draw.choice(([], value[:-1], longer, value[::-1], [*value, *value], many))
    else:
        holder[key] = draw.choice(OTHERS)


def outcome(world: World, saved: bytes) -> str:
    """`refused`, `ran`, or what was raised that must not be."""
    try:
        world.load(saved)
    except ValueError as error:
        line = str(error)
        known = line.startswith(("not a saved world: ", "saved world has ")) and "\n" not in line
        return "refused" if known and len(line) < 300 else f"said {line!r}"
    except Exception as error:
        return f"load raised {error!r}"
    try:
        world.run_to(world.tick + CONTROL_PERIOD_TICKS)
        world.save()
    except Exception as error:
        return f"run raised {error!r}"
    return "ran"


def changed_bytes(count: int, seed: int, progress: Callable[[int], object]) -> Counter[str]:
    """What came of so many worlds with bytes changed."""
    world = fresh()
    saves = saved_worlds()
    found: Counter[str] = Counter()
    for number in range(count):
        draw = random.Random(seed * 1_000_003 + number)
        faulthandler.dump_traceback_later(LIMIT_S, exit=True)
        found[outcome(world, with_bytes_changed(draw.choice(saves), draw))] += 1
        progress(number)
    faulthandler.cancel_dump_traceback_later()
    return found


def changed_values(count: int, seed: int, progress: Callable[[int], object]) -> Counter[str]:
    """What came of so many worlds with values changed and a checksum that is right."""
    profiles = ("wire", "shared")
    saves = {profile: saved_worlds(profile) for profile in profiles}
    worlds = {profile: fresh(profile) for profile in profiles}
    found: Counter[str] = Counter()
    for number in range(count):
        draw = random.Random(seed * 1_000_003 + number)
        profile = draw.choice(profiles)
        faulthandler.dump_traceback_later(LIMIT_S, exit=True)
        what = outcome(worlds[profile], with_values_changed(draw.choice(saves[profile]), draw))
        found[what if what in ("refused", "ran") else f"number {number}: {what}"] += 1
        if what not in ("refused", "ran"):
            worlds[profile] = fresh(profile)
        progress(number)
    faulthandler.cancel_dump_traceback_later()
    return found


def main() -> int:
    """Prints what came of them; exit code 1 when it is not what must be."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000, help="worlds with bytes changed")
    parser.add_argument(
        "--resealed", type=int, default=0, help="worlds with values changed and the checksum right"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the changes")
    options = parser.parse_args()

    def progress(number: int) -> None:
        print(f"\r{number} ", end="", file=sys.stderr, flush=True)

    bytes_found = changed_bytes(options.count, options.seed, progress)
    values_found = changed_values(options.resealed, options.seed, progress)
    print(f"\nbytes changed: {dict(bytes_found)}\nvalues changed: {dict(values_found)}")
    return 0 if set(bytes_found) <= {"refused"} and set(values_found) <= {"refused", "ran"} else 1


if __name__ == "__main__":
    sys.exit(main())
