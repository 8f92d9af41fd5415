"""The records of an MCAP file one after the other, as far as the file goes.

What belongs here: the container. What does not: what messages say (`recorded`). The library's own reader gives
nothing of a chunk whose end is missing, and a short recording is one chunk; here the whole records of a chunk that was
cut short are given out before the error.
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
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Metadata
from mcap.stream_reader import CRCValidationError, breakup_chunk

from miro_sim.capture.input import Input
from miro_sim.recording_reader import MAGIC, RecordingError

LONGEST = 256 << 20  # of a record; ours are chunks of 1 MiB and attachments of some KiB
_HEAD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")  # times, uncompressed size, CRC, length of the compression's name
_READ: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.ATTACHMENT: Attachment.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
}
_BAD = (McapError, CRCValidationError, struct.error, ValueError, KeyError, MemoryError, OverflowError)


def records(source: Input) -> Iterator[tuple[int, McapRecord]]:
    """(offset, record) of channels, messages, attachments and metadata; RecordingError where it cannot go on."""
    magic = source.read(len(MAGIC))
    if magic != MAGIC:
        short = bool(magic) and MAGIC.startswith(magic)
        what = "the file ends in its first bytes" if short else "not an MCAP file"
        raise RecordingError(source.label, "offset 0", what, "give a run.mcap that `mirotwin run` wrote")
    checksum = crc32(magic)  # of all before the record that ends the data
    while True:
        place = source.tell()
        head = source.read(_HEAD.size)
        if len(head) < _HEAD.size:
            _cut(source, place)
        opcode, size = _HEAD.unpack(head)
        if size > LONGEST:
            _damaged(source, place, f"a record of {size} bytes")
        body = source.read(size)
        whole = len(body) == size
        try:
            for record in _in(opcode, body, whole):
                yield place, record
        except _BAD as error:
            _damaged(source, place, f"{error}".strip().split("\n")[0] or type(error).__name__)
        if not whole:
            _cut(source, place)
        if opcode == Opcode.DATA_END and int.from_bytes(body[:4], "little") not in (0, checksum):
            _damaged(source, place, "the checksum of what comes before it is wrong")
        checksum = crc32(body, crc32(head, checksum))
        if opcode == Opcode.FOOTER:
            break
    place = source.tell()
    if source.read(len(MAGIC)) != MAGIC:
        _cut(source, place)
    if source.read(1):
        what = "something follows the end of the recording"
        raise RecordingError(source.label, f"offset {source.tell() - 1}", what, "remove it")


def _cut(source: Input, place: int) -> NoReturn:
    what, remedy = "the file ends in the middle of a record", "it was cut short; record or copy it again"
    raise RecordingError(source.label, f"offset {place}", what, remedy)


def _damaged(source: Input, place: int, what: str) -> NoReturn:
    raise RecordingError(source.label, f"offset {place}", f"damaged record ({what})", "copy the file again")


def _in(opcode: int, body: bytes, whole: bool) -> Iterator[McapRecord]:
    """What one record of the file holds."""
    if opcode == Opcode.CHUNK:
        yield from _in_chunk(body, whole)
    elif whole and opcode == Opcode.MESSAGE:
        yield Message.read(ReadDataStream(BytesIO(body)), len(body))
    elif whole and opcode in _READ:
        yield _READ[opcode](ReadDataStream(BytesIO(body)))


def _in_chunk(body: bytes, whole: bool) -> Iterator[McapRecord]:
    if whole:
        yield from breakup_chunk(Chunk.read(ReadDataStream(BytesIO(body))), validate_crc=True)
        return
    if len(body) < _CHUNK.size or _CHUNK.unpack_from(body)[4]:
        return  # nothing in it yet, or compressed
    place = _CHUNK.size + 8
    while place + _HEAD.size <= len(body):
        opcode, size = _HEAD.unpack_from(body, place)
        place += _HEAD.size
        if place + size > len(body):
            return
        yield from _in(opcode, body[place : place + size], True)
        place += size
