"""Writes an uncompressed MCAP file that is readable at any moment while it is written.

A finished file is the bytes that `mcap.writer.Writer` gives without compression and with all checksums. That writer
holds a chunk in memory until it has 1 MiB, minutes of a run, and a killed process loses it. It has no public call to
end a chunk sooner; a chunk for each control period makes files a quarter longer; and it needs 5 to 9 times as long per
message as `rows`. Here `flush` updates the open chunk in the file: first it writes the new records at the end of the
file, then the head of the chunk (lengths, times, CRC), which then includes them. A file that ends between these steps
has complete records outside of a chunk at its end, which the specification allows, and perhaps a part of one. Where
chunks end depends on the messages only, so flushing changes no byte of a finished file.
"""

from __future__ import annotations

import struct
from typing import BinaryIO
from zlib import crc32

from mcap.opcode import Opcode

from mirotwin.recording.rows import Chunk

MAGIC = b"\x89MCAP0\r\n"
CHUNK_SIZE = 1 << 20
"""A chunk ends with the record that makes it longer than this."""
_CHUNK = struct.Struct(
    "<BQQQQIIQ"
)  # opcode, length, times, size, CRC, compression's name (none), length of data
_BEFORE_DATA = _CHUNK.size - 9  # what a chunk's length counts besides its data
_INDEX = struct.Struct("<BQHI")  # opcode, length, channel, length of entries
_ENTRY = 16  # bytes: time, offset
_CRC = 4  # bytes


