"""A target of a few branches: what the fork server and the launcher are tested with."""

import time
from pathlib import Path

from mirotwin.fuzz.spec import TargetSpec

ROOT = Path(__file__).parents[4]
MAP_SIZE = 8192
MAKER = "tests.mirotwin.fuzz.afl.double:double_of"
WORD = b"DUCK"


class Found:
    """A failure of the double."""

    def __init__(self, check, pc):
        self.check, self.tick, self.pc, self.what = check, 24, pc, f"found at {pc}"


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
        self.failure = None
        right = 0
        self._count(1)
        while right < len(WORD) and right < len(data) and data[right] == WORD[right]:
            right += 1
            self._count(1 + right)
        if right == len(WORD) or self.always:
            self.failure = Found("word", right)
            return self.kind
        return 0

    def _count(self, edge):
        self.edges[edge] = (self.edges[edge] + 1) & 0xFF

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
