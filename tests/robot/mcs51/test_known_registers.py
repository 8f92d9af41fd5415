"""What is said of registers that a chip has not."""

import pytest

from miro_robot.mcs51.chip_registers import registers_of
from miro_robot.mcs51.chips import CHIPS
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.known_registers import KNOWN, lacking_lines


@pytest.mark.parametrize("chip", sorted(CHIPS))
def test_the_table_names_what_the_chips_add_and_only_that(chip):
    registers = registers_of(chip, Cpu())
    added = {at for at in range(0x80, 0x100) if registers is not None and registers.read(at) >= 0}
    added |= set(range(0xC8, 0xCE)) if CHIPS[chip].has_timer2 else set()
    named = {at for known in KNOWN if chip in known.chips for at in range(known.first, known.last + 1)}
    assert named == added


def test_no_register_stands_in_the_table_twice():
    addresses = [at for known in KNOWN for at in range(known.first, known.last + 1)]
    assert len(addresses) == len(set(addresses))


def test_a_line_names_registers_count_and_remedy():
    lines = list(lacking_lines("at89c51", {0xC8: 2, 0xCB: 3, 0xE1: 1, 0xE2: 1, 0xE3: 1, 0xE4: 1}))
    assert lines == [
        'the at89c51 lacks C8h, CBh (timer 2), accessed 5 times; chip = "at89c52" has them',
        'the at89c51 lacks E1h (WDT_CONTR, the watchdog), accessed once; chip = "stc89c52" has it',
        'the at89c51 lacks E2h to E4h (ISP/IAP, the data flash), accessed 3 times; chip = "stc89c52" has them',
    ]
