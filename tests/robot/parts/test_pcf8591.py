"""What a PCF8591 converts, when, and what it sends."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.pcf8591 import Pcf8591
from tests.example_count import examples
from tests.robot.parts.wires import I2cBus

READ, WRITE = 0x91, 0x90
SINGLE, THREE, MIXED, TWO = 0x00, 0x10, 0x20, 0x30
COUNT, OUT = 0x04, 0x40


def converter(*volts, **named):
    keys = {key: named.pop(key) for key in ("vref_v",) if key in named}
    bus = I2cBus(Pcf8591(**keys), **named)
    for number, value in enumerate(volts):
        bus.put(f"chip.ain{number}_v", value)
    return bus


def read(bus, count):
    bus.start()
    assert bus.send(READ) == [True]
    values = bus.receive(count)
    bus.stop()
    return values


def test_the_first_byte_after_power_on_is_80_and_each_is_of_the_conversion_before():
    bus = converter(1.0)
    assert read(bus, 2) == [0x80, 51]
    bus.put("chip.ain0_v", 2.0)
    assert read(bus, 3) == [51, 102, 102]
    assert bus.value("conversions") == 5


def test_a_conversion_takes_the_voltage_of_the_moment_when_scl_falls_after_the_acknowledge():
    bus = converter(1.0)
    bus.start()
    bus.send(READ)
    bus.put("chip.ain0_v", 4.0)  # too late for the first
    assert bus.receive(2) == [0x80, 51]


@pytest.mark.parametrize(
    ("volts", "code"),
    [(-0.5, 0), (0.0, 0), (0.0195, 0), (0.0196, 1), (2.5, 128), (4.98, 254), (5.0, 255), (6.0, 255)],
)
def test_256_steps_are_the_reference(volts, code):
    assert read(converter(volts), 2)[1] == code


def test_another_reference_makes_other_steps():
    assert read(converter(1.0, vref_v=2.56), 2)[1] == 100


VOLTS = (1.0, 2.0, 3.0, 1.5)


@pytest.mark.parametrize(
    ("mode", "codes"),
    [
        (SINGLE, [51, 102, 153, 76]),
        (THREE, [0x100 - 26, 25, 76, 76]),
        (MIXED, [51, 102, 76, 76]),
        (TWO, [0x100 - 52, 76, 76, 76]),
    ],
)
def test_a_mode_makes_channels_of_the_inputs_and_the_highest_stands_for_those_that_it_lacks(mode, codes):
    bus = converter(*VOLTS)
    seen = []
    for channel in range(4):
        assert bus.write(WRITE, mode | channel)
        seen.append(read(bus, 2)[1])
    assert seen == codes


@pytest.mark.parametrize(
    ("mode", "codes"),
    [
        (SINGLE, [51, 102, 153, 76, 51, 102]),
        (THREE, [230, 25, 76, 230, 25, 76]),
        (MIXED, [51, 102, 76, 51, 102, 76]),
        (TWO, [204, 76, 204, 76, 204, 76]),
    ],
)
def test_channels_count_up_and_begin_again(mode, codes):
    bus = converter(*VOLTS)
    bus.write(WRITE, mode | COUNT | OUT)
    assert read(bus, 7)[1:] == codes


def test_differences_end_at_both_ends():
    bus = converter(6.0, 0.0)
    bus.write(WRITE, TWO)
    assert read(bus, 2)[1] == 127
    bus.put("chip.ain1_v", 6.0)
    bus.put("chip.ain0_v", 0.0)
    assert read(bus, 2)[1] == 0x80


def test_the_output_is_what_was_written_last_while_it_is_on():
    bus = converter()
    assert bus.write(WRITE, OUT, 10, 128)
    assert (bus.value("aout_v"), bus.value("aout_on")) == (2.5, True)
    bus.write(WRITE, 0)
    assert (bus.value("aout_v"), bus.value("aout_on")) == (0.0, False)
    bus.write(WRITE, OUT)
    assert bus.value("aout_v") == 2.5
    bus.power(0)
    assert bus.value("aout_v") == 0.0


def test_it_begins_anew_with_its_supply():
    bus = converter(1.0)
    bus.write(WRITE, OUT | COUNT, 128)
    read(bus, 3)
    bus.start()
    bus.power(0)
    bus.power(1)
    bus.later(60)
    assert (bus.value("aout_on"), bus.value("control")) == (False, 0)
    assert read(bus, 2) == [0x80, 51]
    bus.write(WRITE, OUT)
    assert bus.value("aout_v") == 0.0


def test_address_pins_select_one_of_eight():
    bus = converter(pins=["a0", "a1", "a2"])
    bus.set(a0=1, a1=0, a2=1)
    acknowledged = []
    for address in range(0, 256, 2):
        bus.start()
        acknowledged += [address] * bus.send(address)[0]
        bus.stop()
    assert acknowledged == [0x9A]


def test_a_clock_of_more_than_100_khz_is_counted():
    assert converter(half=60).value("short_clocks") == 0
    bus = converter(half=40)
    read(bus, 1)
    assert bus.value("short_clocks") > 10


INPUTS = {SINGLE: ["0", "1", "2", "3"], THREE: ["03", "13", "23"], MIXED: ["0", "1", "23"], TWO: ["01", "23"]}


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("control"), st.integers(0, 255)),
            st.tuples(st.just("read"), st.integers(1, 6)),
            st.tuples(st.just("put"), st.tuples(st.integers(0, 3), st.integers(0, 256))),
        ),
        max_size=12,
    )
)
@examples(40)
def test_any_sequence_of_control_bytes_and_reads_gives_what_the_sheet_says(steps):
    bus = converter()
    sixteenths, result = [0, 0, 0, 0], 0x80
    mode, channel, counts = SINGLE, 0, False
    for name, what in steps:
        if name == "put":
            number, sixteenths[what[0]] = what
            bus.put(f"chip.ain{number}_v", sixteenths[number] * 5.0 / 256)
        elif name == "control":
            bus.write(WRITE, what)
            mode, channel, counts = what & 0x30, what & 3, bool(what & COUNT)
        else:
            expected = []
            for _ in range(what):
                expected.append(result)
                inputs = INPUTS[mode]
                channel = min(channel, len(inputs) - 1)
                steps_of = [sixteenths[int(pin)] for pin in inputs[channel]]
                if len(steps_of) == 1:
                    result = min(steps_of[0], 255)
                else:
                    result = min(max(steps_of[0] - steps_of[1], -128), 127) % 256
                channel = (channel + 1) % len(inputs) if counts else channel
            assert read(bus, what) == expected
