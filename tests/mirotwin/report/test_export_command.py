"""`mirotwin export`: a run as a capture that Wireshark opens and as a stream file that `replay` takes."""

import os
import re

import pytest

from miro_protocol import stream
from miro_protocol.decoder import Decoder, Received, TelemetryDecoder
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.pcapng import render
from miro_protocol.pcapng_reader import iterate
from miro_protocol.table import SERVICE_DATA, Flags
from miro_protocol.transmission import Transmission
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World
from mirotwin.recording import reader as recording_reader
from mirotwin.recording.recorder import Recorder, RunSource
from tests.mirotwin import program
from tests.protocol.test_dissector import dissected, values

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
    _, out, _ = mirotwin("export", tmp_path / "a.pcapng", "--out", tmp_path / "b.stream")
    assert "b.stream: 3 transmissions from the host and 0 from robots" in out
    text = (tmp_path / "b.stream").read_text()
    assert text.startswith("# mirotwin stream 1\n")
    entries = stream.parse(text).entries
    assert [entry.what for entry in entries] == PACKETS
    assert [entry.comment for entry in entries] == [f"team seq={index}" for index in range(3)]
    assert export(tmp_path / "b.stream", "c.pcapng").read_bytes() == render(PACKETS)


@pytest.mark.parametrize("name", ["run.pcapng", "run.stream", "fox.mcap"])
def test_nothing_is_said_where_that_is_asked_for(mirotwin, finished, tmp_path, name):
    assert mirotwin.succeeds("export", finished / "run.mcap", "--out", tmp_path / name, "-q") == ""


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
        (
            b"\x55\xff",
            "raw bytes without times; --assume-contiguous takes all characters to follow each other",
        ),
        (b"55 ff", "hex text without times"),
        (b"\xd4\xc3\xb2\xa1", "offset 0: the file ends in the middle of a packet"),
        (render([*PACKETS[1:], PACKETS[0]]), "tick 0: comes after tick 800800; sort the capture first"),
    ],
)
def test_what_cannot_be_converted_is_named_and_nothing_is_written(mirotwin, tmp_path, data, message):
    (tmp_path / "a").write_bytes(data)
    assert message in mirotwin.ends(2, "export", tmp_path / "a", "--out", tmp_path / "b.stream")
    assert os.listdir(tmp_path) == ["a"]


def test_a_network_that_is_not_there_is_an_error_that_names_those_that_are(mirotwin, finished, tmp_path):
    out = tmp_path / "x.pcapng"
    err = mirotwin.refuses("export", finished / "run.mcap", "--network", 9, "--out", out)
    assert "--network 9: has no transmissions; networks that have some: 0" in err
    assert not out.exists()


SCENARIO = """
name = "two"
duration_s = 0.5
[[network]]
robots = 3
[[network.robot]]
slot = 1
reference.kind = "line"
[[network]]
robots = 5
[[network.robot]]
slot = 4
reference.kind = "arc"
"""


def shown_frame(fields):
    """The message that tshark shows."""
    number = {name.removeprefix("miro."): int(value, 0) for name, value in fields.items() if is_number(value)}
    kind, seq = number["type"], number["seq"]
    if kind == 2:
        raised = [flag for flag in Flags if fields[f"miro.telemetry.{flag.name.lower()}"] in ("1", "True")]
        rest = {name: number[f"telemetry.{name}"] for name in TelemetryFrame.__struct_fields__[3:]}
        return TelemetryFrame(seq, number["telemetry.slot"], sum(raised), **rest)
    if kind == 1:
        data = SERVICE_DATA[number["service.opcode"]]
        values = tuple(number[f"service.{field.name}"] for field in data)
        return ServiceFrame(seq, number["service.slot"], number["service.opcode"], values)
    slots = range(number["robots"])
    return TeamFrame(kind, seq, tuple((number[f"slot{at}.left"], number[f"slot{at}.right"]) for at in slots))


def is_number(value):
    return isinstance(value, str) and re.fullmatch("-?[0-9]+|0x[0-9a-f]+", value)


@pytest.fixture(scope="module")
def run(mirotwin, tmp_path_factory):
    """A world of two networks, 3 and 5 robots, with settings sent: what was sent and heard, and its capture."""
    folder = tmp_path_factory.mktemp("run")
    image = load_hex(image_path())
    world = World(scenario_file.parse(SCENARIO, "two"), 3, image)
    world.networks[0].station.request(2, 1, (1, 2, 3, 4))
    world.networks[1].station.request(4, 2, (5973,))
    wire = []
    source = RunSource("two", SCENARIO, 3, image.path.read_bytes(), image.sha256)
    with (folder / "run.mcap").open("wb") as stream, Recorder(stream, source) as recorder:
        for _ in range(12):
            period = world.step()
            recorder.write(period)
            wire += period.wire
    mirotwin.ends(0, "export", folder / "run.mcap", "--out", folder / "run.pcapng")
    return wire, dissected(folder / "run.pcapng")


def test_tshark_shows_of_an_exported_recording_the_fields_that_were_sent(run):
    """Through the whole chain: station, radio, firmware, recording, export, Wireshark."""
    wire, layers = run
    sent = {}
    for run_of_bytes in wire:
        key = run_of_bytes.network, run_of_bytes.direction
        decoder = sent.setdefault(key, ([], decoder_of(run_of_bytes)))
        n = 5 if run_of_bytes.network else 3
        events = decoder[1].feed(run_of_bytes.data, run_of_bytes.tick)
        decoder[0].extend(event.message(n) for event in events if isinstance(event, Received))
    shown = {key: [] for key in sent}
    for tree in layers:
        way = {"0x01": ">", "0x02": "<"}[tree["rtacser"]["rtacser.eventtype"]]
        network = int(tree["frame"]["frame.interface_id"])
        fields = values(tree)
        if "miro.seq" in fields:
            shown[network, way].append(shown_frame(fields))
    assert shown == {key: messages for key, (messages, _) in sent.items()}
    kinds = {type(message) for messages in shown.values() for message in messages}
    assert kinds == {TeamFrame, ServiceFrame, TelemetryFrame}


def decoder_of(run_of_bytes):
    if run_of_bytes.direction == "<":
        return TelemetryDecoder()
    return Decoder(5 if run_of_bytes.network else 3)
