"""Reads the records of an MCAP file in order, to the end of a complete or truncated file, and checks every byte.

The library's own reader rejects a truncated file as damaged and yields nothing of a chunk whose end is missing (a short
recording is one chunk); it checks neither attachments nor the summary. This reader yields the complete records of such
a chunk before the error, and detects any flipped bit in our recordings: chunks and attachments have a CRC each, DataEnd
has one of all before it, Footer one of the rest (MCAP specification, "Records"). A CRC of 0, which other programs
write, is not checked.

A file without an end that stops between two records, or in a record that belongs into a chunk but lies outside, was
left by a killed process (`writer`): BrokenOff. A file that stops in a chunk or anywhere else is an incomplete copy:
Cut.

Compressed chunks are refused: `mirotwin run` writes none, and 96 KB of them can hold gigabytes. So memory is bounded:
the content of a record is no longer than the record, and a chunk within a chunk is damage.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import NoReturn
from zlib import crc32

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema

from miro_exact.bad_input import BadInput
from mirotwin.recording.writer import MAGIC

LONGEST = 256 << 20  # of a record; ours are chunks of 1 MiB and attachments of some KiB
_HEAD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")  # times, uncompressed size, CRC, length of the compression's name
_DATA_LENGTH = 8  # bytes, after the compression's name
_CRC = 4  # bytes
_COMPRESSIONS = (b"lz4", b"zstd")  # but for none
_READ: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.ATTACHMENT: Attachment.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
    Opcode.SCHEMA: Schema.read,
}
_IN_CHUNKS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
_BAD = (McapError, struct.error, ValueError, KeyError, MemoryError, OverflowError)


class RecordingError(BadInput):
    """A file that is no complete recording: `path`, `place` (byte offset), reason, remedy."""


class Cut(RecordingError):
    """A file that ends in the middle of a record; all whole records came before."""


class BrokenOff(Cut):
    """A file whose writer was killed; everything written came before, except for a part of a record."""


class _Compressed(Exception):
    """A compressed chunk, with the name of the compression."""


class Records:
    """Iterates over (offset, record) of schemas, channels, messages, attachments and metadata of a file. Raises
    RecordingError where reading cannot continue. `read(n)`: returns the next n bytes, fewer only at the end. `path`
    names the file in errors.
    """

    def __init__(self, read: Callable[[int], bytes], path: str) -> None:
        self.read = read
        self.path = path
        self.offset = 0  # of the record under way
        self.checksum = 0  # of what the next section's CRC covers, so far
        self.data_ended = False
        self.last = b""  # bytes that were read, after the first magic

    def __iter__(self) -> Iterator[tuple[int, McapRecord]]:
        self._begin()
        opcode = 0
        while opcode != Opcode.FOOTER:
            head = self._read(_HEAD.size)
            if len(head) < _HEAD.size:
                self._cut(head[0] if head else None)
            opcode, size = _HEAD.unpack(head)
            # Before it is read: one turned bit of a length asks for terabytes.
            if size > LONGEST:
                self._damaged(f"its length says {size} bytes")
            body = self._read(size)
            # Not an error yet: of a chunk that was cut, the whole records are given out first.
            whole = len(body) == size
            try:
                for record in _in(opcode, body, whole):
                    yield self.offset, record
            # Not one of `_BAD`: the file is whole, and needs another remedy.
            except _Compressed as compressed:
                remedy = "make an uncompressed copy of the file with `mcap decompress`"
                self._fail(f"a chunk is compressed ({compressed}), which this program does not read", remedy)
            except _BAD as error:
                self._damaged(f"{error}".strip().split("\n")[0] or type(error).__name__)
            if not whole:
                self._cut(opcode)
            # Only now: records of a chunk have a CRC of their own; this one is of the whole file.
            self._check(opcode, head, body)
            self.offset += len(head) + len(body)
        self._end()

    def _begin(self) -> None:
        magic = self.read(len(MAGIC))
        if magic != MAGIC:
            if magic and MAGIC.startswith(magic):
                self._cut()
            reason = "not an MCAP file" if magic else "empty file"
            self._fail(reason, "give a run.mcap that `mirotwin run` wrote")
        self.offset = len(magic)
        self.checksum = crc32(magic)

    def _check(self, opcode: int, head: bytes, body: bytes) -> None:
        """Compares the CRC of all before DataEnd, and of all between that and the CRC itself in Footer."""
        if opcode == Opcode.DATA_END:
            self.data_ended = True
            self._compare(body, self.checksum)
            self.checksum = 0
        elif opcode == Opcode.FOOTER:
            self._compare(body[-_CRC:], crc32(body[:-_CRC], crc32(head, self.checksum)))
        else:
            self.checksum = crc32(body, crc32(head, self.checksum))

    def _compare(self, written: bytes, computed: int) -> None:
        if len(written) != _CRC or int.from_bytes(written, "little") not in (0, computed):
            self._damaged("the checksum of what comes before it is wrong")

    def _end(self) -> None:
        magic = self._read(len(MAGIC))
        if magic != MAGIC:
            if len(magic) < len(MAGIC):
                self._cut()
            self._damaged("the closing bytes of an MCAP file are missing here")
        self.offset += len(magic)
        if self.read(1):
            self._fail("there are bytes after the end of the recording", "remove it")

    def _read(self, size: int) -> bytes:
        data = self.read(size)
        self.last = (self.last + data[-len(MAGIC) :])[-len(MAGIC) :]
        return data

    def _cut(self, within: int | None = Opcode.HEADER) -> NoReturn:
        """The file ended before the record did, or (`within` None) before there was one."""
        if self.last == MAGIC:  # as a whole file ends; so what is wrong is a length
            self._damaged("its length is more than the file holds")
        # Our writer leaves only these at the end of a broken file (writer.py); after DataEnd it is no run.
        if not self.data_ended and (within is None or within in _IN_CHUNKS):
            reason = "the recording has no end: the run that wrote it was broken off"
            raise BrokenOff(
                self.path, f"offset {self.offset}", reason, "record the run again for a whole one"
            )
        reason, remedy = "the file ends in the middle of a record", "copy it again, or record the run again"
        raise Cut(self.path, f"offset {self.offset}", reason, f"it was cut short; {remedy}")

    def _damaged(self, reason: str) -> NoReturn:
        self._fail(f"damaged record ({reason})", "copy the file again, or record the run again")

    def _fail(self, reason: str, remedy: str) -> NoReturn:
        raise RecordingError(self.path, f"offset {self.offset}", reason, remedy) from None


def _in(opcode: int, body: bytes, whole: bool) -> Iterator[McapRecord]:
    """The content of one record of the file."""
    if opcode == Opcode.CHUNK:
        yield from _in_chunk(body, whole)
    elif whole and opcode == Opcode.MESSAGE:
        yield Message.read(ReadDataStream(BytesIO(body)), len(body))
    elif whole and opcode in _READ:
        if opcode == Opcode.ATTACHMENT and int.from_bytes(body[-_CRC:], "little") not in (
            0,
            crc32(body[:-_CRC]),
        ):
            raise ValueError("the attachment's checksum is wrong")
        yield _READ[opcode](ReadDataStream(BytesIO(body)))


def _in_chunk(body: bytes, whole: bool) -> Iterator[McapRecord]:
    """The records of a chunk; only the complete ones if the file ends in it."""
    if len(body) < _CHUNK.size:
        if whole:
            raise ValueError("a chunk is too short")
        return
    _, _, size, checksum, name_length = _CHUNK.unpack_from(body)
    if name_length:
        # At most 16: a damaged length would put the whole chunk into the message.
        name = body[_CHUNK.size : _CHUNK.size + min(name_length, 16)]
        if (
            name not in _COMPRESSIONS
        ):  # no well-known one of the MCAP specification: a damaged length, most likely
            raise ValueError(f"a chunk of unknown compression {name!r}")
        raise _Compressed(name.decode("ascii"))
    first = _CHUNK.size + _DATA_LENGTH
    if whole:
        if len(body) < first or int.from_bytes(body[_CHUNK.size : first], "little") != len(body) - first:
            raise ValueError("the lengths of a chunk and of its data do not agree")
        if size != len(body) - first:
            raise ValueError(f"an uncompressed chunk of {len(body) - first} bytes says that it has {size}")
        if checksum not in (0, crc32(memoryview(body)[first:])):
            raise ValueError("the chunk's checksum is wrong")
    yield from _in_row(body, first, whole)


def _in_row(body: bytes, offset: int, whole: bool) -> Iterator[McapRecord]:
    """The records that follow each other in a chunk from `offset` on."""
    while offset + _HEAD.size <= len(body):
        opcode, size = _HEAD.unpack_from(body, offset)
        first, end = offset + _HEAD.size, offset + _HEAD.size + size
        # Of a chunk that was cut this is its end; of a whole one the test below is reached.
        if end > len(body):
            break
        if opcode == Opcode.CHUNK:
            raise ValueError("a chunk within a chunk")
        yield from _in(opcode, body[first:end], True)
        offset = end
    if whole and offset != len(body):
        raise ValueError("the last record of a chunk ends after it")
