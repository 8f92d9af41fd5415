"""Recordings: what goes in comes out, the same run gives the same bytes, nothing else is taken for one; the writer."""

import io
import json
import re
import struct
import time
import tracemalloc

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Message
from mcap.writer import CompressionType, Writer

from miro_exact.clock import nanoseconds
from miro_exact.domain import MAX_SEED
from miro_host.eye.track import Sighting
from miro_host.posture import Posture
from miro_protocol.actions import Fault, Power, RadioState, Reseed, Reset
from miro_protocol.transmission import Transmission
from miro_sim.periods import Axis, Control, Period, RobotPeriod
from mirotwin.recording import channels, writer
from mirotwin.recording import recorder as recorder_module
from mirotwin.recording.container import BrokenOff, RecordingError, Records
from mirotwin.recording.reader import parse, read
from mirotwin.recording.recorder import TOGETHER, Recorder, RunSource
from mirotwin.recording.rows import Chunk
from mirotwin.recording.writer import MAGIC, McapWriter
from tests.mirotwin.synthetic import periods
from tests.naive import recording_messages

SOURCE = RunSource(
    scenario_name="fig6",
    scenario_text="# ä\nname = 'fig6'\n",
    seed=(1 << 63) - 1,
    firmware=b":00000001FF\r\n",
    firmware_sha256="ab" * 32,
    symbols={"_main": (0x62, "code"), "_frames_accepted": (0x30, "iram")},
)


def recorded(count=3, source=SOURCE):
    stream = io.BytesIO()
    with Recorder(stream, source) as recorder:
        for period in periods(count, [(0, 0), (0, 2), (1, 0)]):
            recorder.write(period)
    return stream.getvalue()


RECORDED = recorded()


def test_what_goes_in_comes_out_to_the_last_bit():
    recording = parse(RECORDED, "run.mcap")
    assert recording.source == SOURCE
    assert recording.periods == tuple(periods(3, [(0, 0), (0, 2), (1, 0)]))


def test_what_was_done_to_robots_and_radios_comes_out_again():
    actions = (Reset(5, 0, 2, 1), Power(6, 1, 0, 0), RadioState(7, 1, "noise"), RadioState(8, 1, "up"))
    actions += (Reseed(9, 1, MAX_SEED),)
    actions += (Fault(10, 0, 2, "rxd 0"), Fault(11, 0, 0, "flip 2Ah.3"))
    period = msgspec.structs.replace(next(periods(1)), actions=actions)
    stream = io.BytesIO()
    with Recorder(stream, SOURCE) as recorder:
        recorder.write(period)
    assert sorted(
        parse(stream.getvalue(), "run.mcap").periods[0].actions, key=lambda action: action.tick
    ) == [*actions]


FINITE = st.floats(allow_nan=False)
TICKS = st.integers(0, 1 << 54)
POSTURES = st.builds(Posture, FINITE, FINITE, FINITE)


class PosturePlus(Posture, frozen=True):
    """As a plug-in's reference may give it."""

    curvature: float


MAPS = st.dictionaries(st.text(max_size=5), FINITE, max_size=3)
WHOLE = st.integers(-(1 << 63), (1 << 63) - 1)
AXES = st.builds(
    Axis,
    *[WHOLE] * 6,
    commands=st.lists(st.tuples(TICKS, st.integers(0, 255), st.text("0123456789abcdef", max_size=8))).map(
        tuple
    ),
)
COUNTER = st.none() | st.integers(0, 65535)
ROBOTS = st.builds(
    RobotPeriod,
    network=st.integers(0, 1),
    slot=st.integers(0, 2),
    reference=POSTURES | st.builds(PosturePlus, *[FINITE] * 4),
    truth=POSTURES,
    v_m_s=FINITE,
    w_rad_s=FINITE,
    measurement=st.one_of(st.none(), POSTURES, st.builds(Sighting, *[FINITE] * 3, TICKS, FINITE)),
    control=st.none() | st.builds(Control, FINITE, FINITE, WHOLE, WHOLE, MAPS, MAPS),
    accepted=COUNTER,
    rejected=COUNTER,
    stale=COUNTER,
    left=AXES,
    right=AXES,
)
SENT = st.builds(Transmission, TICKS, st.sampled_from("<>"), st.binary(min_size=1), st.integers(0, 1))
PERIODS = st.builds(
    Period,
    st.integers(0, 1 << 30),
    TICKS,
    st.lists(ROBOTS, max_size=2).map(tuple),
    st.lists(SENT, max_size=3).map(tuple),
    st.text("0123456789abcdef", min_size=64, max_size=64),
    st.lists(
        st.builds(Reset, TICKS, st.integers(0, 1), st.integers(0, 2), st.integers(0, 1)), max_size=1
    ).map(tuple),
)


