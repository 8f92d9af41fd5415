"""What a character display shows, answers and loses."""

import msgspec
import pytest

from miro_robot.parts.lcd1602 import Lcd1602, Lcd2004
from tests.robot.parts.wires import DATA, MS, US, LcdBus, Wires

BLANK = " " * 16


@pytest.fixture(params=[8, 4], ids=["eight wires", "four wires"])
def lcd(request):
    return LcdBus(Lcd1602(), wires=request.param).begin()


def test_it_shows_what_is_written(lcd):
    lcd.print("Hello")
    lcd.command(0xC0)
    lcd.print("world ~")
    assert lcd.value("text") == "Hello           \nworld →         "
    assert (lcd.value("row1"), lcd.value("row2"), lcd.value("row3")) == (
        "Hello".ljust(16),
        "world →".ljust(16),
        "",
    )
    assert (lcd.value("on"), lcd.value("lost"), lcd.value("short_pulses")) == (1, 0, 0)


def test_after_power_on_it_shows_nothing_and_is_busy_for_10_ms():
    lcd = LcdBus(Lcd1602())
    lcd.later(10 * MS - 6 * US)
    assert (lcd.value("text"), lcd.value("on"), lcd.value("busy")) == (f"{BLANK}\n{BLANK}", 0, True)
    lcd.write(0x0C)
    assert (lcd.value("on"), lcd.value("lost"), lcd.value("busy")) == (0, 1, False)
    lcd.command(0x0C)
    lcd.print("one line of eight bits")
    assert (lcd.value("row1"), lcd.value("row2")) == ("one line of eigh", BLANK)


@pytest.mark.parametrize(("reset_ms", "shown"), [(0, 1), (20, 0)])
def test_an_enable_that_was_high_from_power_on_writes_when_it_falls_after_the_reset(reset_ms, shown):
    nets = ["rs", "rw", "e", *DATA]
    lcd = Wires(Lcd1602(reset_ms=reset_ms), {net: net for net in nets}, nets)
    lcd.later(10 * MS)
    lcd.set(rs=0, rw=0, **{net: 0x0C >> bit & 1 for bit, net in enumerate(DATA)})
    lcd.later(US)
    lcd.set(e=0)
    assert (lcd.value("on"), lcd.value("lost"), lcd.value("short_pulses")) == (shown, 0, 0)


def test_the_time_after_power_on_is_a_key():
    lcd = LcdBus(Lcd1602(reset_ms=40))
    lcd.begin()
    assert lcd.value("lost") > 0
    assert lcd.value("on") == 0


@pytest.mark.parametrize(
    ("value", "ticks"), [(0x0C, 444), (0x80, 444), (0x01, 18240), (0x02, 18240), (0x03, 18240)]
)
def test_an_instruction_takes_37_us_or_1_52_ms_from_the_fall_of_e(lcd, value, ticks):
    lcd.write(value, wait=0)
    lcd.later(ticks - US - 1)
    assert lcd.value("busy")
    lcd.later(1)
    assert not lcd.value("busy")


def test_a_slower_oscillator_takes_longer():
    lcd = LcdBus(Lcd1602(clock_khz=135)).begin()
    lcd.later(2 * MS)
    lcd.write(0x0C, wait=74 * US - US - 1)
    assert lcd.value("busy")


def test_a_byte_that_is_written_while_it_is_busy_is_lost_and_counted(lcd):
    lcd.write(ord("A"), 1, wait=0)
    lcd.write(ord("B"), 1)
    lcd.write(ord("C"), 1)
    assert (lcd.value("row1"), lcd.value("lost")) == ("AC".ljust(16), 1)


def test_the_busy_flag_is_read_with_the_address_of_before(lcd):
    lcd.command(0x85)
    assert lcd.get() == 0x05
    lcd.write(ord("A"), 1, wait=0)
    assert lcd.get() == 0x85  # still busy
    lcd.later(45 * US)
    assert lcd.get() == 0x06
    assert lcd.value("lost") == 0


