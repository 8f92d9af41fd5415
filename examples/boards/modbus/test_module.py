"""Each coil of the module switches its output, and no other one."""

import pytest

import mirotwin


def framed(data):
    """A request with its CRC."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return bytes([*data, crc & 0xFF, crc >> 8])


@pytest.mark.mirotwin(board="module.board.toml", firmware="module.ihx")
@pytest.mark.parametrize("coil", range(4))
def test_a_coil_switches_its_output(board, serial, coil):
    board.run_for(mirotwin.ms(20))
    serial.write(framed([1, 5, 0, coil, 0xFF, 0]))
    board.run_for(mirotwin.ms(40))
    assert [board.value(f"out{number}.on") for number in range(4)] == [number == coil for number in range(4)]
