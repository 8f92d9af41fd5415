"""Recordings: MCAP files as they are, and files whose records are drawn and whose lengths and sums are right."""

import struct
from itertools import islice
from zlib import crc32

from tests.fuzz.target import Draws, Target, folder, refused
from tests.mirotwin.mutated_files import without_sums

_MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _ATTACHMENT, _METADATA, _DATA_END = (
    1,
    2,
    3,
    4,
    5,
    6,
    9,
    12,
    15,
)
_SCENARIO = (
    b'name = "one"\nduration_s = 0.1\n[[network]]\n[[network.robot]]\nslot = 0\nreference.kind = "line"\n'
)
_NAMES = (b"scenario.toml", b"firmware.ihx", b"symbols.json", b"resumed.world", b"other")


def _text(data):
    return struct.pack("<I", len(data)) + data


def _record(opcode, body):
    return struct.pack("<BQ", opcode, len(body)) + body


def _attachment(name, data):
    body = struct.pack("<QQ", 0, 0) + _text(name) + _text(b"text/plain") + struct.pack("<Q", len(data)) + data
    return _record(_ATTACHMENT, body + struct.pack("<I", crc32(body)))


def _metadata(name, values):
    pairs = b"".join(_text(key) + _text(value) for key, value in values.items())
    return _record(_METADATA, _text(name) + _text(pairs))


def _built(data, begin):
    """A file whose records `data` draws: whole, with right lengths and sums."""
    draw, out, chunk = Draws(data), [_MAGIC, _record(_HEADER, _text(b"") + _text(b""))], None
    if not draw.below(8):
        begin = b""
    out.append(begin)
    while draw.left:
        kind = draw.below(8)
        if kind == 0:
            found = _record(draw.below(256), draw.take(draw.below(256)))
        elif kind == 1:
            number = draw.below(64)
            body = (
                struct.pack("<HH", number, 0) + _text(draw.take(draw.below(40))) + _text(b"json") + _text(b"")
            )
            found = _record(_CHANNEL, body)
        elif kind == 2:
            found = _attachment(_NAMES[draw.below(len(_NAMES))], draw.take(draw.below(1 << 12)))
        elif kind == 3:
            keys = (b"seed", b"format", b"state", b"record", b"reason")
            found = _metadata(
                (b"mirotwin", b"broken off")[draw.below(2)], {keys[draw.below(5)]: draw.take(draw.below(9))}
            )
        elif kind == 4:
            if chunk is None:
                chunk = b""
                continue
            whole = (
                struct.pack("<QQQII", 0, 0, len(chunk), crc32(chunk), 0)
                + struct.pack("<Q", len(chunk))
                + chunk
            )
            found, chunk = _record(_CHUNK, whole), None
        else:
            head = struct.pack("<HIQQ", draw.below(64), 0, 0, 0)
            found = _record(_MESSAGE, head + draw.take(draw.below(1 << 11)))
        if chunk is None:
            out.append(found)
        else:
            chunk += found
    end = b"".join(out)
    end += _record(_DATA_END, struct.pack("<I", crc32(end)))
    return end + _record(_FOOTER, bytes(20)) + _MAGIC


def _begin():
    """What a reader wants at the beginning of a recording."""
    from mirotwin.recording.recorder import (
        FIRMWARE_ATTACHMENT,
        FORMAT,
        METADATA,
        RESUMED_ATTACHMENT,
        SCENARIO_ATTACHMENT,
        SYMBOLS_ATTACHMENT,
    )
    from tests.mirotwin.mutated_files import ECHO, hex_records

    names = (SCENARIO_ATTACHMENT, FIRMWARE_ATTACHMENT, SYMBOLS_ATTACHMENT, RESUMED_ATTACHMENT)
    assert tuple(name.encode() for name in names) == _NAMES[:4], names
    return b"".join(
        [
            _metadata(METADATA.encode(), {b"format": FORMAT.encode(), b"seed": b"3", b"scenario": b"one"}),
            _attachment(_NAMES[0], _SCENARIO),
            _attachment(_NAMES[1], hex_records(ECHO)),
            _attachment(_NAMES[2], b'{"_main":[0,"code"]}'),
        ]
    )