def test_the_address_counter_follows_the_busy_flag_after_5_6_us(lcd):
    lcd.write(ord("A"), 1, wait=0)
    lcd.later(37 * US - 2 * US)
    assert lcd.half(0) == 0x00
    lcd.later(4 * US)
    if len(lcd.data) == 4:
        lcd.half(0)
    assert lcd.get() == 0x01


def test_the_busy_flag_falls_while_e_stays_high(lcd):
    lcd.write(0x01, wait=0)
    lcd.set(rs=0, rw=1, **dict.fromkeys(lcd.data))
    lcd.later(US)
    lcd.set(e=1)
    lcd.later(3 * MS)
    begin = lcd.edges_of("d7")[-1]
    assert begin[1] == 0
    assert begin[0] == lcd.edges_of("e")[-2][0] + 18240


def test_it_lets_go_of_the_data_when_e_falls(lcd):
    lcd.command(0x80)
    lcd.half(0)
    assert [lcd.level(net) for net in lcd.data] == [1] * len(lcd.data)


def test_data_are_read_back_from_the_address_that_was_set(lcd):
    lcd.print("AB")
    assert read(lcd) == ord("B")  # without an address set: its data register
    lcd.command(0x80)
    assert [chr(read(lcd)) for _ in range(2)] == ["A", "B"]
    assert lcd.get() == 0x02


def read(lcd):
    value = lcd.get(1)
    lcd.later(50 * US)
    return value


def test_an_address_is_wrapped_from_line_to_line(lcd):
    lcd.command(0xA7)
    lcd.write(ord("x"), 1)
    assert lcd.get() == 0x40
    lcd.command(0xE7)
    lcd.write(ord("x"), 1)
    assert lcd.get() == 0x00
    lcd.command(0x04, 0x80)
    lcd.write(ord("x"), 1)
    assert lcd.get() == 0x67
    lcd.command(0xC0)
    lcd.write(ord("x"), 1)
    assert lcd.get() == 0x27


def test_one_line_has_80_characters():
    lcd = LcdBus(Lcd1602()).begin(lines=1)
    lcd.command(0x80 | 0x4F)
    lcd.print("x")
    assert lcd.get() == 0
    lcd.command(0x18, 0x80)
    lcd.print("abc")
    lcd.command(0x1C, 0x1C)
    assert (lcd.value("row1"), lcd.value("row2")) == ("xabc".ljust(16), BLANK)


def test_the_display_shifts_left_and_right_over_40_characters(lcd):
    lcd.print("0123456789abcdefghij")
    lcd.command(0x18, 0x18)
    assert lcd.value("row1") == "23456789abcdefgh"
    lcd.command(0x1C, 0x1C, 0x1C)
    assert lcd.value("row1") == " 0123456789abcde"
    lcd.command(0x02)
    assert (lcd.value("row1"), lcd.get()) == ("0123456789abcdef", 0)


def test_entry_mode_may_shift_the_display_and_go_left(lcd):
    lcd.command(0x90, 0x07)
    lcd.print("abc")
    assert lcd.value("row1") == BLANK[:13] + "abc"
    lcd.command(0x01, 0x8F, 0x04)
    lcd.print("abc")
    assert lcd.value("row1") == BLANK[:13] + "cba"


def test_clear_sets_the_entry_mode_to_increment(lcd):
    lcd.command(0x04, 0x01)
    lcd.print("ab")
    assert lcd.value("row1") == "ab".ljust(16)


def test_a_cursor_is_where_the_address_is_and_blinks(lcd):
    lcd.print("abc")
    assert (lcd.value("cursor"), lcd.value("blink")) == ("", False)
    lcd.command(0x0F)
    assert (lcd.value("cursor"), lcd.value("blink")) == ("1:4", True)
    lcd.command(0x10, 0x0E)
    assert (lcd.value("cursor"), lcd.value("blink")) == ("1:3", False)
    lcd.command(0xC5, 0x14)
    assert lcd.value("cursor") == "2:7"
    lcd.command(0xA0)
    assert lcd.value("cursor") == ""
    lcd.command(0x80, 0x08)
    assert (lcd.value("cursor"), lcd.value("on"), lcd.value("text")) == ("", 0, f"{BLANK}\n{BLANK}")
    lcd.command(0x0C)
    assert lcd.value("row1") == "abc".ljust(16)


