"""Whatever happens at the pins of a part: it goes on, the same in both engines, and the same from what was saved."""

import random
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import engine
from miro_robot.parts import ELECTRONICS
from tests import children
from tests.example_count import examples
from tests.robot.parts.any_edges import made, step


@pytest.mark.parametrize("name", ELECTRONICS)
@given(seed=st.integers(0, 1 << 32), cuts=st.sets(st.integers(1, 60), max_size=4))
@examples(12)
def test_a_part_goes_on_from_what_was_saved(name, seed, cuts):
    (whole, driven), (cut, _) = made(name, seed), made(name, seed)
    draw, again = random.Random(seed), random.Random(seed)
    for number in range(60):
        if number in cuts:
            before = cut
            cut, _ = made(name, seed)
            cut.tick, cut.nets.powered = before.tick, before.nets.powered
            cut.load(before.save())
        assert step(cut, driven, again) == step(whole, driven, draw)
        assert cut.save() == whole.save()


def session(name, *arguments):
    command = [sys.executable, "-m", "tests.robot.parts.any_edges", name, *arguments]
    return children.run(command, capture_output=True, text=True, check=True, cwd=children.ROOT).stdout.split()


@pytest.mark.skipif(engine.active() != "compiled", reason="nothing is compiled here")
def test_compiled_and_uncompiled_parts_do_the_same_at_any_edges():
    compiled, python = (session(name, "1", "300", *ELECTRONICS) for name in ("compiled", "python"))
    assert (compiled[0], python[0]) == ("compiled", "python")
    differs = [
        part for part, one, other in zip(ELECTRONICS, compiled[1:], python[1:], strict=True) if one != other
    ]
    assert differs == []
