"""What a DS18B20 answers on its wire."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.ds18b20 import Ds18b20, crc8
from tests.example_count import examples
from tests.naive import one_wire
from tests.robot.parts.wires import MS, US, OneWireBus

SKIP, MATCH, READ_ROM, SEARCH, ALARMS = 0xCC, 0x55, 0x33, 0xF0, 0xEC
CONVERT, WRITE, READ, COPY, RECALL, POWER = 0x44, 0x4E, 0xBE, 0x48, 0xB8, 0xB4


def bus(**keys):
    return OneWireBus(Ds18b20(**keys))


def scratchpad(wire, *rom):
    assert wire.reset()
    wire.send(*(rom or [SKIP]), READ)
    return wire.receive(9)


def measured(wire, *rom):
    """Degrees, as a program has them."""
    values = scratchpad(wire, *rom)
    assert crc8(values[:8]) == values[8]
    raw = values[1] << 8 | values[0]
    return (raw - 0x10000 if raw & 0x8000 else raw) / 16


def convert(wire, celsius, ms=750):
    wire.put("chip.temperature_c", celsius)
    assert wire.reset()
    wire.send(SKIP, CONVERT)
    wire.later(ms * MS)


def test_a_reset_of_480_us_is_answered_by_a_presence_pulse():
    wire = bus()
    wire.set(dq=0)
    wire.later(480 * US)
    wire.set(dq=None)
    up = wire.tick
    wire.later(500 * US)
    assert wire.edges_of("dq")[1:] == [(up, 1), (up + 30 * US, 0), (up + 150 * US, 1)]
    assert not wire.reset(us=479.9)


@pytest.mark.parametrize(
    ("celsius", "raw"),
    [
        (125, 0x07D0),
        (85, 0x0550),
        (25.0625, 0x0191),
        (10.125, 0x00A2),
        (0.5, 0x0008),
        (0, 0x0000),
        (-0.5, 0xFFF8),
        (-10.125, 0xFF5E),
        (-25.0625, 0xFE6F),
        (-55, 0xFC90),
    ],
)
def test_a_temperature_is_in_the_scratchpad_as_the_sheet_s_table_has_it(celsius, raw):
    wire = bus()
    convert(wire, celsius)
    assert scratchpad(wire)[:8] == [raw & 0xFF, raw >> 8, 0x4B, 0x46, 0x7F, 0xFF, 0x0C, 0x10]
    assert (wire.value("scratchpad_c"), wire.value("conversions")) == (celsius, 1)


def test_before_the_first_conversion_and_while_it_goes_on_it_says_what_was_there():
    wire = bus()
    assert measured(wire) == 85.0
    convert(wire, 21.5, ms=700)
    assert wire.value("converting")
    assert measured(wire) == 85.0
    wire.later(50 * MS)
    assert not wire.value("converting")
    assert measured(wire) == 21.5


def test_a_program_that_asks_again_meanwhile_gets_the_temperature_all_the_same():
    wire = bus()
    for _ in range(50):
        convert(wire, 21.5, ms=20)
    assert measured(wire) == 21.5
    assert wire.value("conversions") == 2


@pytest.mark.parametrize(
    ("bits", "us", "shown"), [(9, 93_750, 21.5), (10, 187_500, 21.75), (11, 375_000, 21.875)]
)
def test_fewer_bits_are_sooner_there(bits, us, shown):
    wire = bus()
    wire.reset()
    wire.send(SKIP, WRITE, 0x4B, 0x46, (bits - 9) << 5)
    convert(wire, 21.9375, ms=0)
    begun = wire.tick
    while not wire.get_bit():
        pass
    assert us - 100 <= (wire.tick - begun) / US <= us + 100
    assert measured(wire) == shown


def test_a_slot_is_a_1_if_the_wire_is_high_again_after_30_us():
    wire = bus()
    for us, level in ((29.9, 1), (30, 0)):
        assert wire.reset()
        wire.send(SKIP)
        for bit in range(8):  # a scratchpad is read only if each bit was taken as it was meant
            wire.low(us if (READ >> bit & 1) == level else (60 if level else 6), 80)
        assert wire.receive(5)[4] == 0x7F


@pytest.mark.parametrize(("slot_us", "held"), [(15, 15), (60, 60)])
def test_a_fast_chip_lets_go_of_a_0_after_15_us_and_a_slow_one_after_60(slot_us, held):
    wire = bus(slot_us=slot_us)
    wire.reset()
    wire.send(SKIP, POWER)
    assert wire.get_bit() == 1
    wire.reset()
    wire.send(SKIP, READ)
    begin = wire.tick
    assert wire.get_bit() == 0  # of 0550h
    assert wire.edges_of("dq")[-2:] == [(begin, 0), (begin + held * US, 1)]


def test_each_of_several_answers_to_its_number():
    wire = OneWireBus(Ds18b20(serial="0102030405a6"), Ds18b20(serial="0102030405a7"))
    wire.put("chip.temperature_c", 10.0)
    wire.put("chip1.temperature_c", 30.0)
    roms = [list(bytes.fromhex(wire.read(f"{name}.rom"))) for name in ("chip", "chip1")]
    assert [rom[0] for rom in roms] == [0x28, 0x28]
    assert [crc8(rom) for rom in roms] == [0, 0]
    wire.reset()
    wire.send(SKIP, CONVERT)
    wire.later(750 * MS)
    assert [measured(wire, MATCH, *rom) for rom in roms] == [10.0, 30.0]


def search(wire, command=SEARCH):
    """All numbers on the wire, as Maxim's application note 187 finds them."""
    found, branches = [], [[]]
    while branches:
        path = branches.pop()
        if not wire.reset():
            return []
        wire.send(command)
        rom = []
        for place in range(64):
            bit, complement = wire.get_bit(), wire.get_bit()
            if bit and complement:
                break
            if place < len(path):
                bit = path[place]
            elif not bit and not complement:
                branches.append([*rom, 1])
            wire.put_bit(bit)
            rom.append(bit)
        if len(rom) == 64:
            found.append(
                bytes(sum(rom[8 * byte + bit] << bit for bit in range(8)) for byte in range(8)).hex()
            )
    return found


