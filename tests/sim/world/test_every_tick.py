"""A part of `python -m tests.sim.world.every_tick`: neighbouring ticks at places that Hypothesis chooses."""

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.sim.world.every_tick import differing
from tests.sim.world.rig import image


@settings(max_examples=3)
@given(st.integers(0, 20_000_000), st.integers(0, 1000))
def test_going_on_from_a_saved_world_equals_not_stopping(first_tick, seed):
    assert differing(first_tick, 40, seed, image()) == []
