"""Inputs by chance: kept ones, changed. For machines without Atheris, and for a moment in every run of the tests.

Input `number` is a pure function of (target, seed, number).
"""

import random
import time
from collections import Counter

_BYTES = (0, 1, 2, 0x20, 0x55, 0x7F, 0x80, 0xFE, 0xFF)


class Broken(Exception):
    """An input that breaks the promise."""

    def __init__(self, data, number):
        super().__init__(f"input {number}, {len(data)} bytes")
        self.data = data
        self.number = number


def changed(data, target, others, draw):
    """`data` with one to six changes, no longer than the target takes."""
    found = bytearray(data)
    for _ in range(draw.choice((1, 1, 2, 3, 6))):
        at = draw.randrange(len(found) + 1)
        count = min(len(found) - at, draw.choice((1, 1, 2, 4, 16, 200)))
        kind = draw.randrange(8)
        if kind == 0 and found:
            found[at - 1] ^= 1 << draw.randrange(8)
        elif kind == 1 and found:
            found[at - 1] = draw.choice((draw.randrange(256), draw.choice(_BYTES)))
        elif kind == 2:
            del found[at : at + count]
        elif kind == 3:
            found[at:at] = draw.randbytes(draw.choice((1, 2, 8, 30)))
        elif kind == 4:
            found[at:at] = found[at : at + count] * draw.choice((1, 1, 3, 50))
        elif kind == 5 and target.words:
            found[at : at + draw.choice((0, 0, count))] = draw.choice(target.words)
        elif kind == 6:
            other = draw.choice(others)
            begin = draw.randrange(len(other) + 1)
            found[at : at + draw.choice((0, count))] = other[begin : begin + draw.choice((4, 20, 200))]
        else:
            size = draw.choice((1, 2, 4, 8))
            number = int.from_bytes(found[at : at + size], "little") + draw.choice((1, -1, 16, -16, 255))
            found[at : at + size] = (number % (1 << 8 * size)).to_bytes(size, "little")
    return bytes(found[: target.most_bytes])


def campaign(name, target, run, inputs, seed, limit_s, most):
    """How often came what: of the inputs, and of changed ones for `limit_s` or up to `most` of all. Raises Broken."""
    outcomes = Counter()
    end_s = time.monotonic() + limit_s
    for number in range(most):
        if number < len(inputs):
            data = inputs[number]
        elif time.monotonic() > end_s:
            break
        else:
            draw = random.Random(f"{name}/{seed}/{number}")
            data = changed(draw.choice(inputs), target, inputs, draw)
        try:
            outcomes[run(data)] += 1
        except Exception as error:
            raise Broken(data, number) from error
    return outcomes
