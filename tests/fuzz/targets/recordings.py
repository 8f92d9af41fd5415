"""Recordings: MCAP files as they are, and files whose records are drawn and whose lengths and sums are right."""

import struct
from itertools import islice
from zlib import crc32

from mcap.opcode import Opcode

from miro_exact.bad_input import BadInput
from mirotwin.recording import recorder
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.recorded import transmissions, transmissions_of
from mirotwin.recording.container import RecordingError
from mirotwin.recording.reader import parse
from mirotwin.runs.job import load_job
from tests.fuzz.target import Draws, Target, folder, refused
from tests.mirotwin.mutated_files import ECHO, hex_records, without_sums

_MAGIC = b"\x89MCAP0\r\n"
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
    return _record(Opcode.ATTACHMENT, body + struct.pack("<I", crc32(body)))


def _metadata(name, values):
    pairs = b"".join(_text(key) + _text(value) for key, value in values.items())
    return _record(Opcode.METADATA, _text(name) + _text(pairs))


def _built(data, begin):
    """A file whose records `data` draws: whole, with right lengths and sums."""
    draw, out, chunk = Draws(data), [_MAGIC, _record(Opcode.HEADER, _text(b"") + _text(b""))], None
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
            found = _record(Opcode.CHANNEL, body)
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
            found, chunk = _record(Opcode.CHUNK, whole), None
        else:
            head = struct.pack("<HIQQ", draw.below(64), 0, 0, 0)
            found = _record(Opcode.MESSAGE, head + draw.take(draw.below(1 << 11)))
        if chunk is None:
            out.append(found)
        else:
            chunk += found
    end = b"".join(out)
    end += _record(Opcode.DATA_END, struct.pack("<I", crc32(end)))
    return end + _record(Opcode.FOOTER, bytes(20)) + _MAGIC


def _begin():
    """What a reader wants at the beginning of a recording."""
    names = (recorder.SCENARIO_ATTACHMENT, recorder.FIRMWARE_ATTACHMENT, recorder.SYMBOLS_ATTACHMENT)
    assert tuple(name.encode() for name in (*names, recorder.RESUMED_ATTACHMENT)) == _NAMES[:4], names
    about = {b"format": recorder.FORMAT.encode(), b"seed": b"3", b"scenario": b"one"}
    return b"".join(
        [
            _metadata(recorder.METADATA.encode(), about),
            _attachment(_NAMES[0], _SCENARIO),
            _attachment(_NAMES[1], hex_records(ECHO)),
            _attachment(_NAMES[2], b'{"_main":[0,"code"]}'),
        ]
    )


def _recording():
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


TARGETS = {
    "recording": Target(
        "recordings, also with lengths and sums put right, up to the job of `replay`",
        _recording,
        words=(_MAGIC, *b'/net0/robot0/ /period /wire /action "tick": "index": "digest": "data":'.split()),
    )
}
