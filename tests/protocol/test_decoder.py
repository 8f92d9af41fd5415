"""The sliding window: events equal its naive twin's, however the input is cut, and no character is lost.

The hot scanner inside gives the same events and states as the source that it was compiled from, and is fast enough.
"""

from itertools import pairwise

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from benchmarks.codec import best_time, codec_jobs
from miro_exact import engine
from miro_protocol import decoder as module
from miro_protocol import table
from miro_protocol.decoder import TICK_LIMIT, Damaged, Decoder, Reason, Received, Scanner
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.hypothesis_frames import damaged_streams, team_frames, valid_streams
from miro_protocol.whitening import whiten
from tests.exact.uncompiled import uncompiled
from tests.naive.decoder import NaiveDecoder
from tests.states import restore, snapshot, values

Twin = uncompiled(module).Scanner
FORMATS = (*table.DOWNLINK.values(), table.TELEMETRY)
FRAMES = {n: encode(TeamFrame(0, 7, ((100, -100),) * n), n) for n in (3, 5)}
LEAD = b"\x55" * 5 + b"\xff"


def form_for(heard, telemetry):
    return table.TELEMETRY if telemetry else table.downlink(heard.n)


def decoder_for(heard, telemetry, run_limit=module.RUN_LIMIT):
    return Scanner(form_for(heard, telemetry), run_limit)


def naive_for(heard, telemetry, run_limit=module.RUN_LIMIT):
    if telemetry:
        return NaiveDecoder(14, 0x1E, LEAD[1:], run_limit)
    return NaiveDecoder(5 + 4 * heard.n, 0x10 | heard.n, LEAD, run_limit)


def messages(events, n):
    return [event.message(n) for event in events if isinstance(event, Received)]


streams = st.booleans().flatmap(lambda up: st.tuples(damaged_streams(telemetry=up), st.just(up)))


@pytest.mark.slow
@settings(max_examples=200)
@given(streams, st.sampled_from([1, 3, 10, module.RUN_LIMIT]))
def test_events_and_counters_equal_the_naive_twins(stream, run_limit):
    heard, telemetry = stream
    naive = naive_for(heard, telemetry, run_limit)
    for symbol in heard.symbols:
        naive.character(*symbol)
    decoder = decoder_for(heard, telemetry, run_limit)
    events = decoder.feed_symbols(heard.symbols) + decoder.flush()
    assert events == naive.flush()
    assert decoder.rejected == naive.rejected
    assert decoder.valid == sum(isinstance(event, Received) for event in events)


@pytest.mark.slow
@given(streams, st.lists(st.integers(0, 200)))
def test_any_chunking_gives_the_same_events_and_the_same_state(stream, cuts):
    heard, telemetry = stream
    whole, cut = decoder_for(heard, telemetry), decoder_for(heard, telemetry)
    expected = whole.feed_symbols(heard.symbols)
    places = [0, *sorted(min(place, len(heard.symbols)) for place in cuts), len(heard.symbols)]
    events = []
    for start, end in pairwise(places):
        events += cut.feed_symbols(heard.symbols[start:end])
    assert events == expected
    assert snapshot(cut) == snapshot(whole)
    assert cut.flush() == whole.flush()


@pytest.mark.slow
@given(streams, st.integers(0, 200))
def test_a_restored_snapshot_goes_on_as_the_decoder_would_have(stream, place):
    heard, telemetry = stream
    decoder, other = decoder_for(heard, telemetry), decoder_for(heard, telemetry)
    decoder.feed_symbols(heard.symbols[:place])
    other.feed(b"something else\x2d\xd4")
    restore(other, snapshot(decoder))
    assert other.feed_symbols(heard.symbols[place:]) == decoder.feed_symbols(heard.symbols[place:])
    assert other.flush() == decoder.flush()
    assert snapshot(other) == snapshot(decoder)


@pytest.mark.slow
@given(st.booleans().flatmap(lambda up: st.tuples(valid_streams(telemetry=up), st.just(up))))
def test_undamaged_frames_all_come_out_in_order_with_their_preambles(stream):
    heard, telemetry = stream
    decoder = decoder_for(heard, telemetry)
    events = decoder.feed_symbols(heard.symbols)
    assert messages(events, heard.n) == list(heard.sent)
    assert b"".join(event.data for event in events).count(b"\xff\x2d\xd4") >= len(heard.sent)
    assert decoder.flush() == []
    assert decoder.rejected == 0


