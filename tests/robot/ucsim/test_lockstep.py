"""The CPU beside ucsim's s51: the part of the comparison that takes seconds.

The long one is `python -m tests.robot.ucsim.lockstep --steps 2000000`.
"""

from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from miro_robot.mcs51.vectors import VectorRunner
from tests.robot.ucsim import s51, states, timers, vector_check
from tests.robot.ucsim.exclusions import COMPARED
from tests.robot.ucsim.lockstep import compare
from tests.robot.ucsim.walk import Walker
from tests.vectors.paths import MCS51

pytestmark = pytest.mark.skipif(not s51.installed(), reason="needs ucsim's s51")


@pytest.mark.parametrize("seed", range(4))
def test_random_walks_of_fixed_seeds_agree(seed):
    outcome = compare(1_000_000 + seed, 750)
    assert outcome.difference == ""
    assert sum(outcome.opcodes) == 750


@settings(max_examples=6, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 1 << 32))
def test_random_walks_of_any_seed_agree(seed):
    assert compare(seed, 120).difference == ""


@pytest.mark.parametrize("scattered", [False, True])
def test_the_same_seed_draws_the_same_walk(scattered):
    assert Walker(5, scattered).walk(50) == Walker(5, scattered).walk(50)
    assert Walker(5, scattered).walk(50) != Walker(6, scattered).walk(50)


@pytest.mark.parametrize("scattered", [False, True])
def test_a_walk_meets_every_opcode(scattered):
    executed = {step.opcode for seed in range(3) for step in Walker(seed, scattered).walk(1500).steps}
    assert len(executed) == 256


def test_a_scattered_walk_begins_each_step_in_a_random_state_of_everything():
    steps = Walker(5, scattered=True).walk(2000).steps
    assert all(step.state in states.OFFSETS for step in steps)
    for address in range(256):
        assert len({step.iram[address] for step in steps}) > 200, f"internal RAM {address:02X}h"
    for place, address in enumerate(COMPARED):
        for bit in range(8):
            if states.RANDOM_BITS.get(address, 0xFF) >> bit & 1:
                seen = {step.sfr[place] >> bit & 1 for step in steps}
                assert seen == {0, 1}, f"bit {bit} of register {address:02X}h is always {seen}"


def test_a_program_begins_each_step_where_the_one_before_ended():
    assert {step.state for step in Walker(5).walk(500).steps} == {0}


def test_what_programs_read_from_running_timers_agrees():
    random = Random(3)
    programs = [timers.draw(random) for _ in range(60)]
    assert timers.ours(programs) == timers.ucsims(programs)


def test_one_published_vector_of_each_opcode_agrees():
    bench = VectorRunner()
    chosen = {}
    for vector in vector_check.load(MCS51):
        if vector_check.comparable(vector, bench):
            chosen.setdefault(vector.name[:2], vector)
    assert len(chosen) == 256
    assert list(vector_check.differences(list(chosen.values()))) == []