@settings(max_examples=40)
@given(st.lists(PERIODS, max_size=3), st.sampled_from((300, 1 << 20)))
def test_a_period_is_written_as_the_messages_that_readers_make_of_it(written, chunk_size):
    stream = io.BytesIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "CHUNK_SIZE", chunk_size)
        with Recorder(stream, SOURCE) as recorder:
            for period in written:
                recorder.write(period)
    found = [
        (channel.topic, message.log_time, message.data)
        for _, channel, message in make_reader(io.BytesIO(stream.getvalue())).iter_messages(
            log_time_order=False
        )
    ]
    wanted = [message for period in written for message in recording_messages.messages(period)]
    assert found == [(topic, nanoseconds(tick), data) for topic, tick, data in wanted]


def test_a_message_that_cannot_be_written_leaves_nothing_in_its_chunk():
    chunk = Chunk(1 << 20, pytest.fail)
    chunk.add(1, 5, channels.DutyMessage(0, 1))
    before = bytes(chunk.data)
    with pytest.raises(TypeError, match="Encoding objects of type object"):
        chunk.add(1, 6, channels.DutyMessage(0, object()))
    assert chunk.data == before
    assert chunk.last_ns == 5


def write_all(recorder, written):
    for period in written:
        recorder.write(period)


@pytest.mark.parametrize("count", [20, TOGETHER + 20])
def test_a_period_that_cannot_be_written_leaves_a_recording_of_those_before(count):
    stream = io.BytesIO()
    written = [*periods(count)]
    lost = msgspec.structs.replace(written[11].robots[0], left=None)
    written[11] = msgspec.structs.replace(written[11], robots=(lost,))
    with pytest.raises(TypeError), Recorder(stream, SOURCE) as recorder:
        write_all(recorder, written)
    found = parse(stream.getvalue(), "run.mcap")
    assert len(found.periods) == 11
    assert found.broken_off


def test_two_recordings_of_one_run_are_the_same_bytes_whenever_they_are_made(monkeypatch):
    monkeypatch.setattr(time, "time", lambda: 4e9)
    monkeypatch.setattr(time, "time_ns", lambda: 4 * 10**18)
    assert recorded() == RECORDED


def test_frames_stand_at_the_same_place_whenever_the_recording_was_flushed():
    def with_frames(flushed):
        stream = io.BytesIO()
        with Recorder(stream, SOURCE) as recorder:
            for period in periods(12):
                recorder.write_image(0, period.tick, b"png")
                recorder.write(period)
                if period.index == flushed:
                    recorder.flush()
        return stream.getvalue()

    assert {with_frames(flushed) for flushed in range(12)} == {with_frames(-1)}


def test_a_recording_is_flushed_with_its_first_period_and_then_each_fifth_of_a_second(monkeypatch):
    stream, found = io.BytesIO(), []
    times_s = iter((7.0, 7.1, 7.19, 7.25, 7.3))
    monkeypatch.setattr(time, "monotonic", lambda: next(times_s))
    with Recorder(stream, SOURCE) as recorder:
        recorder.flush()
        for period in periods(5):
            recorder.write(period)
            recorder.flush_if_due()
            found.append(len(parse(stream.getvalue(), "run.part.mcap").periods))
    assert found == [1, 1, 1, 4, 4]


