"""What the tests of Foxglove's topics share: a run of two teams, its export, and messages as the library reads them."""

import io
from functools import cache
from typing import Any, NamedTuple

import msgspec
from mcap.reader import make_reader

from mirotwin.report.foxglove.convert import convert

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


class Read(NamedTuple):
    """A message as the library reads it; `schema` is parsed."""

    topic: str
    name: str
    schema: dict[str, Any]
    time_ns: int
    content: Any


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
    result = convert(data, "run.mcap", stream)
    return stream.getvalue(), result


@cache
def teams(folder, mirotwin):
    """The recording of the two teams, with frames."""
    scenario = folder / "teams.toml"
    scenario.write_text(TWO_TEAMS)
    done = mirotwin(
        *("run", scenario, "--seed", 3, "--out", folder / "out", "-q", "--no-figure", "--record-frames")
    )
    assert (done[0], done[2]) == (0, "")
    return (folder / "out" / "run.mcap").read_bytes()
