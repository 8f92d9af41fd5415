"""The Wireshark dissector: tshark reads our captures with it."""

import json
import os
import random
import shutil
from pathlib import Path

import pytest

from miro_protocol import dissector
from miro_protocol.decoder import Damaged, Decoder, Received
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.pcapng import render
from miro_protocol.transmission import Transmission
from tests import children

TEAM = TeamFrame(3, 7, ((100, -100), (0, 1), (-32767, 32767)))
FIVE = TeamFrame(0, 10, ((1, 2), (3, 4), (5, 6), (7, 8), (9, -10)))
TELEMETRY = TelemetryFrame(7, 1, 0x18, 0x80, 0x90, 1234, 65000, 7, 1)


def with_a_wrong_bit(wire):
    return wire[:20] + bytes([wire[20] ^ 1]) + wire[21:]


PACKETS = [
    (">", encode(TEAM, 3)),
    (">", encode(ServiceFrame.filter(8, 2, 1, 2, 3, 4), 3)),
    (">", encode(ServiceFrame.acceleration(9, 4, 5973), 5)),
    (">", encode(ServiceFrame.ping(9, 0), 5)),
    ("<", encode(TELEMETRY, 3)),
    (">", encode(FIVE, 5)),
    (">", with_a_wrong_bit(encode(FIVE, 5))),
    (">", b"hello" + encode(TEAM, 3) + b"xx" + encode(TEAM, 3)[:-3]),
    ("<", encode(FIVE, 5)),  # the wrong way round
    (">", encode(TEAM, 3) + encode(FIVE, 5)),
]


def tshark(packets, folder, *options):
    """tshark's fields of each packet."""
    (folder / "run.pcapng").write_bytes(render(packets))
    return dissected(folder / "run.pcapng", *options)


def dissected(capture, *options):
    """tshark's fields of each packet in a file; a missing tshark is an error where tests must not be skipped."""
    if shutil.which("tshark") is None:
        if "CI" not in os.environ:
            pytest.skip("tshark is not installed (Debian package tshark)")
        pytest.fail("tshark is missing: install the Debian package tshark")
    script = Path(capture).with_suffix(".lua")
    script.write_text(dissector.render())
    command = ["tshark", "-X", f"lua_script:{script}", "-d", "rtacser.data,miro", "-r", capture]
    done = children.run(
        [*command, *options, "-T", "json", "--no-duplicate-keys"],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "TZ": "UTC", "HOME": str(capture.parent)},
    )
    assert "Lua" not in done.stderr, done.stderr
    return [packet["_source"]["layers"] for packet in json.loads(done.stdout)]


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    packets = [Transmission(800_800 * at, way, data, at % 2) for at, (way, data) in enumerate(PACKETS)]
    return tshark(packets, tmp_path_factory.mktemp("capture"))


def values(tree):
    """Field name -> value or list of values, wherever in the tree they are."""
    found = {}

    def walk(node):
        for name, value in node.items():
            for one in value if isinstance(value, list) else [value]:
                if isinstance(one, dict):
                    walk(one)
                else:
                    found.setdefault(name, []).append(one)

    walk({"miro": tree.get("miro", {})})
    return {name: found[name][0] if len(found[name]) == 1 else found[name] for name in found}


def test_every_packet_has_its_tick_as_time(seen):
    times = [layers["frame"]["frame.time_epoch"] for layers in seen]
    assert times[:3] == ["0.000000000", "0.033366666", "0.066733333"]


def test_a_team_frame_shows_type_number_velocities_per_slot_and_crc(seen):
    fields = values(seen[0])
    assert (fields["miro.type"], fields["miro.seq"], fields["miro.robots"]) == ("3", "7", "3")
    shown = [(fields[f"miro.slot{slot}.left"], fields[f"miro.slot{slot}.right"]) for slot in range(3)]
    assert shown == [("100", "-100"), ("0", "1"), ("-32767", "32767")]
    assert fields["miro.crc.status"] == "1"
    assert fields["miro.crc"] == fields["miro.crc.calculated"]


def test_five_robots_are_told_from_three_by_the_crc_alone(seen):
    fields = values(seen[5])
    assert (fields["miro.robots"], fields["miro.slot4.left"], fields["miro.slot4.right"]) == ("5", "9", "-10")


def test_a_service_frame_shows_what_it_sets(seen):
    fields = values(seen[1])
    shown = [fields[f"miro.{name}"] for name in ("type", "service.slot", "service.opcode")]
    assert shown == ["1", "2", "1"]
    assert (fields["miro.service.kp"], fields["miro.service.il"]) == ("1", "4")
    assert values(seen[2])["miro.service.acceleration"] == "5973"
    assert values(seen[3])["miro.service.opcode"] == "0"


def test_telemetry_shows_slot_flags_and_counters(seen):
    fields = values(seen[4])
    assert "miro.robots" not in fields
    assert fields["miro.type"] == "2"
    assert fields["miro.telemetry.slot"] == "1"
    flags = [fields[f"miro.telemetry.{name}"] for name in ("stopped", "motors_off", "init_failed")]
    assert [flag in ("1", "True") for flag in flags] == [True, True, False]
    assert (fields["miro.telemetry.status_left"], fields["miro.telemetry.position_right"]) == ("128", "65000")
    assert (fields["miro.telemetry.accepted"], fields["miro.telemetry.rejected"]) == ("7", "1")


def test_a_wrong_bit_shows_as_a_bad_crc(seen):
    fields = values(seen[6])
    assert (fields["miro.damage"], fields["miro.crc.status"]) == ("bad crc", "0")
    assert fields["miro.crc"] != fields["miro.crc.calculated"]
    assert "miro.seq" not in fields


def test_a_packet_may_hold_frames_and_damage_in_any_order(seen):
    fields = values(seen[7])
    assert fields["miro.damage"] == ["no sync", "cut short"]
    assert fields["miro.seq"] == "7"
    assert values(seen[9])["miro.seq"] == ["7", "10"]


def test_a_frame_in_the_wrong_direction_is_damage(seen):
    assert "miro.seq" not in values(seen[8])
    assert values(seen[8])["miro.damage"] == "bad crc"


def judged(runs):
    """What the decoder makes of each run by itself: numbers of frames, and reasons of damage."""
    for data in runs:
        decoder = Decoder(3)
        events = decoder.feed(data) + decoder.flush()
        frames = [str(event.seq) for event in events if isinstance(event, Received)]
        damage = [event.reason.name for event in events if isinstance(event, Damaged)]
        yield frames, damage


def as_list(value):
    return value if isinstance(value, list) else [value]


def test_tshark_finds_the_frames_the_decoder_finds(tmp_path):
    """The reasons agree as well, but that the dissector judges damage by its first sync only."""
    draw = random.Random(4)
    pieces = [encode(TEAM, 3), with_a_wrong_bit(encode(TEAM, 3)), encode(TEAM, 3)[:-4], b"\x2d\xd4", b"noise"]
    runs = [b"".join(draw.choices(pieces, k=draw.randint(1, 5))) for _ in range(100)]
    layers = tshark(
        [Transmission(at, ">", run) for at, run in enumerate(runs)], tmp_path, "-o", "miro.robots:3"
    )
    for (frames, damage), tree in zip(judged(runs), layers, strict=True):
        fields = values(tree)
        assert as_list(fields.get("miro.seq", [])) == frames
        assert len(as_list(fields.get("miro.damage", []))) == len(damage)
