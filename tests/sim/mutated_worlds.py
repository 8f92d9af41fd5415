"""Saved worlds with something changed: `python -m tests.sim.mutated_worlds --count 10000 --resealed 10000`.

* Bytes are changed. `World.load` must refuse each of them.
* Values of the state are changed (numbers, lengths, counts) and the checksum is made right again. `World.load` must
  refuse them with a ValueError and leave the world as it was, or the world must run for a control period.

Neither may crash, hang, raise anything else, or touch memory that is not its own: run it with modules that were built
with the address sanitizer (docs/commands.md).
"""

import argparse
import faulthandler
import random
import struct
import sys
from collections import Counter

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_sim.world.saved import opened, sealed
from tests.sim.world.rig import world_of
from tests.states import difference

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
estimator.kind = "predict"
"""
NUMBERS = (0, 1, -1, 2, 12, 0x7F, 0xFF, 0x100, 0xFFFF, 0x10000, 1 << 20, (1 << 31) - 1, -(1 << 31), 1 << 32)
NUMBERS += (1 << 40, 1 << 54, 1 << 61, 1 << 62, (1 << 63) - 1, -(1 << 63))
REALS = (0.0, -0.0, float("nan"), float("inf"), float("-inf"), 1e300, -1e300, 1e18, -1e9, 5e-324, 0.5)


def fresh(profile="wire"):
    """A world of two robots at tick 0, firmware and seed always the same."""
    return world_of(SCENARIO.format(profile=profile), seed=11)


def saved_worlds(profile="wire"):
    """One world, saved at several ticks: in the middle of characters, frames and interrupts."""
    world = fresh(profile)
    saves = []
    for tick in SAVED_AT:
        world.run_to(tick)
        # waits: no other save shows the outbox in use
        world.inject(b"\x55\xaa\x00", at_tick=tick + 3_000_000)
        saves.append(world.save())
    return saves


def with_bytes_changed(_, saved, draw):
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


def with_values_changed(world, saved, draw):
    """One to three fields of the state are others; the checksum is right."""
    state = opened(saved, world.identity())
    for _ in range(draw.choice((1, 1, 2, 3))):
        spans = _spans(world, state)
        if not spans:
            break
        begin, end, field = draw.choice(spans)
        state = state[:begin] + _other(state[begin:end], field.kind.form, draw) + state[end:]
    return sealed(world.identity(), state)


def with_field(world, saved, path, data):
    """A saved world in which the bytes of one field are others, and the checksum is right."""
    state = opened(saved, world.identity())
    ((begin, end),) = [(begin, end) for begin, end, field in _spans(world, state) if field.path == path]
    return sealed(world.identity(), state[:begin] + data + state[end:])


def _spans(world, state):
    """Begin and end of every field, as far as the bytes can be read."""
    spans, at = [], 0
    for field in world.state.fields:
        try:
            _, end = field.kind.decode(state, at)
        except ValueError:
            return spans
        spans.append((at, end, field))
        at = end
    return spans


def _other(data, form, draw):
    """A field with another value: of a list or of bytes another length, one item too many, or something in it."""
    if form == "d":
        (value,) = struct.unpack("<d", data)
        return struct.pack("<d", draw.choice((*REALS, -value, value * 1.001, value * 1e3, value * 1e9)))
    if len(data) in (1, 4, 8) and not form.endswith(("]", "s")):
        value = int.from_bytes(data, "little", signed=True)
        near = value + draw.choice((1, -1, 7, -7, 1000, -1000, 1 << draw.randrange(62)))
        number = draw.choice((draw.choice(NUMBERS), near)) & ((1 << 8 * len(data)) - 1)
        return number.to_bytes(len(data), "little")
    kind = draw.randrange(5)
    place = draw.randrange(len(data))
    if kind == 0:
        return struct.pack("<I", draw.choice((0, 1, 2, 4096, 4097, 0xFFFFFFFF))) + data[4:]
    if kind == 1:
        return data[:place]
    if kind == 2:
        return data + draw.randbytes(draw.choice((1, 8, 100)))
    if kind == 3:
        many = draw.choice((1, 50, 4096, 5000))
        length = int.from_bytes(data[:4], "little") + many & 0xFFFFFFFF
        return struct.pack("<I", length) + data[4:] + bytes(8 * many)
    return data[:place] + bytes([data[place] ^ 1 << draw.randrange(8)]) + data[place + 1 :]


def outcome(world, saved):
    """`refused`, `ran`, or what was raised that must not be."""
    before = world.state.save()
    try:
        world.load(saved)
    except ValueError as error:
        if world.state.save() != before:
            return f"refused with a change: {difference(world.state, before, world.state.save())}"
        return "refused" if "\n" not in str(error) and len(str(error)) < 300 else f"said {str(error)!r}"
    except Exception as error:
        return f"load raised {error!r}"
    try:
        world.run_to(world.tick + CONTROL_PERIOD_TICKS)
        world.save()
    except Exception as error:
        return f"run raised {error!r}"
    return "ran"


def changed(change, count, seed, progress=lambda number: None, profiles=("wire",)):
    """What came of so many worlds with something changed."""
    saves = {profile: saved_worlds(profile) for profile in profiles}
    worlds = {profile: fresh(profile) for profile in profiles}
    found = Counter()
    for number in range(count):
        draw = random.Random(seed * 1_000_003 + number)
        profile = draw.choice(profiles)
        faulthandler.dump_traceback_later(LIMIT_S, exit=True)
        what = outcome(worlds[profile], change(worlds[profile], draw.choice(saves[profile]), draw))
        found[what if what in ("refused", "ran") else f"number {number}: {what}"] += 1
        if what != "refused":
            worlds[profile] = fresh(profile)
        progress(number)
    faulthandler.cancel_dump_traceback_later()
    return found


def changed_values(count, seed, progress=lambda number: None):
    """What came of values changed, in worlds with different radios."""
    return changed(with_values_changed, count, seed, progress, ("wire", "shared"))


def main():
    """Prints what came of them; exit code 1 when it is not what must be."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000, help="worlds with bytes changed")
    parser.add_argument(
        "--resealed", type=int, default=10_000, help="worlds with values changed and the checksum right"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the changes")
    options = parser.parse_args()

    def progress(number):
        print(f"\r{number} ", end="", file=sys.stderr, flush=True)

    bytes_found = changed(with_bytes_changed, options.count, options.seed, progress)
    values_found = changed_values(options.resealed, options.seed, progress)
    print(f"\nbytes changed: {dict(bytes_found)}\nvalues changed: {dict(values_found)}")
    return 0 if set(bytes_found) <= {"refused"} and set(values_found) <= {"refused", "ran"} else 1


if __name__ == "__main__":
    sys.exit(main())