@given(st.sets(st.integers(0, (1 << 48) - 1), min_size=1, max_size=4))
@examples(8)
def test_a_search_finds_all_numbers(serials):
    wire = OneWireBus(*(Ds18b20(serial=f"{serial:012x}") for serial in serials))
    names = [f"chip{number or ''}" for number in range(len(serials))]
    assert sorted(search(wire)) == sorted(wire.read(f"{name}.rom") for name in names)


def test_in_an_alarm_search_answers_who_is_beyond_its_limits():
    wire = OneWireBus(Ds18b20(serial="010000000000"), Ds18b20(serial="020000000000"))
    wire.put("chip1.temperature_c", 70.0)
    wire.reset()
    wire.send(SKIP, WRITE, 70, 0x8A, 0x7F)  # 70 and -10 degrees
    assert search(wire, ALARMS) == []
    wire.reset()
    wire.send(SKIP, CONVERT)
    wire.later(750 * MS)
    assert search(wire, ALARMS) == [wire.read("chip1.rom")]


def test_what_was_copied_survives_without_supply():
    wire = bus()
    wire.reset()
    wire.send(SKIP, WRITE, 1, 2, 0x3F)
    wire.reset()
    wire.send(SKIP, COPY)
    assert wire.get_bit() == 0
    wire.later(10 * MS)
    assert wire.get_bit() == 1
    wire.reset()
    wire.send(SKIP, WRITE, 3, 4, 0x5F)
    assert scratchpad(wire)[2:5] == [3, 4, 0x5F]
    wire.reset()
    wire.send(SKIP, RECALL)
    assert scratchpad(wire)[2:5] == [1, 2, 0x3F]
    wire.power(0)
    assert not wire.reset()
    wire.power(1)
    assert scratchpad(wire)[:5] == [0x50, 5, 1, 2, 0x3F]


def test_its_name_makes_its_number_where_none_is_given():
    wire = bus()
    wire.reset()
    wire.send(READ_ROM)
    rom = wire.receive(8)
    assert bytes(rom[1:7]) == b"\0\0chip"
    assert one_wire.crc(rom[:7]) == rom[7]
    wire.send(READ)
    assert wire.receive(2) == [0x50, 5]