class McapWriter:
    """An open MCAP file. `stream` must be empty and seekable, and may be a raw file; the caller closes it. Messages are
    added to `chunk`.

    Attachments and metadata come before the first message, or end the chunk that is open. After an OSError (a full
    disk) nothing more is written; the file stays readable.
    """

    def __init__(self, stream: BinaryIO, profile: str, library: str) -> None:
        self._stream = stream
        self._end = 0  # of the file, without the open chunk
        self._checksum = 0  # of all up to there
        self._failed = False
        self._schemas: list[bytes] = []  # the records, which stand in the summary, too
        self._channels: list[bytes] = []
        self._attachments: list[bytes] = []  # their indexes, and so on
        self._metadata: list[bytes] = []
        self._chunks: list[bytes] = []
        self._counts: dict[int, int] = {}  # messages by channel
        self._times: list[int] = []  # of the first and last message of each chunk
        self.chunk = Chunk(CHUNK_SIZE, self._end_chunk)
        self._stored = 0  # bytes of its records that are in the file
        self._put(MAGIC + _record(Opcode.HEADER, _text(profile), _text(library)))

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Adds a file; its times are 0."""
        self._end_chunk()
        # After `_end_chunk`, which moves the end: an attachment cannot stand in a chunk.
        offset, names = self._end, _text(name) + _text(media_type)
        content = struct.pack("<QQ", 0, 0) + names + struct.pack("<Q", len(data)) + data
        self._put(_record(Opcode.ATTACHMENT, content, struct.pack("<I", crc32(content))))
        numbers = struct.pack("<5Q", offset, self._end - offset, 0, 0, len(data))
        self._attachments.append(_record(Opcode.ATTACHMENT_INDEX, numbers, names))

    def add_metadata(self, name: str, content: dict[str, str]) -> None:
        """Adds a table of texts."""
        self._end_chunk()
        offset = self._end
        table = b"".join(_text(key) + _text(value) for key, value in content.items())
        self._put(_record(Opcode.METADATA, _text(name), _sized(table)))
        numbers = struct.pack("<QQ", offset, self._end - offset)
        self._metadata.append(_record(Opcode.METADATA_INDEX, numbers, _text(name)))

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Adds a schema and returns its number."""
        number = len(self._schemas) + 1
        texts = _text(name) + _text(encoding) + _sized(data)
        self._schemas.append(_record(Opcode.SCHEMA, struct.pack("<H", number), texts))
        self.chunk.add_record(self._schemas[-1])
        return number

    def add_channel(self, topic: str, encoding: str, schema: int) -> int:
        """Adds a channel and returns its number."""
        number = len(self._channels) + 1
        texts = _text(topic) + _text(encoding) + _sized(b"")
        self._channels.append(_record(Opcode.CHANNEL, struct.pack("<HH", number, schema), texts))
        self.chunk.add_record(self._channels[-1])
        return number

    def flush(self) -> None:
        """Writes everything so far into the file, so that it survives the end of this process."""
        # Schemas and channels alone are no chunk: the library's writer would not have written one.
        if self.chunk.indexes:
            self._store_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Writes the end of the file: summary and footer."""
        self._end_chunk()
        self._put(_record(Opcode.DATA_END, struct.pack("<I", self._checksum)))
        start = self._end
        summary, offsets = b"", b""
        for opcode, group in self._summary():
            records = b"".join(group)
            place = struct.pack("<BQQ", opcode, start + len(summary), len(records))
            offsets += _record(Opcode.SUMMARY_OFFSET, place)
            summary += records
        footer = _record(Opcode.FOOTER, struct.pack("<QQI", start, start + len(summary), 0))[:-_CRC]
        # From the summary to the footer's own CRC, head and length of the footer included (MCAP, Footer).
        checksum = crc32(footer, crc32(offsets, crc32(summary)))
        self._put(summary + offsets + footer + struct.pack("<I", checksum) + MAGIC)
        self._stream.flush()

    def _summary(self) -> list[tuple[Opcode, list[bytes]]]:
        """The groups of the summary section, in the order of the library's writer."""
        messages = sum(self._counts.values())
        lists = self._channels, self._attachments, self._metadata, self._chunks
        times = min(self._times, default=0), max(self._times, default=0)
        counts = struct.pack("<QH4I", messages, len(self._schemas), *map(len, lists))
        numbers = counts + struct.pack("<QQ", *times)
        return [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [_record(Opcode.STATISTICS, numbers, _by_channel(self._counts))]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ]

    def _end_chunk(self) -> None:
        """Closes the open chunk, if there is a message in it, and writes the indexes of its messages."""
        if not self.chunk.indexes:
            return
        head, chunk = self._store_chunk(), self.chunk
        start, size = self._end, self._stored
        self._end = start + len(head) + size
        # Only now, with the last head: the ones before were written over.
        self._checksum = crc32(chunk.data, crc32(head, self._checksum))
        offsets, rows = {}, bytearray()
        for channel, index in chunk.indexes.items():
            offsets[channel] = self._end + len(rows)
            entries = len(index)
            rows += _INDEX.pack(Opcode.MESSAGE_INDEX, _INDEX.size - 9 + entries, channel, entries)
            rows += index
            self._counts[channel] = self._counts.get(channel, 0) + entries // _ENTRY
        self._put(rows)
        self._times += (chunk.first_ns, chunk.last_ns)
        place = struct.pack("<4Q", chunk.first_ns, chunk.last_ns, start, len(head) + size)
        sizes = struct.pack("<QIQQ", len(rows), 0, size, size)  # 0: no name of a compression
        self._chunks.append(_record(Opcode.CHUNK_INDEX, place, _by_channel(offsets), sizes))
        # Last: the index above is of its data and times.
        chunk.begin()
        self._stored = 0

    def _store_chunk(self) -> bytes:
        """Writes the new records of the open chunk, then the head that takes them in; returns the head."""
        data, stored = self.chunk.data, self._stored
        if not stored:  # its head first, of an empty chunk: what follows never stands in half a chunk
            self._write(self._end, self._chunk_head(b""))
        head = self._chunk_head(data)
        if len(data) > stored:
            # Only what is new, or a flush would write up to 1 MiB again each 0.2 s.
            self._write(self._end + len(head) + stored, data[stored:])
            self._stream.flush()
            # After the records have left this process: a head that counts missing ones is a damaged file.
            self._write(self._end, head)
            self._stream.flush()
        self._stored = len(data)
        return head

    def _chunk_head(self, data: bytes | bytearray) -> bytes:
        size, times = len(data), (self.chunk.first_ns, self.chunk.last_ns)
        return _CHUNK.pack(Opcode.CHUNK, _BEFORE_DATA + size, *times, size, crc32(data), 0, size)

    def _put(self, data: bytes | bytearray) -> None:
        """Appends to the file, outside of chunks."""
        self._write(self._end, data)
        self._end += len(data)
        self._checksum = crc32(data, self._checksum)

    def _write(self, place: int, data: bytes | bytearray) -> None:
        # Anything further would stand behind a gap, and a second error would hide the first.
        if self._failed:
            return
        rest = memoryview(data)
        try:
            self._stream.seek(place)
            while rest:
                # A raw stream may take a part only.
                rest = rest[self._stream.write(rest) :]
        except OSError:
            self._failed = True
            raise


def _record(opcode: Opcode, *parts: bytes) -> bytes:
    content = b"".join(parts)
    return struct.pack("<BQ", opcode, len(content)) + content


def _sized(data: bytes) -> bytes:
    """Data after its length."""
    return struct.pack("<I", len(data)) + data


def _text(text: str) -> bytes:
    return _sized(text.encode())


def _by_channel(numbers: dict[int, int]) -> bytes:
    return _sized(b"".join(struct.pack("<HQ", *pair) for pair in numbers.items()))
