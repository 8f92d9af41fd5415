"""State is data: snapshots are complete, go on identically, and both engines give the same bits."""

import re
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import engine
from miro_robot.lm629.chip import SAMPLE_TICKS, Lm629
from tests import children
from tests.example_count import examples
from tests.robot.lm629.bench import Bench
from tests.robot.lm629.session import play, steps
from tests.states import restore, snapshot

ROOT = Path(__file__).parents[3]


def session(name, seed, count):
    command = [sys.executable, "-m", "tests.robot.lm629.session", name, str(seed), str(count)]
    done = children.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    return done.stdout


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_compiled_and_uncompiled_chips_see_the_same_session(seed):
    if engine.active() != "compiled":
        pytest.skip("nothing is compiled here")
    compiled, python = session("compiled", seed, 400), session("python", seed, 400)
    assert compiled.split()[0] == "compiled"
    assert python.split()[0] == "python"
    assert compiled.split()[1] == python.split()[1]


def at_rest(state, tick, edges, rests):
    """A chip with that state, whose motor is unplugged, 90 000 ticks later; whether it passed samples on the way."""
    chip = Lm629()
    restore(chip, state)
    chip.pulses = 0
    begun = chip.next_tick
    if edges and tick < begun - 8 < tick + SAMPLE_TICKS:
        chip.set_encoder(begun - 8, edges & 1, edges >> 1 & 1)
        chip.set_index(begun - 8, edges >> 2)
    if rests:
        chip.rest(tick + 90_000)
    passed = chip.next_tick > begun + SAMPLE_TICKS
    chip.advance(tick + 90_000)
    return snapshot(chip) + bytes([chip.hi]), passed


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_chip_whose_motor_is_unplugged_passes_samples_without_work_as_if_it_made_each(seed):
    bench, passed = Bench(), 0
    bench.chip.set_encoder(0, 0, 0)
    bench.reset()
    for step in steps(seed, 300):
        if bench.chip.mode == 0:
            bench.reset()
        play(bench, step)
        bench.chip.rest(bench.tick + 90_000)  # plugged in, it makes each
        for edges in (0, 1 + step[1] % 7):
            state, passes = at_rest(snapshot(bench.chip), bench.tick, edges, True)
            assert (state, False) == at_rest(snapshot(bench.chip), bench.tick, edges, False)
            passed += passes
    assert passed > 5


@pytest.mark.slow
@examples(60)
@given(seed=st.integers(0, 2**32), before=st.integers(0, 40), extra=st.integers(0, 9000))
def test_a_chip_restored_at_any_tick_goes_on_with_the_same_bits(seed, before, extra):
    script = steps(seed, before + 15)
    first = Bench()
    first.chip.set_encoder(0, 0, 0)
    first.reset()
    for step in script[:before]:
        play(first, step)
    first.drive(ps=extra & 1, data=extra & 0xFF, cs=0, wr=extra >> 1 & 1, rd=extra >> 2 & 1)
    first.wait(extra)
    first.edges.clear()
    first.chip.commands.clear()
    state = snapshot(first.chip)
    second = Bench(Lm629(), first.tick)
    restore(second.chip, state)
    second.pins, second.place = first.pins, first.place
    assert snapshot(second.chip) == state
    for bench in (first, second):
        bench.drive(cs=1)
        bench.drive(rd=1, wr=1)
    for step in script[before:]:
        for bench in (first, second):
            play(bench, step)
        assert snapshot(second.chip) == snapshot(first.chip)
    assert (second.edges, second.chip.commands) == (first.edges, first.chip.commands)
    assert (second.chip.hi, second.chip.writes_while_busy) == (first.chip.hi, first.chip.writes_while_busy)


def test_a_repr_tells_where_the_axis_is():
    bench = Bench.running()
    bench.start(0x1828, 0x8000, 0x18000, samples=6)
    assert re.match(r"<Lm629 status 00h real 0 desired 7 velocity \+1.50000 pwm \+0 next", repr(bench.chip))
