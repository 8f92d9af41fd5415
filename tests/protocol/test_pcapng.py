"""Captures: what is written comes back to the tick, and what cannot be read is named after all that could."""

import struct
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_protocol import pcapng
from miro_protocol.pcapng import MAX_DATA, MAX_TICK, render
from miro_protocol.pcapng_reader import CaptureError, events_line, iterate
from miro_protocol.transmission import Transmission

packets = st.builds(
    Transmission,
    st.integers(0, MAX_TICK),
    st.sampled_from("<>"),
    st.binary(min_size=1, max_size=40),
    st.integers(0, 3),
)
SOME = [
    Transmission(0, ">", b"abc"),
    Transmission(800_800, "<", b"\0" * 4, 1),
    Transmission(MAX_TICK, ">", b"z"),
]


def read(data):
    """What could be read, and the error if there was one."""
    found = []
    try:
        for packet in iterate(data, "a.pcapng"):
            found.append(packet)
    except CaptureError as error:
        return found, error
    return found, None


@given(st.lists(packets, max_size=8))
def test_what_is_written_comes_back_to_the_tick(some):
    assert read(render(some)) == (some, None)


def test_the_bytes_are_these_whenever_and_wherever_they_are_written():
    assert render([Transmission(800_800, "<", b"hi")]).hex(" ", 4) == (
        "0a0d0d0a 1c000000 4d3c2b1a 01000000 ffffffff ffffffff 1c000000"
        " 01000000 3c000000 fa000000 00000000 02000900 6e657477 6f726b20 30000000"
        " 08000800 80250000 00000000 09000100 09000000 00000000 3c000000"
        " 06000000 3c000000 00000000 00000000 8a22fd01 0e000000 0e000000"
        " 00000000 00008256 02000000 68690000 02000400 01000000 00000000 3c000000"
    )


@pytest.mark.parametrize(
    ("packet", "message"),
    [
        (Transmission(-1, ">", b"a"), "tick = -1: must be 0.."),
        (Transmission(MAX_TICK + 1, ">", b"a"), "must be 0.."),
        (Transmission(0, "!", b"a"), "direction = '!'"),
        (Transmission(0, ">", b"a", -1), "network = -1"),
        (Transmission(0, ">", b""), "data of 0 characters"),
        (Transmission(0, ">", bytes(MAX_DATA + 1)), "characters: a packet has 1.."),
    ],
)
def test_a_packet_that_cannot_be_written_is_refused_by_name(packet, message):
    with pytest.raises(ValueError, match=message):
        render([packet])


@pytest.mark.slow
@settings(max_examples=300)
@given(st.integers(0, len(render(SOME)) - 1))
def test_a_capture_cut_short_anywhere_gives_what_came_before_and_the_offset(size):
    found, error = read(render(SOME)[:size])
    assert found == SOME[: len(found)]
    starts = [0]
    for block in pcapng.blocks(SOME):
        starts.append(starts[-1] + len(block))
    if size in starts and size:
        assert error is None
    else:
        assert error.offset == max(start for start in starts if start <= size)
        assert str(error).startswith(f"a.pcapng: offset {error.offset}: ")


@settings(max_examples=300)
@given(st.binary(max_size=200), st.integers(0, 300), st.booleans())
def test_any_bytes_give_packets_or_one_capture_error_and_nothing_else(noise, place, replace):
    whole = render(SOME)
    place = min(place, len(whole))
    found, _ = read(whole[:place] + noise + whole[place + len(noise) * replace :])
    assert all(isinstance(packet, Transmission) for packet in found)


def big_endian(event=1, units=None, linktype=250, offset=None, captured=None):
    """A capture as another program on a big-endian machine would write it."""

    def block(kind, body):
        body += bytes(-len(body) % 4)
        return struct.pack(">II", kind, len(body) + 12) + body + struct.pack(">I", len(body) + 12)

    options = b"" if units is None else struct.pack(">HHB3x", 9, 1, units)
    options += b"" if offset is None else struct.pack(">HHq", 14, 8, offset)
    payload = struct.pack(">IIBBH", 9, 9, event, 0x7F, 0xFFFF) + b"data"
    size = len(payload) if captured is None else captured
    head = struct.pack(">IIIII", 0, 0, 1_500_000, size, len(payload))
    return (
        block(0x0A0D0D0A, struct.pack(">IHHq", 0x1A2B3C4D, 1, 2, -1))
        + block(1, struct.pack(">HHI", linktype, 0, 0xFFFF) + options)
        + block(0xBAD, b"not known to anybody")
        + block(6, head + payload[:size])
    )


@pytest.mark.parametrize(
    ("capture", "tick", "direction"),
    [
        (big_endian(), 36_000_000, ">"),  # microseconds where nothing is said
        (big_endian(2, units=9), 36_000, "<"),
        (big_endian(3, units=0x80 | 20), -(-1_500_000 * 24_000_000 // 2**20), ">"),
        (big_endian(4, offset=10), 276_000_000, "<"),
    ],
)
def test_captures_of_other_programs_are_read(capture, tick, direction):
    assert read(capture) == ([Transmission(tick, direction, b"data")], None)


def test_events_without_characters_are_passed_over_and_counted():
    passed_over = Counter()
    capture = big_endian(event=0) + big_endian(event=0x42) + render(SOME) + big_endian(event=0x42)
    assert list(iterate(capture, passed_over=passed_over)) == SOME
    assert passed_over == {"STATUS_CHANGE": 1, "of unknown event type 42h": 2}


def test_what_was_passed_over_is_told_by_the_events_names():
    assert events_line(Counter({"of unknown event type 42h": 2, "CAPTURE_DATA_LOST": 1})) == (
        "passed over 3 packets other than data sent or received: "
        "2 of unknown event type 42h, 1 CAPTURE_DATA_LOST"
    )
    many = events_line(Counter(map(str, range(11, 99))))
    assert many.startswith("passed over 88 packets")
    assert many.endswith(", 84 more")
    assert events_line(Counter(["STATUS_CHANGE"])).startswith("passed over 1 packet other than")


@pytest.mark.parametrize(
    ("capture", "reason"),
    [
        (b"", "offset 0: empty file"),
        (b"hello world!", "offset 0: not a pcapng file"),
        (b"\xd4\xc3\xb2\xa1" + bytes(20), "old pcap format; read it as pcap"),
        (
            big_endian(linktype=1),
            "no packet of a serial line, but 1 packet of link type 1; give a capture of a serial",
        ),
        (big_endian(captured=14), "only 14 of 16 bytes were captured"),
        (big_endian(offset=1 << 40), "is not in 0.."),
        (big_endian(offset=-2), "tick -12000000 is not in"),
    ],
)
def test_what_is_no_capture_of_a_serial_line_is_named_with_its_remedy(capture, reason):
    found, error = read(capture)
    assert found == []
    assert reason in str(error)