@given(st.lists(st.tuples(st.booleans(), st.binary(max_size=60))), st.sampled_from([3, 5]))
@example(noise=[(False, b"\x55\xff\x2d\xd4")], n=3)
@example(noise=[(False, b"\x2d\xd4" * 20)], n=5)
def test_the_first_undamaged_frame_after_any_garbage_is_taken(noise, n):
    decoder, naive = Decoder(n), NaiveDecoder(5 + 4 * n, 0x10 | n, LEAD, module.RUN_LIMIT)
    tick, events = 0, []
    for pause, data in [*noise, (False, FRAMES[n])]:
        if pause:
            decoder.gap()
            tick += 25000
        events += decoder.feed(data)
        for place, byte in enumerate(data):
            naive.character(byte, True, tick, after_gap=pause and place == 0)
            tick += 25000
    assert isinstance(events[-1], Received)
    assert messages(events, n)[-1] == TeamFrame(0, 7, ((100, -100),) * n)
    assert [(type(event), event.data) for event in events] == [
        (type(event), event.data) for event in naive.flush()
    ]


@pytest.mark.parametrize("n", [3, 5])
def test_a_preamble_cut_short_by_key_up_is_taken_as_far_as_it_is_intact(n):
    damaged, frame = Decoder(n).feed(b"\x12" + FRAMES[n][2:])
    assert damaged == Damaged(b"\x12", Reason.NO_SYNC, 0)
    assert frame.data == FRAMES[n][2:]
    assert frame.start_tick == 25000


def on_time(data, bad_stop=None, pause_at=99):
    """Symbols of characters without a pause but one, with one bad stop bit."""
    late = [1920 * (place >= pause_at) for place in range(len(data))]
    return [(byte, place != bad_stop, place * 25000 + late[place]) for place, byte in enumerate(data)]


@pytest.mark.parametrize(
    ("symbols", "reason"),
    [
        (on_time(b"\x55\xff\x2dnothing here at all, whatever\xd4"), Reason.NO_SYNC),
        (on_time(FRAMES[3][:-1]), Reason.CUT_SHORT),
        (on_time(FRAMES[3][:-1] + b"\0"), Reason.BAD_CRC),
        *((on_time(FRAMES[3], bad_stop=place), Reason.BAD_STOP_BIT) for place in range(6, 23)),
        *((on_time(FRAMES[3], pause_at=place), Reason.BAD_SPACING) for place in range(7, 23)),
    ],
    ids=lambda one: getattr(one, "name", ""),
)
def test_damage_is_named_and_a_bad_crc_alone_counts_as_rejected(symbols, reason):
    decoder = Decoder(3)
    assert decoder.feed_symbols(symbols) == []
    (event,) = decoder.flush()
    assert (event.reason, decoder.rejected) == (reason, reason == Reason.BAD_CRC)


@pytest.mark.parametrize("n", [3, 5])
def test_of_all_65536_crcs_one_is_taken(n):
    frame = FRAMES[n]
    events = Decoder(n).feed(b"".join(frame[:-2] + crc.to_bytes(2, "little") for crc in range(1 << 16)))
    assert [event.data for event in events if isinstance(event, Received)] == [frame]


def test_a_bad_stop_bit_in_the_preamble_harms_nothing():
    symbols = [(byte, place >= 6, 25000 * place) for place, byte in enumerate(FRAMES[3])]
    events = Decoder(3).feed_symbols(symbols)
    assert [type(event) for event in events] == [Damaged, Received]
    assert events[1].data == FRAMES[3][6:]


def test_a_sync_inside_a_taken_frame_is_not_looked_at_again():
    left = int.from_bytes(whiten(b"\0\x2d\xd4")[1:], "little", signed=True)
    wire = encode(TeamFrame(0, 7, ((left, 0), (0, 0), (0, 0))), 3)
    assert wire[9:11] == b"\x2d\xd4"
    decoder = Decoder(3)
    events = decoder.feed(wire + b"\0" * 40) + decoder.flush()
    assert events[1:] == [Damaged(b"\0" * 40, Reason.NO_SYNC, 23 * 25000)]
    assert (decoder.valid, decoder.rejected) == (1, 0)


