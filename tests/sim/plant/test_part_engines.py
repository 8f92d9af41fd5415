"""Compiled and uncompiled parts give the same bits."""

import sys

import pytest

from miro_exact import engine
from tests import children


def session(name, seed, count, kind):
    command = [sys.executable, "-m", "tests.sim.plant.part_session", name, str(seed), str(count), kind]
    return children.run(command, capture_output=True, text=True, check=True, cwd=children.ROOT).stdout.split()


@pytest.mark.skipif(engine.active() != "compiled", reason="nothing is compiled here")
@pytest.mark.parametrize(("seed", "kind"), [(1, "parts"), (2, "parts"), (1, "car")])
def test_compiled_and_uncompiled_parts_see_the_same_session(seed, kind):
    compiled, python = session("compiled", seed, 600, kind), session("python", seed, 600, kind)
    assert (compiled[0], python[0]) == ("compiled", "python")
    assert compiled[1:] == python[1:]
    assert all(
        int(edges) > 15 for edges in compiled[2:]
    )  # encoders turned, sensors saw edges, and the ranger answered
