"""The frame's check and the whitening string against their bitwise twins and the published values."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol import crc, whitening
from tests.naive import crc as naive

LITERAL = bytes.fromhex(
    "FF E1 1D 9A ED 85 33 24 EA 7A D2 39 70 97 57 0A 54 7D 2D D8 6D 0D BA 8F 67 59 C7 A2 BF 34 CA"
)


def test_the_check_value_is_the_published_one():
    assert crc.crc16(b"123456789") == 0xCD72


def test_the_reflected_polynomial_is_the_polynomial_reflected():
    assert int(f"{crc.POLYNOMIAL:016b}"[::-1], 2) == crc.POLYNOMIAL_REFLECTED


@given(st.binary(max_size=64))
def test_the_crc_equals_its_bitwise_twin(data):
    assert crc.crc16(data) == naive.crc16(data)


@given(st.binary(max_size=32), st.binary(max_size=32))
def test_the_crc_may_be_computed_in_pieces(head, tail):
    assert crc.crc16(tail, crc.crc16(head)) == crc.crc16(head + tail)


@given(st.binary(max_size=32))
def test_a_message_with_its_crc_leaves_the_residue(data):
    assert crc.register(data + crc.crc16(data).to_bytes(2, "little")) == crc.residue()


@given(st.binary(max_size=32))
def test_the_nibble_table_gives_the_same_crc(data):
    table = crc.table_of(4)
    register = crc.INITIAL
    for byte in data:
        for nibble in (byte & 15, byte >> 4):
            register = register >> 4 ^ table[(register ^ nibble) & 15]
    assert register ^ crc.XOR_OUT == crc.crc16(data)


@given(st.binary(max_size=32))
def test_the_byte_table_gives_the_same_crc(data):
    table = crc.table_of(8)
    register = crc.INITIAL
    for byte in data:
        register = register >> 8 ^ table[(register ^ byte) & 255]
    assert register ^ crc.XOR_OUT == crc.crc16(data)


def test_the_whitening_string_is_the_one_written_out_and_the_pn9_sequence():
    assert whitening.STRING == LITERAL == naive.pn9(31)


@given(st.binary(max_size=31))
def test_whitening_twice_gives_the_bytes_back(data):
    assert whitening.whiten(whitening.whiten(data)) == data
    assert whitening.whiten(data) == bytes(a ^ b for a, b in zip(data, LITERAL, strict=False))


def test_more_bytes_than_the_string_has_cannot_be_whitened():
    with pytest.raises(IndexError):
        whitening.whiten(bytes(32))