def test_parasite_power_needs_a_wire_that_stays_high():
    wire = bus(power="parasite")
    wire.reset()
    wire.send(SKIP, POWER)
    assert wire.get_bit() == 0
    convert(wire, 21.5)
    assert measured(wire) == 21.5
    convert(wire, 30.0, ms=100)
    wire.get_bit()
    wire.later(750 * MS)
    assert measured(wire) == 85.0


def test_one_that_is_broken_is_missed_or_sends_a_wrong_sum_or_shorts_the_wire():
    wire = bus()
    wire.put("chip.broken", "missing")
    assert not wire.reset()
    wire.put("chip.broken", "crc")
    values = scratchpad(wire)
    assert crc8(values[:8]) != values[8]
    wire.put("chip.broken", "low")
    assert wire.level("dq") == 0
    assert wire.reset()  # it looks like a presence pulse: that it never ends is what a program should see
    assert wire.level("dq") == 0
    wire.put("chip.broken", "crc")
    assert crc8((values := scratchpad(wire))[:8]) != values[8]
    wire.put("chip.broken", "none")
    assert measured(wire) == 85.0
    assert wire.value("broken") == "none"


bytes_ = st.sampled_from(
    [SKIP, MATCH, READ_ROM, SEARCH, ALARMS, CONVERT, WRITE, READ, COPY, RECALL, POWER, 0, 0xFF]
)
functions = st.sampled_from(
    [[CONVERT], [READ], [COPY], [RECALL], [POWER], [WRITE, 30, 10, 0x1F], [WRITE, 20, 200]]
)
steps = st.one_of(
    st.tuples(st.just("reset")),
    st.tuples(st.just("ask"), st.sampled_from([[SKIP], "match", [READ_ROM]]), functions),
    st.tuples(st.just("send"), st.lists(bytes_, max_size=3)),
    st.tuples(st.just("bits"), st.lists(st.integers(0, 1), max_size=9)),
    st.tuples(st.just("read"), st.integers(1, 80)),
    st.tuples(st.just("search"), st.integers(1, 64)),
    st.tuples(st.just("wait"), st.sampled_from([1, 9, 11, 94, 188, 750])),
    st.tuples(st.just("put"), st.floats(-55, 125)),
)


@given(st.booleans(), st.lists(steps, min_size=3, max_size=25))
@examples(60)
def test_it_does_what_its_plain_twin_does(parasite, steps):
    wire = bus(power="parasite" if parasite else "vdd", serial="a1b2c3d4e5f6")
    times = {9: 1_125_000, 10: 2_250_000, 11: 4_500_000, 12: 9_000_000, "copy": 120_000}
    twin = one_wire.Thermometer(bytes.fromhex("a1b2c3d4e5f6"), 30 * US, times, parasite)

    def slots(levels):
        """Slots in which the master holds the wire low, or lets it go and looks."""
        for level in levels:
            tick = wire.tick
            wire.low(2, 10)
            if not level:
                wire.set(dq=0)
            seen = wire.level("dq")
            wire.later(50 * US)
            wire.set(dq=None)
            wire.later(10 * US)
            assert seen == twin.slot(tick, level)

    def reset():
        twin.reset(wire.tick)
        assert wire.reset()

    for name, *arguments in steps:
        if name == "reset":
            reset()
        elif name == "ask":
            rom, function = arguments
            reset()
            slots(twin_bits([MATCH, *bytes.fromhex(wire.value("rom"))] if rom == "match" else rom))
            if rom == [READ_ROM]:
                slots([1] * 64)
            slots(twin_bits(function))
        elif name == "send":
            slots(twin_bits(arguments[0]))
        elif name == "bits":
            slots(arguments[0])
        elif name == "read":
            slots([1] * arguments[0])
        elif name == "search":
            reset()
            slots(twin_bits([SEARCH]))
            for bit in twin.rom[: arguments[0]]:
                slots([1, 1, bit])
        elif name == "wait":
            wire.later(arguments[0] * MS)
        else:
            wire.put("chip.temperature_c", arguments[0])
            twin.celsius = arguments[0]


twin_bits = one_wire.bits_of


@given(st.lists(st.integers(0, 255), max_size=12))
def test_its_check_sum_is_the_rest_of_a_division(values):
    assert crc8(values) == one_wire.crc(values)