def test_a_pause_before_the_sync_harms_nothing():
    decoder = Decoder(3)
    first = decoder.feed(FRAMES[3][:6])
    decoder.gap()
    events = first + decoder.feed(FRAMES[3][6:])
    assert [type(event) for event in events] == [Damaged, Received]


@pytest.mark.parametrize(
    ("spacing", "accepted"), [(23759, 0), (23760, 1), (24960, 1), (26160, 1), (26161, 0)]
)
def test_the_spacing_limits_are_1040_us_and_50_us_either_side_inclusive(spacing, accepted):
    for late in range(7, 23):  # one spacing differs, the others are the robot's own character
        decoder, tick, symbols = Decoder(3), 0, []
        for place, byte in enumerate(FRAMES[3]):
            tick += spacing if place == late else 24960
            symbols.append((byte, True, tick))
        decoder.feed_symbols(symbols)
        assert decoder.valid == accepted


@given(team_frames(3))
def test_a_robot_of_another_network_size_takes_no_frame(frame):
    decoder = Decoder(5)
    decoder.feed(encode(frame, 3) * 3)
    assert decoder.valid == 0


def test_feeding_bytes_at_a_tick_measures_the_pause_before_them():
    decoder = Decoder(3)
    head, tail = FRAMES[3][:10], FRAMES[3][10:]
    decoder.feed(head, 1000)
    (frame,) = decoder.feed(tail, 1000 + 250_000 + 480)
    assert (frame.start_tick, frame.last_tick) == (1000, 1000 + 250_480 + 12 * 25000)
    decoder.feed(head, 2_000_000)
    assert decoder.feed(tail, 2_000_000 + 250_000 + 1920) == []


def test_a_run_of_garbage_is_given_out_in_pieces_so_that_memory_stays_bounded():
    decoder = Decoder(5)
    events = [event for _ in range(100) for event in decoder.feed(b"\x2d\xd4" * 500)]
    assert {len(event.data) for event in events} == {module.RUN_LIMIT}
    assert {event.reason for event in events} == {Reason.BAD_CRC}
    assert len(values(decoder)["_data"]) < module.RUN_LIMIT + table.DOWNLINK[5].size


def test_a_flushed_decoder_starts_afresh_but_keeps_its_counters():
    decoder = Decoder(3)
    decoder.feed(FRAMES[3] + FRAMES[3][:10])
    decoder.flush()
    assert decoder.feed(FRAMES[3][10:]) == []
    assert decoder.valid == 1
    assert "1 valid, 0 rejected, 13 characters pending" in repr(decoder)


# The hot scanner


@pytest.mark.slow
@settings(max_examples=150)
@given(streams, st.sampled_from([1, 7, module.RUN_LIMIT]), st.integers(0, 200))
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
    for data, tick in [*parts, (FRAMES[3], None)]:
        assert fast.feed(data, tick) == slow.feed(data, tick)
        assert snapshot(fast) == snapshot(slow)


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
@pytest.mark.parametrize("run_limit", [0, module.RUN_LIMIT + 1])
def test_a_run_limit_that_does_not_fit_is_refused(kind, run_limit):
    with pytest.raises(ValueError, match="run_limit"):
        kind(FORMATS[0], run_limit)


def test_without_the_spacing_rule_pauses_inside_a_frame_are_taken():
    form = table.downlink(3)
    symbols = [(byte, True, place * 40_000) for place, byte in enumerate(FRAMES[3])]
    strict, loose = Scanner(form), Scanner(form, tolerance_ticks=TICK_LIMIT)
    strict.feed_symbols(symbols)
    loose.feed_symbols(symbols)
    assert (strict.valid, loose.valid) == (0, 1)


@pytest.mark.skipif(engine.active() != "compiled", reason="the compiled decoder is not installed")
def test_twenty_megabytes_a_second_of_frames_of_noise_and_of_the_worst_input():
    """CPU time, best of a few: `python -m benchmarks.codec` measures properly."""
    rates = {
        name: length / best_time(job) / 1e6 for name, length, job in codec_jobs(500_000) if "decoder" in name
    }
    assert len(rates) == 5
    assert min(rates.values()) >= 20, rates
