"""Transmissions as rows: nothing is lost, memory stays small, freshness is the robot's, pauses end frames."""

import tracemalloc

from hypothesis import given, settings
from hypothesis import strategies as st

from miro_protocol.events import Damaged, Reason, Received
from miro_protocol.frames import TeamFrame, TelemetryFrame, encode
from miro_protocol.transmission import Transmission
from mirotwin.recording.capture.detect import FORMATS
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.rows import DecodedRow, rows
from mirotwin.recording.capture.source import READ_ERRORS, open_source

CHARACTER = 25_000


def team(seq, n=3):
    return encode(TeamFrame(0, seq, ((seq, -seq),) * n), n)


def decoded(sent, n=3):
    return list(rows(sent, lambda network: n))


def read(path, format):
    """Everything in a file, and the error it ends with."""
    found = []
    with Input(str(path)) as given:
        try:
            for row in rows(open_source(given, format, print).sent, lambda network: 3):
                found.append(row)
        except READ_ERRORS as error:
            return found, error
    return found, None


@given(st.binary(max_size=400))
def test_every_raw_byte_is_in_exactly_one_row(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("raw") / "a"
    path.write_bytes(data)
    found, error = read(path, "raw")
    assert error is None
    assert b"".join(row.event.data for row in found) == data
    place = 0
    for row in found:
        assert row.offset == place
        place += len(row.event.data)


@settings(max_examples=200)
@given(
    st.binary(max_size=200),
    st.sampled_from([b"", b"\x89MCAP0\r\n", b"\x0a\x0d\x0d\x0a"]),
    st.sampled_from(FORMATS),
)
def test_any_bytes_in_any_format_give_rows_and_at_most_the_formats_own_error(
    tmp_path_factory, data, magic, format
):
    path = tmp_path_factory.mktemp("any") / "a"
    path.write_bytes(magic + data)
    found, error = read(path, format)
    assert error is None or str(error).startswith(str(path))
    assert all(isinstance(row, DecodedRow) for row in found)


def test_freshness_is_judged_as_the_robot_does():
    sent = [Transmission(at * 800_800, ">", team(seq)) for at, seq in enumerate([0, 1, 1, 20, 2])]
    sent.append(Transmission(10 * 800_800, ">", team(30)))
    assert [row.fresh for row in decoded(sent)] == [True, True, False, False, True, True]


def test_both_directions_and_networks_are_decoded_apart():
    answer = encode(TelemetryFrame(0, 1), 3)
    sent = []
    for at in range(0, 23, 5):  # five characters of each in turn
        sent.append(Transmission(at * CHARACTER, ">", team(7)[at : at + 5]))
        sent.append(Transmission(at * CHARACTER, ">", team(8)[at : at + 5], 1))
        if answer[at : at + 5]:
            sent.append(Transmission(at * 24960, "<", answer[at : at + 5]))
    found = decoded(sent)
    assert sorted((row.network, row.direction, row.event.data) for row in found) == [
        (0, "<", answer),
        (0, ">", team(7)),
        (1, ">", team(8)),
    ]


def test_a_pause_of_two_characters_gives_out_what_can_be_no_frame_any_more():
    first, second = decoded([Transmission(0, ">", team(1)[:-1]), Transmission(24 * CHARACTER, ">", team(2))])
    assert first.event == Damaged(team(1)[:-1], Reason.CUT_SHORT, 0)
    assert isinstance(second.event, Received)


def test_a_bad_stop_bit_spoils_the_frame_it_is_in():
    wire = team(1)
    for place in range(6, len(wire)):
        (row,) = decoded([Transmission(0, ">", wire, 0, (place,))])
        assert row.event == Damaged(wire, Reason.BAD_STOP_BIT, 0)


def test_a_frame_that_says_nothing_known_is_a_frame_all_the_same():
    wire = encode(TelemetryFrame(3, 4), 5)  # slot 4 in a network of three
    (row,) = decoded([Transmission(0, "<", wire)])
    assert row.message is None
    assert "slot = 4" in row.unknown


def test_memory_does_not_grow_with_the_input(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(bytes(range(256)) * (1 << 14))  # 4 MiB
    with Input(str(path)) as given:
        tracemalloc.start()
        for _ in rows(open_source(given, "raw", print).sent, lambda network: 3):
            pass
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < 1 << 20
