"""What an AT89S52 and an STC89C52 have beside an AT89C52: watchdogs, a second DPTR, data flash; and what is missed."""

import hashlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.state import Flat
from miro_robot.board_spec import BoardSpec
from miro_robot.empty_board import EmptyBoard
from tests import children
from tests.naive.chip_registers import Twin
from tests.robot.mcs51.asm import assemble, image_of
from tests.robot.parts.scripted import board_of
from tests.states import restore, snapshot

AT, STC = "at89s52", "stc89c52"
ADDRESSES = {
    AT: [0x84, 0x85, 0x8E, 0xA2, 0xA6],
    STC: [0x8E, 0xA2, 0xE1, 0xE2, 0xE3, 0xE4, 0xE5, 0xE6, 0xE7, 0xE8, 0xB7],
}


def code_of(step):
    kind, *what = step
    if kind == "write":
        return bytes([0x75, what[0], what[1]])  # MOV address,#value
    if kind == "read":
        return bytes([0x85, what[0], what[1]])  # MOV slot,address
    if kind == "dptr":
        return bytes([0x90, what[0] >> 8, what[0] & 0xFF])
    if kind == "log dptr":
        return bytes([0x85, 0x82, what[0], 0x85, 0x83, what[0] + 1])
    return b"\x00" * what[0]


def board(chip, steps, wired=False, **options):
    program = b"".join(map(code_of, steps)) + b"\x80\xfe"
    spec = BoardSpec(chip=chip, xram="internal" if chip == STC else "none", **options)
    made = board_of(program, spec=spec) if wired else EmptyBoard(spec, image_of(program))
    made.cpu.rxd.settled_tick = 1 << 60
    return made


def writes(*pairs):
    return [("write", address, value) for address, value in pairs]


def feed():
    return writes((0xA6, 0x1E), (0xA6, 0xE1))


def command(code, address, data=None, contr=0x81):
    values = [] if data is None else [(0xE2, data)]
    place = [(0xE3, address >> 8), (0xE4, address & 0xFF)]
    return writes((0xE7, contr), *values, *place, (0xE5, code), (0xE6, 0x46), (0xE6, 0xB9))


def step(chip):
    writes_of = st.tuples(
        st.just("write"),
        st.sampled_from(ADDRESSES[chip]),
        st.integers(0, 255) | st.sampled_from([0x20, 0x80]),
    )
    reads = st.tuples(st.just("read"), st.sampled_from(ADDRESSES[chip]), st.integers(0x30, 0x4F))
    waits = st.tuples(st.just("wait"), st.integers(1, 40))
    dptr = st.tuples(st.just("dptr"), st.integers(0, 0xFFFF))
    log = st.tuples(st.just("log dptr"), st.integers(0x50, 0x5E))
    single = st.one_of(writes_of, reads, waits, dptr, log).map(lambda one: [one])
    return single | (st.just(feed()) if chip == AT else flash_command())


def flash_command():
    return st.builds(
        command,
        st.sampled_from([1, 2, 3]),
        st.sampled_from([0x1FFF, 0x2000, 0x2001, 0x21FF, 0x2200, 0x33FF, 0x3400]),
        st.integers(0, 255),
        st.sampled_from([0x80, 0x81, 0x83, 0x00]),
    )


def compare(chip, lists, cycles, wired, cuts=()):
    steps = [one for each in lists for one in each]
    made, twin = board(chip, steps, wired), Twin(chip)
    for cut in sorted({*cuts, cycles}):
        made.run(12 * min(cut, cycles))
        saved = snapshot(made)
        restore(made, saved)
        assert snapshot(made) == saved
    twin.run(steps, cycles)
    registers = made.registers
    assert made.cpu.cycles == twin.now
    slots = {slot: made.cpu.peek_iram(slot) for slot in twin.slots}
    assert slots == twin.slots
    assert registers.bites == twin.resets or chip == STC
    for address, value in twin.registers.items():
        assert made.cpu.sfr(address) == value, hex(address)
    if chip == STC:
        values = Flat(made).decode(saved)
        assert list(values["registers.flash"]) == twin.flash


