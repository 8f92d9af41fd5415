"""Levels on the bare machine's pins, from a file."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_exact.state import restore, snapshot
from miro_robot.bare.input import InputPiece
from miro_robot.bare.machine import BareMachine, Ended
from miro_robot.bare.pins import PinEvent, read_pins
from tests.robot.mcs51.test_bare import SERIAL, image


def square_wave(port, bit, count, period, begin=240):
    """Falls and rises, `period` ticks from fall to fall."""
    return tuple(
        PinEvent(begin + number * period + half * (period // 2), port, bit, half)
        for number in range(count)
        for half in (0, 1)
    )


@pytest.mark.parametrize(
    ("bit", "setup", "counter"),
    [
        ((3, 4), "MOV TMOD,#05h\nSETB TR0", (0x8C, 0x8A)),
        ((3, 5), "MOV TMOD,#50h\nSETB TR1", (0x8D, 0x8B)),
        ((1, 0), "MOV T2CON,#06h", (0xCD, 0xCC)),
    ],
    ids=["T0", "T1", "T2"],
)
def test_a_program_counts_the_edges_of_a_file(bit, setup, counter):
    pins = square_wave(*bit, count=1_000, period=48)
    machine = BareMachine(image(setup + "\nwait:\nNOP\nSJMP wait"), pins=pins)
    machine.run(max_cycles=5_000)
    high, low = (machine.cpu.sfr(address) for address in counter)
    assert high << 8 | low == 1_000


def test_a_falling_pin_interrupts_and_wakes():
    text = (
        "LJMP main\nORG 0003h\nINC 30h\nRETI\nmain:\nSETB IT0\nMOV IE,#81h\nagain:\nMOV PCON,#01h\nSJMP again"
    )
    pins = square_wave(3, 2, count=50, period=100_000)
    machine = BareMachine(image(text), pins=pins)
    assert machine.run() == Ended.HALTED
    assert machine.cpu.peek_iram(0x30) == 50
    assert machine.cpu.cycles >= pins[-2].tick // 12


def test_pins_that_can_wake_nothing_keep_no_program_from_ending():
    pins = (PinEvent(24_000_000, 3, 2, 0),)
    for text, cycles in (("MOV PCON,#01h", 2), ("MOV IE,#81h\nMOV PCON,#02h", 4), ("SJMP $", 2)):
        machine = BareMachine(image(text), pins=pins)
        assert machine.run() == Ended.HALTED
        assert machine.cpu.cycles == cycles


def test_a_pin_is_low_from_the_cycle_that_samples_its_tick():
    machine = BareMachine(image("NOP\nNOP\nMOV A,P1\nMOV 30h,P1\nSJMP $"), pins=(PinEvent(12 * 3, 1, 7, 0),))
    machine.run()
    assert (machine.cpu.a, machine.cpu.peek_iram(0x30)) == (0xFF, 0x7F)


def test_levels_on_rxd_are_characters_for_the_receiver():
    bit = 24_000_000 // 9615
    start = 480_000
    levels = [0, *(0x5A >> number & 1 for number in range(8)), 1]
    pins = tuple(PinEvent(start + number * bit, 3, 0, level) for number, level in enumerate(levels))
    machine = BareMachine(image(SERIAL + "JNB RI,$\nMOV A,SBUF\nSJMP $"), pins=pins)
    assert machine.run(max_cycles=100_000) == Ended.HALTED
    assert machine.cpu.a == 0x5A


@pytest.mark.parametrize("options", [{"stdin": b"a"}, {"stdin": (InputPiece(b"a", b"> "),)}, {"live": True}])
def test_rxd_is_driven_by_pins_or_by_input(options):
    with pytest.raises(ValueError, match=r"P3\.0 is RXD"):
        BareMachine(image("NOP"), pins=(PinEvent(0, 3, 0, 0),), **options)


@pytest.mark.parametrize("step", [37, 333])
def test_pins_and_pauses_give_the_same_bits(step):
    text = "MOV TMOD,#05h\nSETB TR0\nwait:\nMOV P2,TL0\nSJMP wait"
    pins = square_wave(3, 4, 900, 60) + (PinEvent(60_000, 3, 0, 0), PinEvent(60_001, 3, 0, 1))
    whole, cut = (BareMachine(image(text), pins=pins) for _ in range(2))
    whole.run(max_cycles=8_000)
    other = BareMachine(image(text), pins=pins)
    for pause in range(step, 8_000, step):
        cut.run(max_cycles=8_000, pause=pause)
        if pause % (5 * step) == 0:
            restore(other, snapshot(cut))
            cut, other = other, cut
    cut.run(max_cycles=8_000)
    assert snapshot(cut) == snapshot(whole)


def test_edges_on_every_tick_are_taken_in_bounded_steps():
    pins = tuple(PinEvent(tick, 3, 0, tick & 1) for tick in range(240, 60_000))
    machine = BareMachine(image("wait:\nSJMP wait2\nwait2:\nSJMP wait"), pins=pins)
    assert machine.run(max_cycles=6_000) == Ended.CYCLES


def test_a_file_has_comments_and_empty_lines():
    text = "# pins\n\n0 * P1.0 1  # high\r\n  24 * P3.2 0\n24 * P3.3 0\n"
    assert read_pins(text, "a.pins") == (PinEvent(0, 1, 0, 1), PinEvent(24, 3, 2, 0), PinEvent(24, 3, 3, 0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0 * P1.0 1\n0 * P4.0 1\n", "a.pins:2: '0 * P4.0 1' is no pin event; write TICK * P1.0 0|1"),
        ("0 P1.0 1\n", "a.pins:1: "),
        ("0 * P1.8 1\n", "a.pins:1: "),
        ("-1 * P1.0 1\n", "a.pins:1: "),
        ("0 * P1.0 2\n", "a.pins:1: "),
        ("9 * P1.0 1\n8 * P1.1 1\n", "a.pins:2: tick 8 comes after tick 9; sort the lines by tick"),
        ("9 * P1.0 1\n9 * P1.0 0\n", "a.pins:2: P1.0 has a level at tick 9 already"),
        ("99999999999999999999 * P1.0 1\n", "a.pins:1: tick 99999999999999999999 is too late"),
        ("9" * 5000 + " * P1.0 1\n", "a.pins:1: "),
    ],
)
def test_a_line_that_is_none_is_refused_with_its_place(text, said):
    with pytest.raises(BadInput) as error:
        read_pins(text, "a.pins")
    assert str(error.value).startswith(said)


@given(st.text(alphabet="0123456789 *P.#\n\r\t\x00é", max_size=60))
def test_any_text_is_read_or_refused(text):
    try:
        events = read_pins(text, "a.pins")
    except BadInput:
        return
    assert list(events) == sorted(events, key=lambda event: event.tick)
