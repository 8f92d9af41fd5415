"""A target of a few branches: what the fork server and the launcher are tested with."""

import time
from pathlib import Path

from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import TargetFailure

ROOT = Path(__file__).parents[4]
MAP_SIZE = 8192
MAKER = "tests.mirotwin.fuzz.afl.double:double_of"
WORD = b"DUCK"


class Double:
    """One branch for each byte of `WORD` that stands in its place; the whole word is a failure of kind 2.

    Edges begin at 1: afl-showmap leaves cell 0 out.

    `kind`: failures have this number. `raises`: a run of an input that begins with `!` raises; `sleeps`: it sleeps.
    """

    input = "bytes"
    map_size = MAP_SIZE
    image = None

    def __init__(self, kind=2, raises=False, sleeps=False, always=False):
        self.kind, self.raises, self.sleeps, self.always = kind, raises, sleeps, always
        self.edges = bytearray(MAP_SIZE)
        self.failure = None
        self.executions = 0

    def use_map(self, edges):
        self.edges = edges

    def run(self, data):
        self.executions += 1
        if data[:1] == b"!":
            if self.raises:
                raise RuntimeError("the double raises")
            if self.sleeps:
                time.sleep(3600)
        head = bytes(data[: len(WORD)])
        right = max(size for size in range(len(WORD) + 1) if head.startswith(WORD[:size]))
        for edge in range(1, 2 + right):
            self.edges[edge] = (self.edges[edge] + 1) & 0xFF
        failed = right == len(WORD) or self.always
        self.failure = TargetFailure("word", 24, right, f"found at {right}") if failed else None
        return self.kind if failed else 0

    def script(self, data):
        return []

    def describe(self, data):
        return data.hex(" ")


def double_of(spec):
    """A double with the parameters of the specification."""
    return Double(**spec.parameters)


def spec(**parameters):
    """The specification of a double."""
    return TargetSpec(maker=MAKER, parameters=parameters)
