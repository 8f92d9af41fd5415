"""An exported recording in tshark: the fields it prints are those that were sent."""

import re

import pytest

from miro_protocol.decoder import Decoder, Received, TelemetryDecoder
from miro_protocol.frames import ServiceFrame, TeamFrame, TelemetryFrame
from miro_protocol.table import SERVICE_DATA, Flags
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World
from mirotwin.recording.recorder import Recorder, RunSource
from tests.protocol.test_dissector import dissected, values

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