def _recording():
    from miro_exact.bad_input import BadInput
    from mirotwin.recording.capture.input import Input
    from mirotwin.recording.capture.recorded import transmissions, transmissions_of
    from mirotwin.recording.container import RecordingError
    from mirotwin.recording.reader import parse
    from mirotwin.rerun.job import load_job

    begin = _begin()
    path = folder() / "fuzz.mcap"

    def read(data):
        try:
            found = parse(data, "fuzz.mcap")
            outcome = f"{min(len(found.periods), 3)} periods"
            transmissions_of(found.periods)
        except RecordingError as error:
            outcome = refused(error)
        path.write_bytes(data)
        said = []
        with Input(str(path)) as given:
            try:
                count = sum(1 for _ in islice(transmissions(given, {}, said.append), 5_000))
                outcome += f", {min(count, 3)} transmissions"
            except RecordingError as error:
                outcome += f", {refused(error)}"
        assert all(line.isprintable() for line in said), said
        return outcome

    def run(data):
        kind, rest = data[:1], data[1:]
        if kind == b"\0":
            return read(rest)
        if kind == b"\1":
            return read(without_sums(rest))
        built = _built(rest, begin)
        outcome = read(built)
        if " periods" not in outcome or "0 periods" in outcome:
            return outcome
        try:
            load_job(str(path))
        except BadInput as error:
            return f"{outcome}, {refused(error)}"
        return f"{outcome}, a job"

    return run


def _seeds():
    """One message of each channel of a short run, in a file that is built of them, and pieces of the real one."""
    from io import BytesIO

    from click.testing import CliRunner
    from mcap.records import Channel, Message

    from mirotwin.commands import main
    from mirotwin.recording.container import records
    from tests.mirotwin.conftest import SHORT

    scenario = folder() / "seed.toml"
    scenario.write_text(SHORT)
    out = folder() / "seed"
    made = CliRunner().invoke(main, ["run", str(scenario), "--out", str(out), "--force", "-q", "--no-figure"])
    assert made.exit_code == 0, made.output
    data = (out / "run.mcap").read_bytes()
    channels = {}
    messages = {}
    for _, record in records(BytesIO(data), "seed"):
        if isinstance(record, Channel):
            channels[record.id] = record.topic.encode()
        elif isinstance(record, Message):
            messages.setdefault(record.channel_id, []).append(record.data)
    program, heads = [], []
    for number, (own, topic) in enumerate(channels.items()):
        heads.append(b"\x01" + bytes([number, len(topic)]) + topic)
        for one in messages.get(own, [])[:1]:
            program.append(b"\x05" + bytes([number]) + struct.pack("<H", len(one)) + one)
    order = sorted(range(len(heads)), key=lambda at: b"/period" in heads[at])
    parts = list(program)
    found = [b"\2\1" + b"".join(heads[at] for at in order[-8:]) + b"".join(parts[-8:])]
    for at, head in enumerate(heads):
        found.append(b"\2\1" + head + b"".join(part for part in parts if part[1] == at))
    whole = b"\2\1" + b"".join(heads) + b"\4" + b"".join(parts) + b"\4"
    built = _built(found[0][1:], _begin())
    return [
        *(one for one in (whole, *found) if len(one) <= 4096),
        b"\1" + built,
        b"\0" + built,
        b"\0" + built[:700],
    ]


TARGETS = {
    "recording": Target(
        "recordings, also with lengths and sums put right, up to the job of `replay`",
        _recording,
        _seeds,
        words=(
            _MAGIC,
            b"/net0/robot0/",
            b"/period",
            b"/wire",
            b"/action",
            b'"tick":',
            b'"index":',
            b'"digest":',
            b'"data":',
        ),
    )
}
