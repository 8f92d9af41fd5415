"""The published single-step vectors: the CPU does what they say, and they say what they should."""

import pytest
from msgspec import ValidationError

from miro_robot.mcs51.opcodes import CYCLES, LENGTH
from tests.vectors.draw import write
from tests.vectors.paths import MCS51
from tests.vectors.single_step import DISCARD, FETCH, LATCH, READ, TABLE, WRITE, State, VectorRunner, decode

NAMES = [f"{opcode:02x}.json" for opcode in range(256)]
MOVX = {0xE0, 0xE2, 0xE3, 0xF0, 0xF2, 0xF3}


def vectors_of(opcode):
    return decode((MCS51 / f"{opcode:02x}.json").read_bytes())


def test_there_is_one_file_for_each_opcode():
    assert sorted(path.name for path in MCS51.iterdir()) == NAMES


@pytest.mark.parametrize("high", range(16))
def test_the_cpu_does_what_the_vectors_say(high):
    bench = VectorRunner()
    for opcode in range(16 * high, 16 * high + 16):
        for vector in vectors_of(opcode):
            assert bench.run(vector.initial) == (vector.final, vector.cycles), vector.name


@pytest.mark.parametrize("opcode", range(256))
def test_vectors_have_the_cycles_and_fetches_of_the_instruction_table(opcode):
    for vector in vectors_of(opcode):
        assert dict(vector.initial.code)[vector.initial.pc] == opcode
        assert len(vector.cycles) == CYCLES[opcode]
        kinds = [kind for cycle in vector.cycles for _, _, kind in cycle]
        assert kinds.count(FETCH) == LENGTH[opcode]
        program = sum(kinds.count(kind) for kind in (FETCH, DISCARD, TABLE))
        assert program == (2 if opcode in MOVX else 2 * CYCLES[opcode])
        assert kinds.count(TABLE) == (opcode in (0x83, 0x93))
        assert kinds.count(READ) == (opcode in (0xE0, 0xE2, 0xE3))
        assert kinds.count(WRITE) == (opcode in (0xF0, 0xF2, 0xF3))
        latches = {address for address, _, kind in vector.cycles[-1] if kind == LATCH}
        before, after = dict(vector.initial.sfr), dict(vector.final.sfr)
        changed = {port for port in (0x80, 0x90, 0xA0, 0xB0) if before[port] != after[port]}
        assert latches == changed
        assert kinds.count(LATCH) == len(changed)


def test_drawing_again_writes_the_committed_files(tmp_path):
    write(tmp_path / "new")
    for name in NAMES:
        assert (tmp_path / "new" / name).read_bytes() == (MCS51 / name).read_bytes()


def test_fewer_vectors_are_the_first_of_more_and_another_seed_draws_others(tmp_path):
    write(tmp_path / "two", per_opcode=2)
    write(tmp_path / "other", per_opcode=2, seed=2)
    for opcode in (0x00, 0x24, 0x85, 0xD0):
        name = f"{opcode:02x}.json"
        assert decode((tmp_path / "two" / name).read_bytes()) == vectors_of(opcode)[:2]
        assert (tmp_path / "two" / name).read_bytes() != (tmp_path / "other" / name).read_bytes()


def test_a_state_that_does_not_list_what_changes_is_refused():
    with pytest.raises(ValueError, match="does not list all"):
        VectorRunner().run(State(pc=0, sfr=[], iram=[], xram=[], code=[(0, 0x74), (1, 0x55), (2, 0)]))


def test_a_bench_carries_out_any_number_of_vectors():
    """Each of these moves TXD down, and the reset before it up again."""
    bench = VectorRunner()
    initial = State(pc=0, sfr=[(0xB0, 0xFD)], iram=[], xram=[], code=[(0, 0), (1, 0)])
    results = [bench.run(initial) for _ in range(2100)]
    assert results.count(results[0]) == len(results)


def test_files_of_another_form_are_refused():
    with pytest.raises(ValidationError):
        decode(b'[{"name": "00"}]')
