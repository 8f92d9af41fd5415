"""The firmware's header is the table in C: regenerating changes nothing, its values read a real frame."""

import re
from pathlib import Path

from miro_protocol import c_header, crc, table, whitening
from miro_protocol.frames import TeamFrame, encode

HEADER = Path(__file__).parents[2] / "robot_fw/firmware/protocol.h"


def defines():
    found = re.findall(r"^#define (\w+) +(0x[0-9A-F]+|\d+)(?:UL)?\b", c_header.render(), re.MULTILINE)
    return {name: int(value, 0) for name, value in found}


def arrays():
    found = re.findall(r"char (\w+)\[(\d+)\] = \{([^}]*)\}", c_header.render())
    parsed = {name: bytes(int(value, 16) for value in re.findall(r"0x\w\w", body)) for name, _, body in found}
    assert {name: len(data) for name, data in parsed.items()} == {name: int(size) for name, size, _ in found}
    return parsed


def test_the_committed_header_is_what_the_generator_writes():
    assert c_header.render() == HEADER.read_text("utf-8")


def test_no_name_is_defined_twice():
    names = re.findall(r"^#define (\w+)", c_header.render(), re.MULTILINE)
    assert len(names) == len(set(names))


def test_a_receiver_that_knows_only_the_header_accepts_a_frame():
    value, array = defines(), arrays()
    wire = encode(TeamFrame(table.FrameType.TEAM_ASK, 9, ((1, -2), (300, -300), (16633, -16633))), 3)
    assert len(wire) == value["RX3_WIRE"]
    window = wire[-value["RX3_FRAME"] :]
    assert window[:2] == bytes([value["SYNC_0"], value["SYNC_1"]])
    clear = bytes(a ^ b for a, b in zip(window[value["RX3_AT_HDR"] :], array["whitening"], strict=False))
    assert len(clear) == value["RX3_WHITENED"]
    register = value["CRC_START_RX3"]
    for byte in clear:
        for nibble in (byte & 15, byte >> 4):
            entry = (register ^ nibble) & 15
            register = register >> 4 ^ array["crc_nibble_high"][entry] << 8 ^ array["crc_nibble_low"][entry]
    assert register == value["CRC_RESIDUE"] == crc.residue()
    assert clear[0] & value["TYPE_MASK"] == value["TYPE_TEAM_ASK"]
    assert clear[0] & value["SEQ_MASK"] == 9
    pair = 1 + 2 * value["PAIR_SIZE"]
    assert int.from_bytes(clear[pair + value["PAIR_RIGHT"] :][:2], "little", signed=True) == -16633


def test_the_whitening_string_in_the_header_is_the_codecs():
    assert arrays()["whitening"] == whitening.STRING


def test_spacing_limits_are_1040_us_and_50_us_either_side_in_cycles_of_half_a_microsecond():
    value = defines()
    assert (value["SPACING_MIN"], value["SPACING_NOMINAL"], value["SPACING_MAX"]) == (1980, 2080, 2180)
