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
)

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
