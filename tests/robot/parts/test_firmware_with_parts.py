"""Programs in C that move a display and an EEPROM by port pins, on boards from board files."""

from pathlib import Path

import pytest

from miro_robot.build import board_of
from miro_robot.image import load_hex
from miro_sim.scenario.board_file import load_board
from tests.robot.inspect.programs import build

FOLDER = Path(__file__).parent / "firmware"
HZ = 11_059_200
FOUR = 'rs = "P2.0", rw = "P2.1", e = "P2.2", d4 = "P1.4", d5 = "P1.5", d6 = "P1.6", d7 = "P1.7"'
EIGHT = 'd0 = "P1.0", d1 = "P1.1", d2 = "P1.2", d3 = "P1.3", ' + FOUR


def board(folder, program, part, pins, *options):
    image = load_hex(build(folder, (FOLDER / program).read_text("utf-8"), *options))
    file = folder / "a.board.toml"
    file.write_text(
        f'chip = "at89c52"\ncrystal_hz = {HZ}\n[parts.it]\npart = "{part}"\npins = {{ {pins} }}\n'
    )
    return board_of(load_board(str(file)), image)


@pytest.mark.parametrize(
    ("pins", "options"), [(FOUR, ("-DFOUR",)), (EIGHT, ())], ids=["four wires", "eight wires"]
)
def test_a_program_shows_text(tmp_path, pins, options):
    lcd = board(tmp_path, "lcd.c", "lcd1602", pins, *options)
    lcd.run(HZ // 8)
    assert lcd.value("it", "row1").startswith("Hello")
    lcd.run(4 * HZ)
    assert lcd.value("it", "text") == "Hello, world    \ncount 299       "
    assert [lcd.value("it", key) for key in ("lost", "short_pulses", "on", "busy")] == [0, 0, 1, False]
    assert lcd.faults == []


def test_a_program_writes_a_page_and_reads_it_back(tmp_path):
    rom = board(tmp_path, "eeprom.c", "at24c", 'scl = "P2.0", sda = "P2.1"')
    sent = []
    rom.sent = lambda value, *_: sent.append(value)
    rom.run(HZ // 10)
    assert bytes(sent) == b"cdefy\n"
    assert bytes.fromhex(rom.value("it", "content"))[0x10:0x19] == b"abcdefgh\xff"
    assert (rom.value("it", "writes"), rom.faults) == (1, [])