def test_an_ordinary_mcap_reader_finds_channels_schemas_and_attachments():
    reader = make_reader(io.BytesIO(RECORDED))
    summary = reader.get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    names = ("reference", "truth", "measurement", "control", "firmware", "lm629", "pwm")
    assert topics >= {f"/net0/robot0/{name}" for name in names} | {"/net0/wire", "/period"}
    assert {attachment.name for attachment in reader.iter_attachments()} == {
        "scenario.toml",
        "firmware.ihx",
        "symbols.json",
    }
    for schema, _, message in reader.iter_messages():
        tree = json.loads(schema.data)
        assert tree["type"] == "object"
        assert "$ref" not in schema.data.decode()
        content = json.loads(message.data)
        assert set(content) == set(tree["properties"])
        assert message.log_time == content["tick"] * 125 // 3


def test_inner_values_of_different_laws_have_schemas_that_name_them():
    stream = io.BytesIO()
    with Recorder(stream, SOURCE) as recorder:
        for period in periods(3, [(0, 0), (0, 1), (0, 2)]):
            first, second, third = period.robots
            other = Control(0.1, 0.0, 5, 5, {"e1_m": 0.25})
            robots = (first, msgspec.structs.replace(second, control=other), third)
            recorder.write(msgspec.structs.replace(period, robots=robots))
    summary = make_reader(io.BytesIO(stream.getvalue())).get_summary()
    found = {}
    for channel in summary.channels.values():
        if channel.topic.endswith("/control"):
            schema = summary.schemas[channel.schema_id]
            inner = json.loads(schema.data)["properties"]["inner"]
            found[channel.topic] = (schema.name, list(inner["properties"]))
    assert found == {
        "/net0/robot1/control": ("mirotwin.Control", ["e1_m"]),
        "/net0/robot0/control": ("mirotwin.Control2", ["u1", "u2", "s1", "s2"]),
        "/net0/robot2/control": ("mirotwin.Control2", ["u1", "u2", "s1", "s2"]),
    }
    assert parse(stream.getvalue(), "run.mcap").periods[1].robots[1].control == other


def message_type_of(topic):
    place = channels.topic_of(topic)
    return None if place is None else channels.message_type(place)


@pytest.mark.parametrize(
    ("topic", "place"),
    [
        ("/period", channels.Topic("/period")),
        ("/net0/wire", channels.Topic("wire", 0)),
        ("/net12/robot3/lm629", channels.Topic("lm629", 12, 3)),
        ("/net0/robot/lm629", None),
        ("/net\u0663/wire", None),
        ("/period/", None),
    ],
)
def test_a_topic_says_what_it_names(topic, place):
    assert channels.topic_of(topic) == place


@pytest.mark.parametrize("change", [b'"bad_stop":[3,19]', b'"bad_stop":[18,3]', b'"bad_stop":[3,-1]'])
def test_bad_stop_bits_of_no_characters_are_refused(change):
    data = recorded().replace(b'"bad_stop":[3,18]', change)
    assert data != recorded()
    with pytest.raises(RecordingError, match="damaged record"):
        parse(data, "run.mcap")


def test_a_recording_of_the_format_before_is_refused_with_the_reason(monkeypatch):
    monkeypatch.setattr(recorder_module, "FORMAT", "2")
    with pytest.raises(
        RecordingError, match="recording format '2'; this program reads format 4; use the version"
    ):
        parse(recorded(), "run.mcap")


def test_every_channel_has_a_message_type_and_foreign_topics_have_none():
    for name, kind in channels.ROBOT_CHANNELS.items():
        assert message_type_of(channels.topic_name(name, 1, 2)) is kind
    assert message_type_of(channels.topic_name(channels.WIRE, 7)) is channels.WireMessage
    assert message_type_of("/camera") is None
    assert message_type_of("/net0/robot0/unknown") is None


def test_samples_and_faults_are_for_people_and_do_not_disturb_the_periods():
    stream = io.BytesIO()
    with Recorder(stream, SOURCE) as recorder:
        recorder.add("samples", 0, 0, channels.SampleMessage(8192, 1, 2, 3, -4, 5, 6, 7, 8))
        for period in periods(2):
            recorder.write(period)
    assert parse(stream.getvalue(), "run.mcap").periods == tuple(periods(2))