@pytest.mark.parametrize("wired", [False, True])
@given(st.lists(step(AT), max_size=30), st.integers(1, 60_000), st.lists(st.integers(1, 60_000), max_size=4))
def test_an_at89s52_does_what_the_naive_twin_does(wired, lists, cycles, cuts):
    compare(AT, lists, cycles, wired, cuts)


@pytest.mark.parametrize("wired", [False, True])
@given(
    st.lists(step(STC), max_size=30), st.integers(1, 400_000), st.lists(st.integers(1, 400_000), max_size=4)
)
@settings(deadline=None)
def test_an_stc89c52_does_what_the_naive_twin_does(wired, lists, cycles, cuts):
    compare(STC, lists, cycles, wired, cuts)


def test_the_watchdog_of_an_at89s52_resets_16383_cycles_after_it_was_fed():
    made = board(AT, [*feed(), ("write", 0x90, 0)])
    made.run(12 * (4 + 16_382))
    assert made.registers.bites == 0
    assert made.cpu.sfr(0x90) == 0
    made.run(12 * (4 + 16_385))
    assert made.registers.bites == 1
    assert made.cpu.sfr(0x90) == 0xFF, "the pins of a processor in reset are high"
    made.run(12 * (4 + 16_384 + 9 + 6))
    assert made.cpu.sfr(0x90) == 0, "it began again"


def test_a_watchdog_that_is_fed_in_time_does_nothing():
    program = "loop:\nMOV 0A6h,#1Eh\nMOV 0A6h,#0E1h\nMOV R7,#200\ninner:\nDJNZ R7,inner\nSJMP loop"
    made = EmptyBoard(BoardSpec(chip=AT), image_of(program))
    made.cpu.rxd.settled_tick = 1 << 60
    made.run(12 * 1_000_000)
    assert made.registers.bites == 0


def test_a_program_that_ends_under_a_watchdog_has_not_ended():
    made = board(AT, feed())
    made.run(12 * 100_000)
    assert made.registers.bites == 6
    assert not made.dead
    assert not made.ended


def test_a_sleeping_at89s52_is_reset_unless_wdidle_is_set():
    asleep = [*feed(), ("write", 0x87, 0x01)]
    made = board(AT, asleep)
    made.run(12 * 20_000)
    assert made.registers.bites == 1
    made = board(AT, [("write", 0x8E, 0x10), *asleep])
    made.run(12 * 200_000)
    assert made.registers.bites == 0


def test_power_down_stops_the_watchdog():
    made = board(AT, [*feed(), ("write", 0x87, 0x02)])
    made.run(12 * 200_000)
    assert made.registers.bites == 0
    assert made.dead


@pytest.mark.parametrize(("prescaler", "cycles"), [(0, 65_536), (3, 524_288)])
def test_the_watchdog_of_an_stc_overflows_after_32768_counts_of_its_prescaler(prescaler, cycles):
    made = board(STC, writes((0xE1, 0x30 | prescaler), (0x90, 0)))
    made.run(12 * (2 + cycles))
    assert made.registers.bites == 0
    made.run(12 * (2 + cycles + 3))
    assert made.registers.bites == 1
    assert made.cpu.sfr(0xE1) == 0x80, "the flag says so"


def test_dps_switches_between_two_data_pointers():
    made = board(
        AT, [("dptr", 0x1234), *writes((0xA2, 1)), ("dptr", 0x5678), *writes((0xA2, 0)), ("log dptr", 0x40)]
    )
    made.run(12 * 12)
    assert (made.cpu.peek_iram(0x40), made.cpu.peek_iram(0x41)) == (0x34, 0x12)
    made = board("at89c52", [("dptr", 0x1234), *writes((0xA2, 1)), ("log dptr", 0x40)])
    made.run(12 * 12)
    assert (made.cpu.peek_iram(0x40), made.cpu.peek_iram(0x41)) == (0x34, 0x12), "the AT89C52 has one"


def test_data_flash_keeps_what_was_programmed_over_power_off():
    program = [*command(3, 0x2200), *command(2, 0x2201, 0x5A), *command(2, 0x2201, 0xF0)]
    made = board(STC, program)
    made.run(12 * 30_000)
    made.set_power(0)
    made.run(12 * 31_000)
    made.set_power(1)
    assert Flat(made).decode(snapshot(made))["registers.flash"][0x201] == 0x50, "bits are cleared, never set"


