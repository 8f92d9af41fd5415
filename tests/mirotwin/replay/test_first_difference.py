"""Two worlds side by side: what is planted in one is named by tick and field, or by the first changed instruction."""

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

import mirotwin
from miro_robot.image import Symbols
from miro_robot.image.debug_info import Sources
from miro_sim.scenario.file import parse
from mirotwin.recording.compare import CompareRule, differences
from mirotwin.recording.sequences import characters
from mirotwin.replay import first_difference
from mirotwin.replay.lockstep.annotated_image import AnnotatedImage, changed_instructions, same_layout
from mirotwin.replay.lockstep.fields import extents, name_of_byte
from mirotwin.replay.lockstep.firmwares import first_instruction, moved
from tests.mirotwin.replay.rig import STOP_AT, TEXT, periods, planted_world, scenario, with_byte, world
from tests.mirotwin.verify.checks.rig import needs_sdcc, own_image
from tests.mutants.draw import SOURCE

LAST_LEFT = own_image().symbols.names["_last_left"].address
BODY = "lines[0].devices[0].board.plant.body"


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
    assert field.path == f"lines[0].devices[0].board.cpu.iram[{LAST_LEFT + 1:02X}h]"
    assert field.symbol == "_last_left+1"
    assert field.one ^ field.other == 1
    where = "tick 1234567 (0.051440 s), control period 1: lines[0].devices[0].board.cpu"
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
    one, other = world(), planted_world(tick, flipped(0xF0, bit))  # deep in the stack
    found = first_difference(one, other)
    assert found.tick == one.tick == other.tick == tick
    assert [field.path for field in found.fields] == ["lines[0].devices[0].board.cpu.iram[F0h]"]
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
        assert [field.path for field in found.fields] == ["lines[0].devices[0].board.cpu.a"]


def test_worlds_that_differ_from_the_beginning_differ_at_tick_0():
    other = parse(f"{TEXT}start_error_x_cm = 1.0\n", "other")
    one, two = (mirotwin.World(each, 3, world().image) for each in (scenario(), other))
    found = first_difference(one, two)
    assert found.tick == 0
    assert f"{BODY}.x_m" in [field.path for field in found.fields]


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
    path = f"lines[0].devices[0].board.cpu.iram[{LAST_LEFT + 1:02X}h]"
    assert document["tick"] == 24_000
    assert document["fields"] == [{"path": path, "symbol": "_last_left+1", "values": [0, 1]}]


END = 9_600_000


def apart(other, until_tick=END, sources=()):
    one = AnnotatedImage(own_image(), Sources([SOURCE]))
    return first_instruction(world, one, AnnotatedImage(other, Sources(sources)), until_tick)


def sources_of(image):
    return [image.path.parents[1] / "firmware"]


@needs_sdcc
def test_a_constant_is_named_with_instruction_c_line_register_and_both_values(images):
    image = images["late"]
    found = apart(image, END, sources_of(image))
    one, other = found.changed.one, found.changed.other
    assert (one.pc, one.symbol, one.tick) == (other.pc, other.symbol, other.tick)
    assert one.symbol.startswith("_failsafe_tick+")
    assert one.line.startswith("failsafe.c:")
    assert one.source == "if (age == FAILSAFE_STOP_MS) {"
    assert other.source == "if (age == FAILSAFE_STOP_MS + 15) {"
    assert (one.text, other.text) == ("MOV A,#6Eh", "MOV A,#7Dh")
    assert [(value.name, value.one, value.other) for value in found.changed.values] == [("ACC", 110, 125)]
    assert found.notes == ()


@needs_sdcc
def test_the_effect_is_where_the_states_differ_for_good_and_go_different_ways(images):
    image = images["late"]
    found = apart(image, END, sources_of(image)).effect
    replayed = differences(periods(world()), periods(world(image)), CompareRule(kind="commands"))
    assert replayed[0].recorded.startswith("LTRJ 1Fh 0400 at tick ")  # the smooth stop
    assert 0 < replayed[0].tick - found.one.tick < 24_000  # in the failsafe's own millisecond
    assert found.parted.symbol.startswith("_failsafe_tick+")
    assert found.parted.text.startswith("CJNE A,_age,")


@needs_sdcc
def test_a_build_of_another_layout_is_compared_by_variables_with_who_wrote_them(images):
    image = images["late and moved"]
    assert not same_layout(own_image(), image)
    first = differences(periods(world()), periods(world(image)), CompareRule(kind="commands"))[0]
    found = apart(image, first.tick + 24_000, sources_of(image))
    assert (found.changed, found.effect) == (None, None)
    assert "lies at other addresses" in found.notes[0]
    state = next(one for one in found.variables if one.name == "_state")
    assert (state.one, state.other) == (2, 1)  # stopped, driving
    writer, other = state.writers
    assert other is None
    assert writer.symbol.startswith("_motion_stop")
    assert writer.source == "state = STATE_STOPPED;"
    assert writer.line.startswith("motion.c:")
    assert abs(state.tick - first.tick) < 24_000


