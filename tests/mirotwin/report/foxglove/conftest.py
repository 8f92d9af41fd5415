"""What the tests of Foxglove's topics share: a run of two teams, its export, and messages as the library reads them."""

import io
from collections import namedtuple

import msgspec
import pytest
from mcap.reader import make_reader

from mirotwin.report.foxglove.convert import Conversion

TWO_TEAMS = """name = "teams"
title = "Two teams"
duration_s = 1.2

[camera]
kind = "pixels"
lost_robots = 0.1
dropped_frames = 0.05
ball = { x_cm = 30.0, y_cm = 40.0 }
lens = { height_m = 2.6, tilt_x_rad = 0.02, tilt_y_rad = -0.03, turn_rad = 0.1, pixel_aspect = 1.05 }

[[network]]
[network.radio]
bit_error_rate = 4e-3

[[network.robot]]
slot = 0
start_error_x_cm = 2.0
reference.kind = "line"

[[network.robot]]
slot = 2
reference = { kind = "line", start_y_cm = 50.0, heading_deg = -10.0 }

[[network]]
host = "silent"

[[network.robot]]
slot = 1
reference = { kind = "line", start_x_cm = 80.0, start_y_cm = 60.0, drive_s = 1.0 }
"""


Read = namedtuple("Read", "topic name schema time_ns content")
"""A message as the library reads it; `schema` is parsed."""


def read(data):
    """All messages in the order of time."""
    schemas = {}
    found = []
    for schema, channel, message in make_reader(io.BytesIO(data)).iter_messages():
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        if schema.id not in schemas:
            schemas[schema.id] = msgspec.json.decode(schema.data)
        content = msgspec.json.decode(message.data)
        found.append(Read(channel.topic, schema.name, schemas[schema.id], message.log_time, content))
    return found


def exported(data):
    """A recording with Foxglove's topics, and what is said of it."""
    stream = io.BytesIO()
    result = Conversion(data, "run.mcap", stream)
    return stream.getvalue(), result


@pytest.fixture(scope="session")
def recording(mirotwin, tmp_path_factory):
    """The two teams, 36 control periods, with frames."""
    folder = tmp_path_factory.mktemp("teams")
    (folder / "teams.toml").write_text(TWO_TEAMS)
    quietly = ("--out", folder / "out", "-q", "--no-figure")
    mirotwin.succeeds("run", folder / "teams.toml", "--seed", 3, "--record-frames", *quietly)
    return (folder / "out" / "run.mcap").read_bytes()


@pytest.fixture(scope="session")
def shown(recording):
    """All messages of its export."""
    return read(exported(recording)[0])
