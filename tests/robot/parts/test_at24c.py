"""What an EEPROM acknowledges, keeps and gives back, at the edges of two wires."""

import msgspec
import pytest

from miro_robot.parts.at24c import SIZES, At24c
from tests.robot.parts.wires import MS, US, I2cBus

PAGE_MS = 5


def eeprom(size="02", **named):
    keys = {key: named.pop(key) for key in ("write_ms", "content") if key in named}
    return I2cBus(At24c(size=size, **keys), **named)


def word(size, address):
    """The bytes of a word address."""
    return (address & 0xFF,) if SIZES[size][0] <= 2048 else (address >> 8, address & 0xFF)


@pytest.mark.parametrize("size", SIZES)
def test_a_byte_that_was_written_is_read_back(size):
    bus = eeprom(size)
    assert bus.write(0xA0, *word(size, 5), 0x5A)
    assert bus.value("busy")
    bus.later(PAGE_MS * MS)
    assert not bus.value("busy")
    assert bus.read_from(0xA0, *word(size, 4), count=3) == [0xFF, 0x5A, 0xFF]
    assert len(bus.value("content")) == 2 * SIZES[size][0]
    assert bus.value("content")[8:14] == "ff5aff"
    assert (bus.value("writes"), bus.value("short_clocks")) == (1, 0)


@pytest.mark.parametrize(("size", "page"), [("02", 8), ("16", 16), ("64", 32)])
def test_a_page_write_wraps_within_its_page(size, page):
    bus = eeprom(size)
    bus.write(0xA0, *word(size, 2 * page - 2), *range(page + 1))
    bus.later(PAGE_MS * MS)
    expected = [*range(2, page), page, 1]
    assert bus.read_from(0xA0, *word(size, page), count=page) == expected
    assert bus.value("content")[: 2 * page] == "ff" * page


def test_a_read_goes_on_from_the_end_of_the_memory_to_its_beginning():
    bus = eeprom(content="01 02")
    assert bus.read_from(0xA0, 0xFE, count=4) == [0xFF, 0xFF, 1, 2]
    bus.start()
    assert bus.send(0xA1) == [True]
    assert bus.receive(1) == [0xFF]  # the address after the last one read


def test_in_a_write_cycle_no_address_is_acknowledged():
    bus = eeprom()
    bus.write(0xA0, 0, 1)
    begin, polls = bus.edges_of("sda")[-1][0], 0
    while True:
        bus.start()
        (ack,) = bus.send(0xA0)
        bus.stop()
        if ack:
            break
        polls += 1
    assert polls > 10
    assert bus.tick - begin < PAGE_MS * MS + 250 * US


def test_a_write_cycle_takes_its_time_to_the_tick():
    bus = eeprom(write_ms=2.5)
    bus.write(0xA0, 0, 1)
    begin = bus.edges_of("sda")[-1][0]
    bus.run(begin + 30_000 - 1)
    assert (bus.value("busy"), bus.value("content")[:2]) == (True, "ff")
    bus.run(begin + 30_000)
    bus.run(begin + 30_001)
    assert (bus.value("busy"), bus.value("content")[:2]) == (False, "01")


@pytest.mark.parametrize(
    ("size", "pins", "meant"),
    [
        ("02", {"a0": 1, "a2": 1}, [0xAA]),
        ("04", {"a0": 1, "a1": 1}, [0xA4, 0xA6]),
        ("08", {"a2": 1}, [0xA8, 0xAA, 0xAC, 0xAE]),
        ("16", {"a2": 1}, [0xA0, 0xA2, 0xA4, 0xA6, 0xA8, 0xAA, 0xAC, 0xAE]),
        ("64", {"a1": 1}, [0xA4]),
    ],
)
def test_address_pins_select_one_of_several(size, pins, meant):
    bus = eeprom(size, pins=list(pins))
    bus.set(**pins)
    acknowledged = []
    for address in range(0, 256, 2):
        bus.start()
        acknowledged += [address] * bus.send(address)[0]
        bus.stop()
    assert acknowledged == meant


def test_of_larger_ones_the_address_byte_has_the_block():
    bus = eeprom("16")
    bus.write(0xA6, 0x10, 0x77)
    bus.later(PAGE_MS * MS)
    assert bus.value("content")[2 * 0x310 : 2 * 0x310 + 2] == "77"
    assert bus.read_from(0xA6, 0x10, count=1) == [0x77]
    assert bus.read_from(0xA4, 0x10, count=1) == [0xFF]


