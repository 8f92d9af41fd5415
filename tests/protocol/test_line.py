"""The plain UART: what is sent is received, wrong bits slip characters, and it equals the chip's where bits hold."""

import random
from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.state import restore, snapshot
from miro_protocol.line import LineReceiver, bits_of, edges_of
from miro_protocol.table import HOST_BIT_TICKS, ROBOT_BIT_TICKS
from tests.naive.mcs51_uart import NaiveUart

levels = st.lists(st.integers(0, 1), max_size=80)


def received(edges, settled, bit=ROBOT_BIT_TICKS):
    return LineReceiver(bit).feed(edges, settled)


@given(st.binary(max_size=20), st.sampled_from([HOST_BIT_TICKS, ROBOT_BIT_TICKS]))
def test_characters_come_out_as_they_went_in(data, bit):
    symbols = received(edges_of(bits_of(data), 1000), 10**9, bit)
    assert symbols == [(byte, True, 1000 + place * 25_000) for place, byte in enumerate(data)]


@given(levels, st.lists(st.integers(0, 10**6)))
def test_edges_may_come_in_any_pieces(bits, cuts):
    edges = edges_of(bits, 5000)
    whole = received(edges, 10**6)
    receiver, found = LineReceiver(), []
    for before, until in pairwise([0, *sorted(cuts), 10**6]):
        found += receiver.feed([edge for edge in edges if before <= edge[0] < until], until)
        other = LineReceiver()
        restore(other, snapshot(receiver))
        receiver = other
    assert found == whole


@settings(max_examples=60)
@given(levels, st.integers(0, 155))
def test_bits_that_hold_are_received_as_the_chip_does(bits, phase):
    """Against the naive twin of the 8051's receiver, 16 samples a bit at 156 ticks."""
    edges = edges_of(bits, 5000 + phase)
    uart = NaiveUart()
    uart.scon = 0x50
    found = []
    level, place = 1, 0
    last = 5000 + (len(bits) + 12) * HOST_BIT_TICKS
    for tick in range(0, last, 12):  # RI shows on machine cycles, 16x ticks are every 13th of them
        for now in range(tick, tick + 12):
            while place < len(edges) and edges[place][0] <= now:
                level = edges[place][1]
                place += 1
            uart.tick(now)
            if now % 156 == 0:
                uart.clock_rx(now, level)
        if uart.scon & 1:
            found.append((uart.sbuf, bool(uart.scon & 4)))
            uart.scon &= 0xFE
    assert [(byte, good) for byte, good, _ in received(edges, last)] == found


def test_a_wrong_start_bit_slips_the_characters_behind_it_until_a_true_edge():
    data = b"\x55\x00\xff\x2d\xd4"
    bits = bits_of(data)
    bits[0] ^= 1
    slipped = bytes(byte for byte, _, _ in received(edges_of(bits, 0), 10**9))
    assert slipped != data
    assert slipped.endswith(b"\x2d\xd4")  # FFh leaves one edge only, that of its start bit


def test_noise_of_whole_bits_gives_characters_that_stand_in_it():
    draw = random.Random(1)
    bits = [draw.getrandbits(1) for _ in range(5000)]
    symbols = received(edges_of(bits, 0), 10**9)
    assert 300 < len(symbols) < 500
    for byte, good, tick in symbols:
        start = round(tick / HOST_BIT_TICKS)
        frame = [*bits[start : start + 10], *[1] * 10][:10]
        assert frame[0] == 0
        assert sum(level << place for place, level in enumerate(frame[1:9])) == byte
        assert frame[9] == good