def broken_off(recorder):
    recorder.write(next(periods(1)))
    raise ZeroDivisionError


def test_what_was_written_up_to_an_error_is_a_recording_that_says_it_was_broken_off():
    stream = io.BytesIO()
    with pytest.raises(ZeroDivisionError), Recorder(stream, SOURCE) as recorder:
        broken_off(recorder)
    recording = parse(stream.getvalue(), "run.part.mcap")
    assert len(recording.periods) == 1
    assert recording.broken_off == "run.part.mcap: the run that wrote it was broken off"
    assert parse(RECORDED, "run.mcap").broken_off == ""
    assert make_reader(io.BytesIO(stream.getvalue())).get_summary() is not None


def test_a_file_that_is_no_recording_is_named_with_its_place(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(RecordingError, match=r"run\.mcap: offset 0: not an MCAP file; give a run\.mcap"):
        read(path)
    path.write_bytes(b"")
    with pytest.raises(RecordingError, match="offset 0: empty file"):
        read(path)


def test_an_mcap_file_of_another_program_is_not_read_as_a_recording():
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    writer.finish()
    with pytest.raises(RecordingError, match="not a recording of this program"):
        parse(stream.getvalue(), "run.mcap")


def blown_up(compression):
    """A file of some KB that unpacks to 64 MB."""
    stream = io.BytesIO()
    writer = Writer(stream, compression=compression)
    writer.start()
    channel = writer.register_channel("/period", "json", 0)
    for _ in range(4):
        writer.add_message(channel, 0, bytes(16 << 20), 0)
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize(
    ("compression", "name"), [(CompressionType.ZSTD, "zstd"), (CompressionType.LZ4, "lz4")]
)
def test_a_compressed_chunk_is_refused_and_not_unpacked(compression, name):
    data = blown_up(compression)
    complaint = (
        rf"run\.mcap: offset \d+: a chunk is compressed \({name}\), .*; make .* with `mcap decompress`"
    )
    tracemalloc.start()
    try:
        for size in (len(data), sections(data)["CHUNK"][0] + 60):  # whole, and cut within the chunk
            with pytest.raises(RecordingError, match=complaint):
                parse(data[:size], "run.mcap")
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def chunk(data, size=None, data_size=None):
    """An uncompressed chunk of `data` that may say something else about its length."""
    sizes = (len(data) if size is None else size, len(data) if data_size is None else data_size)
    body = struct.pack("<QQQIIQ", 0, 0, sizes[0], 0, 0, sizes[1]) + data
    return struct.pack("<BQ", Opcode.CHUNK, len(body)) + body


def nested(depth):
    found = b""
    for _ in range(depth):
        found = chunk(found)
    return found


@pytest.mark.parametrize(
    ("record", "what"),
    [
        (chunk(bytes(100), size=3 << 30), "an uncompressed chunk of 100 bytes says that it has 3221225472"),
        (chunk(bytes(100), data_size=3 << 30), "the lengths of a chunk and of its data do not agree"),
        (chunk(struct.pack("<BQ", Opcode.MESSAGE, 1 << 40)), "the last record of a chunk ends after it"),
        (struct.pack("<BQ", Opcode.CHUNK, 3) + b"abc", "a chunk is too short"),
        (nested(2), "a chunk within a chunk"),
        (nested(3000), "a chunk within a chunk"),
    ],
    ids=["size", "length of the data", "last record", "too short", "two deep", "3000 deep"],
)
def test_a_chunk_that_says_more_than_it_holds_is_damaged(record, what):
    with pytest.raises(RecordingError, match=rf"offset 8: damaged record \({what}\)"):
        parse(MAGIC + record, "run.mcap")


MESSAGES_OF_PERIODS = [
    RECORDED.index(f'"digest":"{period.digest}"}}'.encode()) + len(period.digest) + 12
    for period in periods(3, [(0, 0), (0, 2), (1, 0)])
]
"""Where the message ends that closes each period."""
COMPLAINT = (
    r"run\.mcap: offset \d+: the (file ends in the middle of a record; it was cut short; copy it again, or"
    r" record the run again|recording has no end: the run that wrote it was broken off; record .*)"
)


@settings(max_examples=150)
@given(st.integers(1, len(RECORDED) - 1))
def test_a_recording_cut_short_anywhere_gives_its_whole_periods_and_says_so(size):
    if size < MESSAGES_OF_PERIODS[0]:
        with pytest.raises(RecordingError, match=COMPLAINT):
            parse(RECORDED[:size], "run.mcap")
        return
    recording = parse(RECORDED[:size], "run.mcap")
    assert recording.source == SOURCE
    whole = [end for end in MESSAGES_OF_PERIODS if end <= size]
    assert recording.periods == tuple(periods(3, [(0, 0), (0, 2), (1, 0)]))[: len(whole)]
    assert re.fullmatch(COMPLAINT, recording.broken_off)


def sections(data):
    """First and last byte of the first record of each kind in a file, and of the magic at both ends."""
    found = {"magic": (0, len(MAGIC) - 1), "magic at the end": (len(data) - len(MAGIC), len(data) - 1)}
    place = len(MAGIC)
    while place < len(data) - len(MAGIC):
        opcode, size = struct.unpack_from("<BQ", data, place)
        found.setdefault(Opcode(opcode).name, (place, place + 8 + size))
        place += 9 + size
    return found


SECTIONS = sections(RECORDED)


def test_a_recording_has_records_of_all_these_kinds():
    kinds = {"HEADER", "METADATA", "ATTACHMENT", "CHUNK", "MESSAGE_INDEX", "DATA_END", "FOOTER"}
    summary = {"SCHEMA", "CHANNEL", "STATISTICS", "CHUNK_INDEX", "ATTACHMENT_INDEX", "SUMMARY_OFFSET"}
    assert kinds | summary < SECTIONS.keys()


def refused_with_bit_turned(at, bit):
    data = bytearray(RECORDED)
    data[at] ^= 1 << bit
    with pytest.raises(RecordingError, match=r"run\.mcap: offset \d+: (damaged record|not an MCAP file)"):
        parse(bytes(data), "run.mcap")


@pytest.mark.parametrize("section", SECTIONS)
def test_one_wrong_bit_at_either_end_of_any_section_is_noticed(section):
    first, last = SECTIONS[section]
    for at in (*range(first, first + 5), last - 4, last):
        refused_with_bit_turned(at, at % 8)


@pytest.mark.parametrize("place", range(4))
def test_one_wrong_bit_in_the_length_of_a_compressions_name_is_damage(place):
    for bit in range(8):
        refused_with_bit_turned(SECTIONS["CHUNK"][0] + 9 + 28 + place, bit)


@settings(max_examples=150)
@given(st.integers(0, len(RECORDED) - 1), st.integers(0, 7))
def test_one_wrong_bit_anywhere_is_noticed(at, bit):
    refused_with_bit_turned(at, bit)


def test_checksums_of_zero_say_nothing_as_other_programs_write_them():
    stream = io.BytesIO()
    writer = Writer(stream, enable_crcs=False, enable_data_crcs=False)
    writer.start()
    writer.finish()
    assert list(Records(io.BytesIO(stream.getvalue()).read, "x.mcap")) == []


# The writer: the bytes of the library's, and a file that can be read at any moment of its making

STEP_NAMES = ("schema", "channel", "message", "message", "message", "message", "flush")
STEPS = st.lists(
    st.tuples(
        st.sampled_from(STEP_NAMES),
        st.integers(1, 3),
        st.integers(0, (1 << 64) - 1),
        st.one_of(st.binary(max_size=40), st.integers(0, 3000).map(bytes)),
    ),
    max_size=40,
)
CHUNK_SIZE = 1000


@pytest.fixture(scope="module")
def short_chunks():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "CHUNK_SIZE", CHUNK_SIZE)
        yield