def test_the_processor_stands_while_data_flash_works_and_its_timers_go_on():
    made = board(STC, [*writes((0x89, 1), (0x88, 0x10)), *command(3, 0x2000), ("write", 0x90, 0x55)])
    made.run(12 * 20_000)
    assert made.cpu.sfr(0x90) == 0xFF
    assert made.cpu.sfr(0x8C) << 8 | made.cpu.sfr(0x8A) > 19_000
    made.run(12 * 22_000)
    assert made.cpu.sfr(0x90) == 0x55


def test_extram_takes_the_inner_ram_off_the_bus():
    store = "MOV DPTR,#10h\nMOV A,#%d\nMOVX @DPTR,A\n"
    lines = store % 1 + "MOV 8Eh,#2\n" + store % 2 + "MOV 8Eh,#0\nMOVX A,@DPTR\nSJMP $"
    made = EmptyBoard(
        BoardSpec(chip=STC, xram="internal"), image_of(lines.replace("SJMP $", "here:\nSJMP here"))
    )
    made.cpu.rxd.settled_tick = 1 << 60
    made.run(12 * 40)
    assert made.cpu.a == 1


def test_swrst_begins_again_and_leaves_data_flash():
    made = board(STC, [*command(2, 0x2000, 0x12), ("write", 0xE7, 0x20)])
    made.run(12 * 3_000)
    assert made.registers.bites == 0
    assert made.cpu.sfr(0xE1) == 0
    assert Flat(made).decode(snapshot(made))["registers.flash"][0] == 0x12


def test_what_the_chip_lacks_is_counted_by_address_and_not_what_looks_at_it():
    made = board("at89c52", [*command(1, 0x2000), ("read", 0xE1, 0x30)])
    made.run(12 * 100)
    for address in range(0x80, 0x100):
        made.cpu.sfr(address)
    assert made.lacking_registers() == {0xE1: 1, 0xE3: 1, 0xE4: 1, 0xE5: 1, 0xE6: 2, 0xE7: 1}
    made = board("at89c51", writes((0xC8, 4)))
    made.run(12 * 100)
    assert made.lacking_registers() == {0xC8: 1}


def test_a_reset_pin_that_goes_low_again_without_having_been_high_changes_nothing():
    made, same = (board(STC, [*command(3, 0x2000), ("wait", 30)]) for _ in range(2))
    for one in (made, same):
        one.run(12 * 40)
    assert made.registers.pause
    made.set_reset(0)
    for one in (made, same):
        one.run(12 * 60_000)
    assert made.cpu.instructions == same.cpu.instructions > 30


def test_what_is_executed_again_is_counted_once():
    made = board("at89c52", [("wait", 20), ("write", 0xE1, 1), ("wait", 20)])
    made.run(12 * 10)
    before = snapshot(made)
    for _ in range(3):
        restore(made, before)
        made.run(12 * 30)
    assert made.lacking_registers() == {0xE1: 1}
    made = board(AT, feed())
    before = snapshot(made)
    for _ in range(3):
        restore(made, before)
        made.run(12 * 20_000)
    assert made.registers.bites == 1


def runs():
    """The states of both chips at many ticks."""
    digest = hashlib.sha256()
    steps = {
        AT: [*feed(), ("dptr", 7), *writes((0xA2, 1)), ("wait", 30), *feed(), ("write", 0x87, 1)],
        STC: [*command(3, 0x2000, contr=0x83), *command(2, 0x2003, 9), *writes((0xE1, 0x3A), (0xE8, 0x5A))],
    }
    for chip, each in steps.items():
        for wired in (False, True):
            made = board(chip, each, wired)
            for cycles in (3, 40, 700, 6_000, 17_000, 30_000, 270_000):
                made.run(12 * cycles)
                digest.update(snapshot(made))
    return digest.hexdigest()


def test_both_engines_do_the_same():
    assert children.same_uncompiled(runs)


def test_a_program_of_an_assembler_is_the_same_as_steps():
    assert assemble("MOV 90h,#55h") == code_of(("write", 0x90, 0x55))
