"""What a fuzz target is, and what all targets share: their inputs, and when a refusal is one.

A target takes any bytes. It returns what came of them in a few words (`taken`, `refused: ..`), by which inputs are told
apart, and raises where the promise is broken: any exception but the documented refusal, a refusal that is no line
for people, or a round trip that does not come back.
"""

import atexit
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

Run = Callable[[bytes], str]

LONGEST_LINE = 2_000
"""Characters of a refusal."""
_IN_MEMORY = "/dev/shm"
_VALUES = re.compile(r"""['"`].*['"`]|[0-9]+""")
"""What differs between two refusals of one kind."""


class Target(NamedTuple):
    """`make` returns the function that takes the bytes.

    `engine`: which twin of hot modules runs without the sanitizers: coverage sees into `python` ones, and `compiled`
    ones are what people use. `words`: what a file of the kind is made of. `most_bytes`: longer inputs tell no more.
    """

    what: str
    make: Callable[[], Run]
    engine: str = "compiled"
    most_bytes: int = 4096
    words: Sequence[bytes] = ()


def always(run):
    """The `make` of a target that needs no preparation."""
    return lambda: run


def refused(error):
    """The outcome of a documented refusal. AssertionError unless it is one line that a person can read."""
    text = str(error)
    assert text, f"{type(error).__name__} says nothing"
    assert text.isprintable(), f"not one printable line: {text[:500]!r}"
    assert len(text) < LONGEST_LINE, f"{len(text)} characters: {text[:500]!r}"
    return f"refused: {_VALUES.sub('..', text.replace(f'{folder()}{os.sep}', ''))[:80]}"


@cache
def folder():
    """A folder of this process, in memory where there is such a place."""
    above = _IN_MEMORY if os.access(_IN_MEMORY, os.W_OK) else None
    path = Path(tempfile.mkdtemp(prefix="mirotwin-fuzz-", dir=above))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


class Draws:
    """Decisions taken from bytes, from the front; all are 0 where none are left."""

    def __init__(self, data):
        self.data = data
        self.place = 0

    @property
    def left(self):
        return len(self.data) - self.place

    def take(self, count):
        """Up to `count` bytes."""
        found = self.data[self.place : self.place + count]
        self.place += len(found)
        return found

    def below(self, end):
        """0..end-1, of as many bytes as that needs."""
        size = max(1, ((end - 1).bit_length() + 7) // 8)
        return int.from_bytes(self.take(size), "little") % end

    def signed(self, size):
        return int.from_bytes(self.take(size).ljust(size, b"\0"), "little", signed=True)


def pieces(data, size):
    """`data` cut every `size` bytes."""
    return (data[at : at + size] for at in range(0, len(data), size))


def with_sums(records):
    """Intel HEX with lengths and sums put right, so that damage gets past them."""
    lines = []
    for line in records.split(b"\n"):
        try:
            record = bytearray.fromhex(line[1:].decode("ascii"))
        except ValueError:
            record = bytearray()
        if 5 <= len(record) <= 260:
            record[0] = len(record) - 5
            record[-1] = -sum(record[:-1]) & 0xFF
            line = b":" + record.hex().encode()
        lines.append(line)
    return b"\n".join(lines)