def of_the_library(steps):
    stream = io.BytesIO()
    writer = Writer(stream, CHUNK_SIZE, CompressionType.NONE, enable_data_crcs=True)
    writer.start("profile", "library")
    writer.add_metadata("mine", {"key": "ä", "empty": ""})
    writer.add_attachment(0, 0, "name.txt", "text/plain", b"content")
    for what, number, time_ns, data in steps:
        if what == "schema":
            writer.register_schema(f"schema{number}", "jsonschema", data)
        elif what == "channel":
            writer.register_channel(f"/topic{number}", "json", number)
        elif what == "message":
            writer.add_message(number, time_ns, data, time_ns)
    writer.finish()
    return stream.getvalue()


def begun(stream):
    writer = McapWriter(stream, "profile", "library")
    writer.add_metadata("mine", {"key": "ä", "empty": ""})
    writer.add_attachment("name.txt", "text/plain", b"content")
    return writer


def put(writer, step):
    what, number, time_ns, data = step
    if what == "schema":
        writer.add_schema(f"schema{number}", "jsonschema", data)
    elif what == "channel":
        writer.add_channel(f"/topic{number}", "json", number)
    elif what == "message":
        writer.chunk.add(number, time_ns, msgspec.Raw(data))
    else:
        writer.flush()