def test_characters_of_one_s_own_are_shown_as_their_number(lcd):
    lcd.command(0x48)
    for row in range(8):
        lcd.write(row, 1)
    lcd.command(0x80)
    for code in (0, 1, 9, 0xDF, 0xE4, 0xF4, 0xB1, 0x5C, 0xFF, 0x10):
        lcd.write(code, 1)
    assert lcd.value("row1") == "⓪①①\uff9fμΩ\uff71¥█       "
    lcd.command(0x4B)
    assert (lcd.get(), read(lcd), read(lcd)) == (0x0B, 3, 4)


def test_without_four_wires_the_chip_finds_them_high_and_without_rw_it_is_never_read():
    lcd = LcdBus(Lcd1602(), wires=4, reading=False)
    lcd.later(15 * MS)
    lcd.pulse(0x30)
    lcd.later(MS)
    lcd.command(0x28, 0x0C)
    lcd.print("ok")
    assert lcd.value("row1").split() != ["ok"]  # it took 2Fh for a byte: one half is over
    lcd = LcdBus(Lcd1602(), wires=4, reading=False).begin()
    lcd.print("ok")
    assert lcd.value("row1") == "ok".ljust(16)


def test_initializing_again_out_of_step_with_the_halves(lcd):
    if len(lcd.data) == 4:
        lcd.pulse(0x40)
        lcd.begin()
        lcd.print("ok")
        assert lcd.value("row1") == "ok".ljust(16)


def test_rs_that_is_written_with_e_is_too_late():
    lcd = LcdBus(Lcd1602()).begin()
    lcd.set(rs=1, e=1, **{**dict.fromkeys(DATA, 0), "d6": 1})
    lcd.later(US)
    assert lcd.value("short_pulses") == 1
    lcd.set(rs=0, e=0, d6=0)  # what was there before is taken
    assert lcd.value("short_pulses") == 2
    assert lcd.value("row1") == "@".ljust(16)


@pytest.mark.parametrize(("high", "low", "broken"), [(3, 3, 0), (2, 4, 1), (3, 2, 1), (2, 3, 2)])
def test_pulses_shorter_than_the_sheet_allows_are_counted(high, low, broken):
    """230 ns are 2.76 ticks of 12 MHz, a cycle of 500 ns 6."""
    lcd = LcdBus(Lcd1602()).begin()
    lcd.set(e=1)
    lcd.later(high)
    lcd.set(e=0)
    lcd.later(low)
    lcd.set(e=1)
    lcd.later(6)
    lcd.set(e=0)
    assert lcd.value("short_pulses") == broken


def test_without_supply_it_shows_nothing_and_begins_again(lcd):
    lcd.print("abc")
    lcd.power(0)
    assert (lcd.value("on"), lcd.value("row1")) == (0, BLANK)
    lcd.write(0x0F)
    lcd.power(1)
    lcd.begin()
    assert lcd.value("text") == f"{BLANK}\n{BLANK}"


def test_four_rows_go_on_where_two_end():
    lcd = LcdBus(Lcd2004()).begin()
    for address, text in ((0x80, "one"), (0xC0, "two"), (0x94, "three"), (0xD4, "four")):
        lcd.command(address)
        lcd.print(text)
    assert [row.rstrip() for row in lcd.value("text").split("\n")] == ["one", "two", "three", "four"]
    assert {len(row) for row in lcd.value("text").split("\n")} == {20}


@pytest.mark.parametrize(
    ("keys", "what"),
    [
        ({"rows": 4, "columns": 40}, "4 rows of 40: an HD44780 has 80 characters"),
        ({"rows": 3}, "rows"),
        ({"clock_khz": 1000}, "clock_khz"),
    ],
)
def test_a_display_that_cannot_be_is_refused(keys, what):
    with pytest.raises(msgspec.ValidationError, match=what):
        msgspec.convert({"part": "lcd1602", **keys}, Lcd1602)
