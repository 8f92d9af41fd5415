"""Compiled and uncompiled side by side on the real firmware, over a million instructions."""

import pytest

from miro_exact import engine
from tests.sim.engines import Checkpoint, compare, lockstep

pytestmark = pytest.mark.slow

LINES = [Checkpoint(0, 100_003 * n, 500 * n, n, 2 * n, 3 * n, f"{n:064x}").line() + "\n" for n in range(5)]


@pytest.mark.skipif(engine.active() != "compiled", reason="no compiled modules here")
def test_both_engines_have_equal_states_at_every_checkpoint():
    """With frames accepted, LM629 commands and answers by radio, each with its interrupts."""
    checkpoints = list(lockstep(1_000_000))
    last = checkpoints[-1]
    assert last.instructions >= 1_000_000
    assert len(checkpoints) > 1000
    assert min(last.frames, last.commands, last.sent) > 100, last
    assert len({checkpoint.sha256 for checkpoint in checkpoints}) == len(checkpoints)


def test_checkpoints_that_agree_are_handed_on():
    assert [checkpoint.instructions for checkpoint in compare(LINES, LINES)] == [0, 500, 1000, 1500, 2000]


def test_the_first_checkpoint_that_differs_is_shown():
    other = [*LINES[:3], LINES[3].replace("3\n", "4\n"), LINES[4]]
    with pytest.raises(AssertionError, match="the engines part:\ncompiled 0 300009 1500"):
        list(compare(LINES, other))


@pytest.mark.parametrize("kept", [0, 4])
def test_an_engine_that_stops_early_is_a_difference(kept):
    with pytest.raises(AssertionError, match="the engines part"):
        list(compare(LINES, LINES[:kept]))
