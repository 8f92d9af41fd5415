"""The MCAP writer: the bytes of the library's writer, and a file that can be read at any moment of its making."""

import io

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from mirotwin.recording import writer as mcap_writer
from mirotwin.recording.container import BrokenOff, records
from mirotwin.recording.writer import McapWriter

NAMES = ("schema", "channel", "message", "message", "message", "message", "flush")
STEPS = st.lists(
    st.tuples(
        st.sampled_from(NAMES),
        st.integers(1, 3),
        st.integers(0, (1 << 64) - 1),
        st.one_of(st.binary(max_size=40), st.integers(0, 3000).map(bytes)),
    ),
    max_size=40,
)
CHUNK = 1000


@pytest.fixture(autouse=True, scope="module")
def short_chunks():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mcap_writer, "CHUNK_SIZE", CHUNK)
        yield


def of_the_library(steps):
    stream = io.BytesIO()
    writer = Writer(stream, CHUNK, CompressionType.NONE, enable_data_crcs=True)
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
        writer.add_message(number, time_ns, msgspec.Raw(data))
    else:
        writer.flush()


def written(steps):
    stream = io.BytesIO()
    writer = begun(stream)
    for step in steps:
        put(writer, step)
    writer.finish()
    return stream.getvalue()


@pytest.mark.slow
@settings(max_examples=400)
@given(STEPS)
def test_a_file_is_the_bytes_of_the_librarys_writer_whenever_it_was_flushed(steps):
    assert written(steps) == of_the_library(steps)


ROWS = [("schema", 1, 0, b"{}"), ("channel", 1, 0, b"")]
ROWS += [("message", 1, index, bytes([index]) * (7 * index)) for index in range(100)]


def test_the_librarys_readers_find_all_messages():
    data = written(ROWS)
    indexed = [
        (message.log_time, message.data) for _, _, message in make_reader(io.BytesIO(data)).iter_messages()
    ]
    streamed = [
        (record.log_time, record.data)
        for record in StreamReader(io.BytesIO(data), validate_crcs=True).records
        if isinstance(record, Message)
    ]
    assert (
        indexed == streamed == [(time_ns, content) for what, _, time_ns, content in ROWS if what == "message"]
    )


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
        for _, record in records(io.BytesIO(data), "x"):
            if isinstance(record, Message):
                times.append(record.log_time)

    with pytest.raises(BrokenOff, match="the recording has no end: the run that wrote it was broken off"):
        read()
    return times


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
    added = 0

    def fill():
        nonlocal added
        for step in ROWS:
            put(writer, step)
            added += step[0] == "message"

    with pytest.raises(OSError, match="No space left"):
        fill()
    before = full.getvalue()
    full.room = 1 << 20
    writer.flush()
    writer.finish()
    assert full.getvalue() == before
    found = readable(before)
    assert 0 < len(found) <= added
