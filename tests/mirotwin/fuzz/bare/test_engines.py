"""The same inputs find the same on a bare processor, compiled and uncompiled."""

import sys

from tests import children

PROGRAM = """
import random
from miro_exact import engine

engine.select({engine!r})
from tests.mirotwin.verify.bare.firmwares import SLEEPS, image
from mirotwin.fuzz.bare import BareTarget
from miro_protocol.miro_wire import Miro

draw = random.Random(3)
for kind in ("bytes", "frames", "session"):
    target = BareTarget(image(SLEEPS), kind, Miro())
    edges = bytearray(target.map_size)
    target.use_map(edges)
    for data in (b"", b"ab!", b"a?" if kind == "bytes" else b"b", draw.randbytes(12), draw.randbytes(30)):
        run = target.run(data), target.failure, target.exchange().sent, target.end_tick(), target.describe(data)
        print(kind, *run, sum(place * count for place, count in enumerate(edges)))
"""


def printed(engine):
    command = [sys.executable, "-c", PROGRAM.format(engine=engine)]
    return children.run(command, capture_output=True, text=True, check=True).stdout


def test_both_engines_say_the_same():
    compiled = printed("compiled")
    assert compiled == printed("python")
    assert compiled.count("no_fault") >= 1
    assert compiled.count("never_sleeps") >= 1
