"""The public strategies: what they promise about their draws, and that each kind of damage does turn up."""

from itertools import pairwise

import pytest
from hypothesis import Phase, find, given, settings
from hypothesis import strategies as st

from miro_protocol import stream
from miro_protocol.decoder import Damaged, Decoder, Reason, Received
from miro_protocol.hypothesis_frames import (
    FAR_TICKS,
    NEAR_TICKS,
    damaged_streams,
    robot_counts,
    transmissions,
    uart,
)
from miro_protocol.table import HOST_BIT_TICKS
from tests.naive.mcs51_uart import NaiveUart

ANY = settings(
    phases=[Phase.generate], max_examples=2000, deadline=None, database=None
)  # the first one will do


def events(heard):
    decoder = Decoder(heard.n)
    return decoder.feed_symbols(heard.symbols) + decoder.flush()


@pytest.mark.slow
@given(damaged_streams())
def test_pauses_are_plainly_none_or_plainly_some(heard):
    for (_, _, before), (_, _, after) in pairwise(heard.symbols):
        pause = after - before - 25_000
        assert 0 <= pause <= 2 * NEAR_TICKS or pause >= FAR_TICKS


@pytest.mark.slow
@pytest.mark.parametrize("reason", Reason)
def test_every_kind_of_damage_is_drawn(reason):
    def shows(heard):
        return any(isinstance(event, Damaged) and event.reason == reason for event in events(heard))

    find(damaged_streams(), shows, settings=ANY)


def test_slips_are_drawn():
    """A slip gives characters a whole number of bits late, which no pause in characters does."""

    def shows(heard):
        gaps = [after - before - 25_000 for (_, _, before), (_, _, after) in pairwise(heard.symbols)]
        return any(gap and gap % 2500 == 0 for gap in gaps) and any(not good for _, good, _ in heard.symbols)

    find(damaged_streams(), shows, settings=ANY)


@given(st.binary(max_size=20))
def test_a_uart_hears_characters_as_they_went_in(data):
    bits = [level for byte in data for level in (0, *(byte >> place & 1 for place in range(8)), 1)]
    assert uart(bits) == [(byte, True, place * 25_000) for place, byte in enumerate(data)]


@settings(max_examples=60)
@given(st.lists(st.integers(0, 1), max_size=80), st.integers(0, 155))
def test_a_uart_hears_what_the_chip_does(bits, phase):
    """Against the naive twin of the 8051's receiver, 16 samples a bit at 156 ticks."""
    chip, found = NaiveUart(), []
    chip.scon = 0x50
    levels = [1, 1, *bits, *[1] * 12]
    for tick in range(0, len(levels) * HOST_BIT_TICKS, 12):  # RI shows on machine cycles
        for now in range(tick, tick + 12):
            chip.tick(now)
            if now % 156 == 0:
                chip.clock_rx(now, levels[max(now - phase, 0) // HOST_BIT_TICKS])
        if chip.scon & 1:
            found.append((chip.sbuf, bool(chip.scon & 4)))
            chip.scon &= 0xFE
    assert [(byte, good) for byte, good, _ in uart(bits)] == found


@pytest.mark.slow
@given(robot_counts().flatmap(lambda n: st.tuples(st.just(n), transmissions(n))))
def test_transmissions_make_a_stream_file_and_do_not_overlap(drawn):
    _, sent = drawn
    assert stream.parse(stream.format_stream(sent)).transmissions() == sent
    for before, after in pairwise(sent):
        assert after.tick >= before.tick + len(before.data) * 25_000


def test_a_stream_of_valid_frames_only_is_drawn():
    def shows(sent):
        found = Decoder(3).feed(b"".join(one.data for one in sent))
        return len(sent) > 2 and [type(event) for event in found] == [Received] * len(sent)

    find(transmissions(3), shows, settings=ANY)