def test_write_protect_acknowledges_and_writes_nothing():
    bus = eeprom(pins=["wp"])
    bus.set(wp=1)
    assert bus.write(0xA0, 0, 1, 2)
    assert (bus.value("busy"), bus.value("writes")) == (False, 0)
    assert bus.read_from(0xA0, 0, count=1) == [0xFF]
    bus.set(wp=0)
    bus.write(0xA0, 0, 1)
    bus.set(wp=1)  # what the pin is at the stop counts
    bus.later(PAGE_MS * MS)
    assert bus.read_from(0xA0, 0, count=1) == [1]


def test_only_a_stop_after_an_acknowledge_writes():
    bus = eeprom()
    bus.start()
    bus.send(0xA0, 0, 1)
    bus.bit(1)
    bus.stop()  # within a byte
    bus.start()
    bus.send(0xA0, 0, 1)
    bus.start()  # no stop
    bus.stop()
    assert (bus.value("busy"), bus.value("writes")) == (False, 0)
    bus.later(10 * MS)
    assert bus.value("content") == "ff" * 256


def test_a_read_after_a_byte_without_stop_reads_what_was_there():
    bus = eeprom(content="0102")
    assert bus.read_from(0xA0, 0, 0x55, count=1) == [2]
    assert bus.value("content")[:4] == "0102"


def test_content_survives_without_supply_and_the_address_does_not():
    bus = eeprom(content="0a0b")
    bus.read_from(0xA0, 0, count=1)
    bus.write(0xA0, 1, 0x0C)
    bus.later(6 * MS)
    bus.power(0)
    bus.start()
    assert bus.send(0xA0) == [False]
    bus.stop()
    bus.power(1)
    bus.start()
    bus.send(0xA1)
    assert bus.receive(2) == [0x0A, 0x0C]


def test_supply_that_is_lost_in_a_write_cycle_leaves_the_bytes_erased():
    bus = eeprom(content="01020304")
    bus.write(0xA0, 1, 0x55, 0x56)
    bus.later(2 * MS)
    bus.power(0)
    bus.later(10 * MS)
    bus.power(1)
    assert (bus.value("content")[:8], bus.value("busy"), bus.value("writes")) == ("01ffff04", False, 1)


def test_supply_that_is_lost_while_it_pulls_lets_the_bus_go():
    bus = eeprom(content="00")
    bus.start()
    bus.send(0xA1)
    assert bus.level("sda") == 0
    bus.wire(sda=1)
    assert bus.level("sda") == 0
    bus.power(0)
    assert bus.level("sda") == 1


def test_a_test_puts_content_at_any_time():
    bus = eeprom("32")
    bus.put("chip.content", "DE AD be ef")
    assert bus.read_from(0xA0, 0, 0, count=5) == [0xDE, 0xAD, 0xBE, 0xEF, 0xFF]


def test_nine_clocks_and_a_start_free_a_bus_that_is_stuck():
    bus = eeprom(content="00")
    bus.start()
    bus.send(0xA1)
    for _ in range(3):
        bus.bit(1)
    assert bus.level("sda") == 0  # the master was reset here
    for _ in range(9):
        bus.bit(1)
    bus.start()
    bus.stop()
    assert bus.level("sda") == 1
    assert bus.read_from(0xA0, 0, count=1) == [0]


def test_a_clock_faster_than_400_khz_is_counted():
    slow, fast = eeprom(half=8), eeprom(half=7)  # SCL is low for 16 or 14 ticks of 12 MHz: 1.3 us are 15.6
    for bus in (slow, fast):
        bus.write(0xA0, 0)
    assert slow.value("short_clocks") == 0
    assert fast.value("short_clocks") > 0


def test_both_wires_on_one_tick_are_neither_start_nor_stop():
    bus = eeprom()
    bus.set(scl=0, sda=0)
    bus.later(60)
    bus.set(scl=None, sda=None)
    bus.later(60)
    bus.set(scl=0, sda=0)
    bus.later(60)
    for index in range(7, -1, -1):
        bus.bit(0xA0 >> index & 1)
    assert bus.bit() == 1
    assert bus.read_from(0xA0, 0, count=1) == [0xFF]


@pytest.mark.parametrize(
    ("keys", "what"),
    [
        ({"size": "03"}, "size"),
        ({"content": "0"}, "content"),
        ({"content": "0g"}, "content"),
        ({"content": "00" * 257}, "content has 257 bytes, the chip 256"),
        ({"write_ms": 0}, "write_ms"),
    ],
)
def test_an_eeprom_that_cannot_be_is_refused(keys, what):
    with pytest.raises(msgspec.ValidationError, match=what):
        msgspec.convert({"part": "at24c", **keys}, At24c)


def test_a_state_of_another_size_is_refused():
    small, large = eeprom("02"), eeprom("04")
    before = small.save()
    with pytest.raises(ValueError, match="512 bytes"):
        small.load(large.save())
    assert small.save() == before
