"""Two worlds side by side: what is planted in one is named by tick and field, to the last bit."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mirotwin
from miro_sim.scenario.file import parse
from mirotwin.replay import first_difference
from tests.mirotwin.replay.rig import TEXT, planted_world, scenario, world
from tests.mirotwin.verify.checks.rig import own_image

LAST_LEFT = own_image().symbols.names["_last_left"].address
BODY = "networks[0].robots[0].board.plant.body"


def flipped(address, bit=0):
    def change(of):
        cpu = of.robot(0, 1).board.cpu
        cpu.poke_iram(address, cpu.peek_iram(address) ^ 1 << bit)

    return change


def nudged(name):
    """The next double after a field of the plant's body."""

    def change(of):
        field = next(field for field in of.state.fields if field.path == f"{BODY}.{name}")
        setattr(field.part, name, math.nextafter(getattr(field.part, name), math.inf))

    return change


def test_two_runs_of_the_same_never_differ():
    one, other = world(), world()
    assert first_difference(one, other) is None
    assert one.tick == other.tick == one.periods * 800_800


def test_a_bit_in_ram_is_named_by_tick_address_and_variable():
    found = first_difference(world(), planted_world(1_234_567, flipped(LAST_LEFT + 1)))
    assert (found.tick, found.period) == (1_234_567, 1)
    (field,) = found.fields
    assert field.path == f"networks[0].robots[0].board.cpu.iram[{LAST_LEFT + 1:02X}h]"
    assert field.symbol == "_last_left+1"
    assert field.one ^ field.other == 1
    where = "tick 1234567 (0.051440 s), control period 1: networks[0].robots[0].board.cpu"
    assert str(found).startswith(where)


@pytest.mark.parametrize("name", ["x_m", "theta_rad"])
def test_the_last_bit_of_a_float_of_the_plant_is_named_with_both_values(name):
    found = first_difference(world(), planted_world(3_333_333, nudged(name)))
    assert found.tick == 3_333_333
    assert [field.path for field in found.fields] == [f"{BODY}.{name}"]
    (field,) = found.fields
    assert math.nextafter(field.one, math.inf) == field.other
    assert field.one.hex() != field.other.hex()


@settings(max_examples=12)
@given(st.integers(24_000, 9_000_000), st.integers(0, 7))
def test_a_bit_is_found_at_whatever_tick_it_was_planted(tick, bit):
    found = first_difference(world(), planted_world(tick, flipped(0xF0, bit)))  # deep in the stack
    assert found.tick == tick
    assert [field.path for field in found.fields] == ["networks[0].robots[0].board.cpu.iram[F0h]"]
    assert found.fields[0].symbol == "stack"


def test_what_is_overwritten_at_once_is_seen_by_who_looks_often_enough():
    """The accumulator, while the processor runs: written again by one of the next instructions."""
    tick = 40_001

    def change(of):
        of.robot(0, 1).board.cpu.a ^= 1

    for look_ticks in (12, 1):
        one, other = world(), planted_world(tick, change)
        one.run_to(tick - 10)
        other.run_to(tick - 10)
        found = first_difference(one, other, tick + 1000, look_ticks)
        assert found.tick == tick
        assert [field.path for field in found.fields] == ["networks[0].robots[0].board.cpu.a"]


def test_worlds_that_differ_from_the_beginning_differ_at_tick_0():
    other = parse(f"{TEXT}start_error_x_cm = 1.0\n", "other")
    one, two = (mirotwin.World(each, 3, world().image) for each in (scenario(), other))
    found = first_difference(one, two)
    assert found.tick == 0
    assert f"{BODY}.x_m" in [field.path for field in found.fields]


def test_both_worlds_are_left_where_they_differ_first():
    one, other = world(), planted_world(1_000_001, flipped(0xF0))
    first_difference(one, other)
    assert (one.tick, other.tick) == (1_000_001, 1_000_001)


def test_the_search_ends_where_it_is_told_to():
    assert first_difference(world(), planted_world(900_000, flipped(0xF0)), until_tick=899_999) is None
    assert first_difference(world(), planted_world(900_000, flipped(0xF0)), until_tick=900_000) is not None


def test_worlds_at_two_ticks_cannot_be_compared():
    ahead = world()
    ahead.run_to(1000)
    with pytest.raises(ValueError, match="the worlds stand at ticks 1000 and 0: move them to one tick"):
        first_difference(ahead, world())


@pytest.mark.parametrize("step", [0, -5])
def test_a_step_that_is_none_is_refused(step):
    with pytest.raises(ValueError, match=f"look_ticks is {step}: give 1 or more"):
        first_difference(world(), world(), look_ticks=step)


def test_its_json_holds_tick_path_and_both_values():
    found = first_difference(world(), planted_world(24_000, flipped(LAST_LEFT + 1)))
    document = found.as_json()
    path = f"networks[0].robots[0].board.cpu.iram[{LAST_LEFT + 1:02X}h]"
    assert document["tick"] == 24_000
    assert document["fields"] == [{"path": path, "symbol": "_last_left+1", "values": [0, 1]}]
