"""The CPU beside ucsim's s51: the part of the comparisons that takes seconds.

The long ones are the commands `python -m tests.robot.ucsim.lockstep`, `.compiled` and `.csmith`.
"""

import shutil
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from miro_exact import engine
from tests.robot.ucsim import compiled, csmith, s51, states, timers, vector_check
from tests.robot.ucsim.exclusions import COMPARED
from tests.robot.ucsim.lockstep import compare
from tests.robot.ucsim.walk import Walker
from tests.vectors.paths import MCS51
from tests.vectors.single_step import VectorRunner

pytestmark = pytest.mark.skipif(not s51.installed(), reason="needs ucsim's s51")
needs_sdcc = pytest.mark.skipif(shutil.which("sdcc") is None, reason="needs sdcc")
needs_csmith = pytest.mark.skipif(
    not (shutil.which("sdcc") and shutil.which("csmith")) or engine.active() == "python",
    reason="needs sdcc, csmith, and a minute for each program where nothing is compiled",
)
CHECKPOINTS = 40 if engine.active() == "compiled" else 2
SEEDS = range(1, 13)


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


@needs_sdcc
@pytest.mark.parametrize("model", compiled.MODELS)
def test_a_c_program_does_the_same_at_every_checkpoint(model, tmp_path):
    assert list(compiled.differences(compiled.build(model, tmp_path), CHECKPOINTS)) == []


def test_a_difference_at_a_checkpoint_is_named(monkeypatch):
    run = s51.run
    monkeypatch.setattr(s51, "run", lambda code, commands: run(code.replace(b"\x24", b"\x34"), commands))
    adding = bytes.fromhex("2401 80FC")  # ADD A,#1 (ADDC on the other side), for ever
    (found,) = compiled.differences(adding.ljust(64, b"\x00"), 2)
    assert found.startswith("checkpoint 0: ")
    assert "E0h ours 10h ucsim 37h" in found


@pytest.mark.slow
@needs_csmith
def test_random_c_programs_end_with_the_same_memory_and_characters():
    found = dict(map(csmith.tried, SEEDS))
    assert set(found.values()) <= {csmith.EQUAL, csmith.LEFT_OUT}
    assert csmith.EQUAL in found.values()


@needs_csmith
def test_a_difference_of_a_random_c_program_is_told(tmp_path, monkeypatch):
    run = s51.run

    def with_other_memory(code, commands, heard):
        return run(code, [f"{one[:-1]}1" if one.startswith("fill xram") else one for one in commands], heard)

    monkeypatch.setattr(s51, "run", with_other_memory)
    images = filter(None, (csmith.build(seed, tmp_path) for seed in SEEDS))
    found = (csmith.differences(image) for image in images)
    assert next(told for told in found if told is not None) == ["external RAM"]
