"""The CPU beside ucsim's s51: the part of the comparison that takes seconds.

The long one is `python -m tests.robot.ucsim.lockstep --steps 2000000`.
"""

from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from miro_robot.mcs51.vectors import Bench

from tests.robot.ucsim import s51, timers, vector_check
from tests.robot.ucsim.lockstep import compare
from tests.robot.ucsim.walk import Walker
from tests.vectors.paths import MCS51

pytestmark = pytest.mark.skipif(not s51.installed(), reason="needs ucsim's s51")


@pytest.mark.parametrize("seed", range(4))
def test_random_walks_of_fixed_seeds_agree(seed):
    outcome = compare(1_000_000 + seed, 750)
    assert outcome.difference == ""
    assert sum(outcome.opcodes) == 750


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 1 << 32))
def test_random_walks_of_any_seed_agree(seed):
    assert compare(seed, 120).difference == ""


def test_the_same_seed_draws_the_same_walk():
    assert Walker(5).walk(50) == Walker(5).walk(50)
    assert Walker(5).walk(50) != Walker(6).walk(50)


def test_a_walk_meets_every_opcode():
    executed = {step.opcode for seed in range(3) for step in Walker(seed).walk(1500).steps}
    assert len(executed) == 256


def test_what_programs_read_from_running_timers_agrees():
    random = Random(3)
    programs = [timers.draw(random) for _ in range(60)]
    assert timers.ours(programs) == timers.ucsims(programs)


def test_one_published_vector_of_each_opcode_agrees():
    bench = Bench()
    chosen = {}
    for vector in vector_check.load(MCS51):
        if vector_check.comparable(vector, bench):
            chosen.setdefault(vector.name[:2], vector)
    assert len(chosen) == 256
    assert list(vector_check.differences(list(chosen.values()))) == []
