"""`mirotwin export`: a run as a capture that Wireshark opens and as a stream file that `replay` takes."""

import os

import pytest

from miro_protocol import stream
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.pcapng import render
from miro_protocol.pcapng_reader import iterate
from miro_protocol.transmission import Transmission
from mirotwin.recording import reader as recording_reader
from tests.mirotwin import program

FRAMES = [encode(TeamFrame(0, seq, ((seq, -seq),) * 3), 3) for seq in range(3)]
PACKETS = [Transmission(index * 800_800, ">", data) for index, data in enumerate(FRAMES)]


@pytest.fixture
def export(mirotwin, tmp_path):
    """Exports a file, or one with these bytes, to a file of this name."""

    def call(given, name, *options):
        if isinstance(given, bytes):
            (tmp_path / "given").write_bytes(given)
            given = tmp_path / "given"
        mirotwin.ends(0, "export", given, "--out", tmp_path / name, *options)
        return tmp_path / name

    return call


def test_a_recording_becomes_packets_in_the_order_of_time_both_ways(export, finished):
    packets = list(iterate(export(finished / "run.mcap", "run.pcapng").read_bytes()))
    recorded = [run for period in recording_reader.read(finished / "run.mcap").periods for run in period.wire]
    for direction in "<>":
        mine = b"".join(packet.data for packet in packets if packet.direction == direction)
        assert mine == b"".join(run.data for run in recorded if run.direction == direction)
    assert {run.direction for run in recorded} == {"<", ">"}
    ticks = [packet.tick for packet in packets]
    assert ticks == sorted(ticks)
    assert {run.tick for run in recorded if run.direction == ">"} <= set(ticks)


def test_the_same_recording_gives_the_same_bytes_in_any_process(finished, tmp_path):
    found = []
    for seed in ("1", "2"):
        other = {**os.environ, "PYTHONHASHSEED": seed, "TZ": f"UTC+{seed}"}
        words = ("export", finished / "run.mcap", "--out", "-")
        found.append(program.run(*words, env=other, text=False, check=True).stdout)
    assert found[0] == found[1]
    assert len(list(iterate(found[0]))) > 6


def test_a_stream_and_a_capture_become_each_other(mirotwin, export, tmp_path):
    (tmp_path / "a.pcapng").write_bytes(render(PACKETS))
    out = mirotwin.succeeds("export", tmp_path / "a.pcapng", "--out", tmp_path / "b.stream")
    assert "b.stream: 3 transmissions from the host and 0 from robots" in out
    text = (tmp_path / "b.stream").read_text()
    assert text.startswith("# mirotwin stream 1\n")
    entries = stream.parse(text).entries
    assert [entry.what for entry in entries] == PACKETS
    assert [entry.comment for entry in entries] == [f"team seq={index}" for index in range(3)]
    assert export(tmp_path / "b.stream", "c.pcapng").read_bytes() == render(PACKETS)


def test_the_stream_of_a_recording_is_taken_by_replay(mirotwin, export, finished):
    stream = export(finished / "run.mcap", "run.stream")
    assert mirotwin.succeeds("replay", stream).splitlines()[-1].split()[1] == "6"


def test_damage_is_called_so_in_the_comment(export):
    capture = render([Transmission(5, ">", b"xx" + FRAMES[1]), Transmission(800_800, "<", b"abc")])
    comments = [entry.comment for entry in stream.read(export(capture, "b", "--as", "stream")).entries]
    assert comments == ["2 bytes, no sync; team seq=1", "3 bytes, no sync"]


def test_one_of_several_networks_can_be_chosen(export):
    packets = [Transmission(5, ">", b"a"), Transmission(6, ">", b"b", 1), Transmission(7, "<", b"c", 1)]
    text, capture = (export(render(packets), name, "--network", 1) for name in ("b.stream", "b.pcapng"))
    assert stream.read(text).transmissions() == list(iterate(capture.read_bytes())) == packets[1:]


@pytest.mark.parametrize(
    "sent",
    [
        [Transmission(5, ">", b"a"), Transmission(6, ">", b"b", 1), Transmission(7, "<", b"c", 1)],
        [Transmission(5, ">", b"abc", 0, (0, 2))],
    ],
)
def test_more_networks_or_bad_stop_bits_make_a_stream_of_version_2(mirotwin, export, tmp_path, sent):
    stream.write(tmp_path / "a.stream", sent)
    exported = export(tmp_path / "a.stream", "b.stream")
    assert exported.read_text().startswith("# mirotwin stream 2\n")
    assert stream.read(exported).transmissions() == sent


def test_bad_stop_bits_that_a_capture_cannot_hold_are_counted(mirotwin, tmp_path):
    stream.write(tmp_path / "a.stream", [Transmission(5, ">", b"abc", 0, (0, 2))])
    err = mirotwin.ends(0, "export", tmp_path / "a.stream", "--out", tmp_path / "b.pcapng")
    assert "2 bad stop bits were left out" in err


def test_of_an_input_cut_short_all_that_could_be_read_is_written(mirotwin, tmp_path):
    (tmp_path / "a").write_bytes(render(PACKETS)[:-5])
    err = mirotwin.ends(2, "export", tmp_path / "a", "--out", tmp_path / "b.pcapng")
    assert "the file ends in the middle of a block" in err
    assert "everything before it was written" in err
    assert (tmp_path / "b.pcapng").read_bytes() == render(PACKETS[:2])


@pytest.mark.slow
def test_a_run_longer_than_a_packet_may_be_is_cut(export):
    data = bytes(300_000)
    sent = stream.format_stream([Transmission(7, ">", data)]).encode()
    first, second = iterate(export(sent, "b.pcapng").read_bytes())
    assert first.data + second.data == data
    assert second.tick == 7 + len(first.data) * 25_000


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\x55\xff", "raw bytes without times; give a recording, stream or capture"),
        (b"55 ff", "hex text without times"),
        (b"\xd4\xc3\xb2\xa1", "offset 0: a capture in the old pcap format"),
        (render([PACKETS[1], PACKETS[0]]), "tick 0: comes after tick 800800; sort the capture first"),
    ],
)
def test_what_cannot_be_converted_is_named_and_nothing_is_written(mirotwin, tmp_path, data, message):
    (tmp_path / "a").write_bytes(data)
    assert message in mirotwin.refuses("export", tmp_path / "a", "--out", tmp_path / "b.stream")
    assert os.listdir(tmp_path) == ["a"]


def test_a_network_that_is_not_there_is_an_error_that_names_those_that_are(mirotwin, finished, tmp_path):
    out = tmp_path / "x.pcapng"
    err = mirotwin.refuses("export", finished / "run.mcap", "--network", 9, "--out", out)
    assert "--network 9: nothing of it; networks there: 0" in err
    assert not out.exists()