def put_all(writer, steps):
    for step in steps:
        put(writer, step)


def written(steps):
    stream = io.BytesIO()
    writer = begun(stream)
    put_all(writer, steps)
    writer.finish()
    return stream.getvalue()


@pytest.mark.usefixtures("short_chunks")
@pytest.mark.slow
@settings(max_examples=400)
@given(STEPS)
def test_a_file_is_the_bytes_of_the_librarys_writer_whenever_it_was_flushed(steps):
    assert written(steps) == of_the_library(steps)


ROWS = [("schema", 1, 0, b"{}"), ("channel", 1, 0, b"")]
ROWS += [("message", 1, index, bytes([index]) * (7 * index)) for index in range(100)]


class Journal(io.BytesIO):
    """Keeps what the file is after each write, as a process killed right then leaves it."""

    def __init__(self):
        super().__init__()
        self.states = []

    def write(self, data, /):
        piece = bytes(data[:300])  # a raw file may take less than it is given
        done = super().write(piece)
        self.states.append(self.getvalue())
        return done


def readable(data):
    """Times of the messages in a file without an end."""
    times = []

    def read():
        for _, record in Records(io.BytesIO(data).read, "x"):
            if isinstance(record, Message):
                times.append(record.log_time)

    with pytest.raises(BrokenOff, match="the recording has no end: the run that wrote it was broken off"):
        read()
    return times


@pytest.mark.usefixtures("short_chunks")
def test_killed_after_any_write_it_leaves_all_that_was_flushed_before():
    journal = Journal()
    writer = begun(journal)
    journal.states.clear()
    added, flushed = 0, 0
    for count, step in enumerate(ROWS):
        put(writer, step)
        added += step[0] == "message"
        if count % 3 == 0:
            writer.flush()
        for state in journal.states:
            found = readable(state)
            assert found == list(range(len(found)))
            assert flushed <= len(found) <= added
        journal.states.clear()
        if count % 3 == 0:
            flushed = added
    writer.finish()
    assert added == 100
    assert journal.getvalue() == written(ROWS)


@pytest.mark.usefixtures("short_chunks")
def test_after_a_full_disk_nothing_more_is_written():
    class Full(io.BytesIO):
        room = 2500

        def write(self, data, /):
            self.room -= len(data)
            if self.room < 0:
                raise OSError(28, "No space left on device")
            return super().write(data)

    full = Full()
    writer = begun(full)
    steps = iter(ROWS)
    with pytest.raises(OSError, match="No space left"):
        put_all(writer, steps)
    added = sum(step[0] == "message" for step in ROWS) - sum(step[0] == "message" for step in steps)
    before = full.getvalue()
    full.room = 1 << 20
    writer.flush()
    writer.finish()
    assert full.getvalue() == before
    found = readable(before)
    assert 0 < len(found) <= added
