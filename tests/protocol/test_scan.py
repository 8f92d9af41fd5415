"""The hot scanner: the source it was compiled from gives the same events and states, by any way of feeding it."""

from array import array

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.state import snapshot
from miro_protocol import decoder, table
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.hypothesis_frames import damaged_streams
from miro_protocol.scan import TICK_LIMIT, Scanner
from tests.uncompiled import uncompiled

Twin = uncompiled("miro_protocol.scan").Scanner
FORMATS = (*table.DOWNLINK.values(), table.TELEMETRY)
streams = st.booleans().flatmap(lambda up: st.tuples(damaged_streams(telemetry=up), st.just(up)))


def form_for(heard, telemetry):
    return table.TELEMETRY if telemetry else table.downlink(heard.n)


@pytest.mark.slow
@settings(max_examples=150)
@given(streams, st.sampled_from([1, 7, decoder.RUN_LIMIT]), st.integers(0, 200))
def test_the_compiled_scanner_equals_its_source(stream, run_limit, cut):
    heard, telemetry = stream
    form = form_for(heard, telemetry)
    fast, slow = Scanner(form, run_limit), Twin(form, run_limit)
    for part in (heard.symbols[:cut], heard.symbols[cut:]):
        assert fast.feed_symbols(part) == slow.feed_symbols(part)
        assert snapshot(fast) == snapshot(slow)
        fast.gap()
        slow.gap()
    assert fast.flush() == slow.flush()
    assert snapshot(fast) == snapshot(slow)


chunks = st.lists(st.tuples(st.binary(max_size=40), st.one_of(st.none(), st.integers(-(10**6), 10**7))))


@given(chunks, st.sampled_from(FORMATS))
def test_bytes_with_and_without_a_tick_give_the_same_in_both(parts, form):
    fast, slow = Scanner(form, 10), Twin(form, 10)
    whole = encode(TeamFrame(0, 1, ((5, -5),) * 3), 3)
    for data, tick in [*parts, (whole, None)]:
        assert fast.feed(data, tick) == slow.feed(data, tick)
        assert snapshot(fast) == snapshot(slow)


@pytest.mark.slow
@given(streams)
def test_columns_give_the_same_as_symbols(stream):
    heard, telemetry = stream
    form = form_for(heard, telemetry)
    rows, columns = Scanner(form), Scanner(form)
    data = bytes(byte for byte, *_ in heard.symbols)
    bad_stop = bytes(not good for _, good, _ in heard.symbols)
    ticks = array("q", [tick for *_, tick in heard.symbols])
    assert columns.feed_columns(data, bad_stop, ticks) == rows.feed_symbols(heard.symbols)
    assert snapshot(columns) == snapshot(rows)


@pytest.mark.parametrize("kind", [Scanner, Twin])
def test_columns_of_different_lengths_are_refused(kind):
    with pytest.raises(ValueError, match="columns of 2, 1 and 0 characters"):
        kind(FORMATS[0]).feed_columns(b"ab", b"\0", array("q"))


@pytest.mark.parametrize("kind", [Scanner, Twin])
@pytest.mark.parametrize("byte", [-1, 256, 1 << 31])
def test_a_character_that_is_no_byte_is_refused_by_name(kind, byte):
    with pytest.raises(ValueError, match=f"character = {byte}: must be 0..255"):
        kind(FORMATS[0]).feed_symbols([(byte, True, 0)])


@pytest.mark.parametrize("kind", [Scanner, Twin])
@pytest.mark.parametrize("tick", [-TICK_LIMIT - 1, TICK_LIMIT, 1 << 70])
def test_a_tick_beyond_64_bits_is_refused_and_nothing_is_taken(kind, tick):
    scanner = kind(FORMATS[0])
    before = snapshot(scanner)
    for feed in (lambda: scanner.feed(b"a", tick), lambda: scanner.feed_symbols([(1, True, tick)])):
        with pytest.raises(ValueError, match=f"tick = {tick}: must be"):
            feed()
        assert snapshot(scanner) == before


@pytest.mark.parametrize("kind", [Scanner, Twin])
@pytest.mark.parametrize("run_limit", [0, decoder.RUN_LIMIT + 1])
def test_a_run_limit_that_does_not_fit_is_refused(kind, run_limit):
    with pytest.raises(ValueError, match="run_limit"):
        kind(FORMATS[0], run_limit)


def test_without_the_spacing_rule_pauses_inside_a_frame_are_taken():
    form = table.downlink(3)
    wire = encode(TeamFrame(0, 1, ((5, -5),) * 3), 3)
    symbols = [(byte, True, place * 40_000) for place, byte in enumerate(wire)]
    strict, loose = Scanner(form), Scanner(form, tolerance_ticks=TICK_LIMIT)
    strict.feed_symbols(symbols)
    loose.feed_symbols(symbols)
    assert (strict.valid, loose.valid) == (0, 1)