@needs_sdcc
def test_builds_that_differ_in_speed_alone_send_the_same_commands(images):
    image = images["slower"]
    assert not same_layout(own_image(), image)
    recorded, replayed = periods(world()), periods(world(image))
    heard, later = characters(recorded, 0), characters(replayed, 0)
    assert [one.text for one in heard] == [one.text for one in later]
    assert later[0].tick > heard[0].tick + 2496
    assert "wire" in {one.channel for one in differences(recorded, replayed)}
    assert differences(recorded, replayed, CompareRule(kind="commands")) == []
    assert differences(recorded, replayed, CompareRule(kind="bytes")) == []
    assert differences(recorded, replayed, CompareRule(kind="wheels")) == []
    assert differences(recorded, replayed, CompareRule(kind="commands", within_ticks=100)) != []


def test_without_a_compiler_a_patched_constant_is_found_too():
    image = with_byte(own_image(), STOP_AT, 125)
    found = apart(image)
    assert (found.changed.one.pc, found.changed.other.text) == (STOP_AT - 1, "MOV A,#7Dh")
    assert found.effect.network == 0
    assert found.effect.slot == 1


def test_data_that_no_instruction_lies_in_is_found_by_its_effect():
    """A nibble of the CRC table in code memory: read by MOVC, never executed."""
    own = own_image()
    table = own.symbols.names["_crc_nibble_low"].address
    found = apart(with_byte(own, table + 5, own.code[table + 5] ^ 1))
    assert found.changed is None
    assert found.effect.one.text.startswith("MOVC A,@A+")
    assert found.effect.one.text == found.effect.other.text
    assert "no changed instruction is executed: what differs is data in code memory" in found.notes


def test_what_is_never_executed_has_no_effect():
    own = own_image()
    found = apart(with_byte(own, 0x0003, 0x22), 2_400_000)  # the vector of an interrupt that is off
    assert (found.changed, found.effect) == (None, None)
    assert "no instruction has a lasting effect" in found.notes[0]


def test_an_image_without_symbols_is_told_to_have_none():
    own = own_image()
    bare = with_byte(own, STOP_AT, 125)
    bare = replace(bare, symbols=Symbols({}), path=Path("nowhere/bare.ihx"), used=((0, 10),))
    found = apart(bare, until_tick=100_000)
    assert "the images have no symbols of internal RAM in common" in found.notes[0]
    assert any("no symbols of nowhere/bare.ihx" in note for note in found.notes)


def test_the_places_of_a_changed_byte_are_the_instructions_that_may_hold_it():
    own = own_image()
    assert changed_instructions(own, own) == []
    places = changed_instructions(own, with_byte(own, STOP_AT, 125))
    assert STOP_AT - 1 in places
    assert set(places) <= {STOP_AT - 2, STOP_AT - 1, STOP_AT}


def test_bytes_of_internal_ram_have_names():
    own = own_image()
    assert name_of_byte(own, own.symbols.names["_age"].address) == "_age"
    assert name_of_byte(own, own.symbols.names["_last_left"].address + 1) == "_last_left+1"
    assert name_of_byte(own, 0x0B) == "R3 of bank 1"
    assert name_of_byte(own, 0xFF) == "stack"
    assert extents(own)["_last_left"] == (own.symbols.names["_last_left"].address, 2)
    assert extents(own)["_state"][1] == 1
    assert "__start__stack" not in extents(own)


def test_where_the_last_variable_ends_is_not_guessed():
    own = own_image()
    names = {name: at for name, at in own.symbols.names.items() if name != "__start__stack"}
    stackless = replace(own, symbols=Symbols(names), path=Path("nowhere/a.ihx"))
    last = max((at.address, name) for name, at in names.items() if at.space == "iram")
    assert extents(stackless)[last[1]] == (last[0], 1)


@needs_sdcc
def test_a_build_whose_code_moved_is_mapped_by_symbols_and_the_changed_instruction_is_named(images):
    image = images["late and moved"]
    found = apart(image, END, sources_of(image))
    one, other = found.mapped.one, found.mapped.other
    assert one.symbol.startswith("_failsafe_tick+")
    assert other.symbol.startswith("_failsafe_tick+")
    assert (one.text, other.text) == ("MOV A,#6Eh", "MOV A,_ticks")
    assert one.source == "if (age == FAILSAFE_STOP_MS) {"
    assert other.source == "if (age == FAILSAFE_STOP_MS + 15 + (ticks & 0)) {"
    assert "mapped by symbols" in found.notes[0]
    assert "changed: _failsafe_tick" in found.notes[0]


@needs_sdcc
def test_code_that_only_moved_counts_as_the_same(images):
    image = images["slower"]
    map_ = moved(
        AnnotatedImage(own_image(), Sources([SOURCE])), AnnotatedImage(image, Sources(sources_of(image)))
    )
    assert len(map_.same) > 30
    assert set(map_.places)
    assert {own_image().symbols.name_at(at) for at in map_.places} == set(map_.changed)
    assert [name for name in map_.changed if not name.startswith("_telemetry")] == []


def test_where_one_image_has_no_symbols_dead_bytes_of_its_stack_are_no_effect():
    patched = with_byte(own_image(), STOP_AT, 125)
    found = apart(replace(patched, symbols=Symbols({})))
    assert found.effect.one.tick > found.changed.one.tick
    assert found.effect.one.symbol.startswith("_failsafe_tick+")
