"""Transmissions: what makes characters one, and that nothing is lost on the way there and back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.decoder import Decoder
from miro_protocol.events import Damaged, Reason, Received
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import (
    DIRECTIONS,
    DOWN,
    UP,
    Transmission,
    character_ticks,
    check_bad_stop,
    joined,
    of_symbols,
)

STEP = character_ticks(UP)
symbols = st.lists(
    st.tuples(st.integers(0, 255), st.booleans(), st.sampled_from([0, 1200, -1200, 1201, -1201, 30_000]))
)


@st.composite
def transmissions(draw):
    data = draw(st.binary(min_size=1, max_size=20))
    bad_stop = draw(st.sets(st.integers(0, len(data) - 1)))
    tick, direction = draw(st.integers(0, 10**9)), draw(st.sampled_from(DIRECTIONS))
    return Transmission(tick, direction, data, draw(st.integers(0, 3)), tuple(sorted(bad_stop)))


@given(transmissions())
def test_the_symbols_of_a_transmission_make_it_again(sent):
    assert of_symbols(sent.symbols(), sent.direction, sent.network) == [sent]


@given(transmissions(), st.data())
def test_a_transmission_that_was_cut_is_joined_again(sent, data):
    at = data.draw(st.integers(0, len(sent.data)))
    parts = of_symbols(sent.symbols()[:at], sent.direction, sent.network)
    parts += of_symbols(sent.symbols()[at:], sent.direction, sent.network)
    assert (parts[0] if len(parts) == 1 else joined(*parts)) == sent


@given(symbols)
def test_no_character_and_no_bad_stop_bit_is_lost_and_pauses_are_where_a_receiver_sees_them(drawn):
    tick, heard = 50_000, []
    for byte, good, off in drawn:
        heard.append((byte, good, tick + off))
        tick += off + STEP
    found = of_symbols(heard, UP, 2)
    assert [(byte, good) for sent in found for byte, good, _ in sent.symbols()] == [one[:2] for one in heard]
    pauses = [abs(off) > 1200 for _, _, off in drawn[1:]]
    assert len(found) == (1 + sum(pauses) if drawn else 0)
    assert all(sent.network == 2 for sent in found)


@pytest.mark.parametrize(
    "other",
    [
        Transmission(2 * STEP + 1201, UP, b"c"),
        Transmission(2 * STEP - 1201, UP, b"c"),
        Transmission(2 * STEP, DOWN, b"c"),
        Transmission(2 * STEP, UP, b"c", 1),
    ],
)
def test_what_does_not_follow_is_not_joined(other):
    assert joined(Transmission(0, UP, b"ab"), other) is None


@pytest.mark.parametrize("bad_stop", [(0,), (5,), (8, 22), tuple(range(23))])
def test_a_decoder_hears_bad_stop_bits(bad_stop):
    wire = encode(TeamFrame(0, 5, ((1, 2), (3, 4), (5, 6))), 3)
    decoder = Decoder(3)
    events = decoder.hear(Transmission(100, DOWN, wire, 0, bad_stop)) + decoder.flush()
    if max(bad_stop) < 6:  # the preamble is no part of the window
        assert isinstance(events[-1], Received)
    else:
        assert events == [Damaged(wire, Reason.BAD_STOP_BIT, 100)]


@pytest.mark.parametrize("bad_stop", [(3,), (-1,), (1, 1), (2, 0), (0, 3)])
def test_bad_stop_bits_have_to_be_indices_in_order(bad_stop):
    with pytest.raises(ValueError, match="must be ascending indices of 3 characters"):
        check_bad_stop(bad_stop, 3)
