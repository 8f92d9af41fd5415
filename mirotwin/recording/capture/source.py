"""Opens a file of any format as transmissions."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator

import msgspec

from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.inputs import InputError
from miro_protocol import pcapng_reader, stream
from miro_protocol.pcapng_reader import CaptureError
from miro_protocol.stream import StreamError
from miro_protocol.stream_header import Header
from miro_protocol.transmission import DOWN, Transmission, character_ticks
from mirotwin.recording.capture import recorded
from mirotwin.recording.capture.detect import TIMED
from mirotwin.recording.capture.hextext import HexError, HexText
from mirotwin.recording.capture.input import Input
from mirotwin.recording.container import RecordingError

READ_ERRORS = (CaptureError, HexError, InputError, RecordingError, StreamError)
"""Errors of reading; everything that could be read comes before them."""
LINE_BYTES = 16 << 20
_ESCAPED = re.compile(r"[\udc80-\udcff]")


class Source(msgspec.Struct):
    """`sent` in the order of the file; `robots` (network -> 3 or 5) is what the file itself says about layouts."""

    label: str
    format: str
    sent: Iterator[Transmission]
    robots: dict[int, int]

    @property
    def timed(self) -> bool:
        """Whether ticks are times; without them they only count characters."""
        return self.format in TIMED


def open_source(given: Input, format: str, tell: Callable[[str], None], direction: str = DOWN) -> Source:
    """`direction` is that of raw bytes and hex text, which do not say. Reading may raise one of `READ_ERRORS`.

    `tell` gets what the user should hear about what was passed over.
    """
    robots: dict[int, int] = {}
    if format == "pcapng":
        return Source(given.label, format, _pcapng(given, tell), robots)
    if format == "recording":
        return Source(given.label, format, recorded.transmissions(given, robots, tell), robots)
    if format == "stream":
        return Source(given.label, format, _stream(given, tell), robots)
    pieces = _raw(given) if format == "raw" else _hex(given)
    return Source(given.label, format, _contiguous(pieces, direction), robots)


def _raw(given: Input) -> Iterator[bytes]:
    while data := given.read_some():
        yield data


def _hex(given: Input) -> Iterator[bytes]:
    text = HexText(given.label)
    while not text.failed and (piece := given.read_some()):
        yield text.feed(piece)
    text.finish()


def _contiguous(pieces: Iterator[bytes], direction: str) -> Iterator[Transmission]:
    step, count = character_ticks(direction), 0
    for data in pieces:
        if data:
            yield Transmission(count * step, direction, data)
            count += len(data)


def _pcapng(given: Input, tell: Callable[[str], None]) -> Iterator[Transmission]:
    passed_over: Counter[int] = Counter()
    try:
        yield from pcapng_reader.iterate(given.read, given.label, passed_over)
    finally:
        if passed_over:
            tell(f"{given.label}: {pcapng_reader.events_line(passed_over)}")


def _stream(given: Input, tell: Callable[[str], None]) -> Iterator[Transmission]:
    reader = stream.Reader(_lines(given), given.label)
    crystal_hz = 0
    for entry in reader:
        sent = stream.characters(entry, given.label)
        if not crystal_hz:
            crystal_hz = _crystal_hz(reader.header)
            if crystal_hz != TICKS_PER_SECOND:
                tell(recorded.units_line(given.label, crystal_hz))
        yield recorded.in_usual_ticks(sent, crystal_hz)


def _crystal_hz(header: Header) -> int:
    """The clock of the file's ticks: the crystal that it names, or that a case for a bare processor names."""
    named = header.crystal_hz or (header.bare or {}).get("crystal_hz")
    return named if type(named) is int and named > 0 else TICKS_PER_SECOND


def _lines(given: Input) -> Iterator[str]:
    number = 0
    while line := given.readline(LINE_BYTES):
        number += 1
        if len(line) == LINE_BYTES and not line.endswith(b"\n"):
            remedy = "is this a stream file?"
            raise StreamError(given.label, number, 1, f"a line of more than {LINE_BYTES >> 20} MiB", remedy)
        text = line.decode("utf-8-sig" if number == 1 else "utf-8", "surrogateescape")
        if wrong := _ESCAPED.search(text):
            reason = f"byte {ord(wrong[0]) - 0xDC00:02x}h is not UTF-8"
            raise StreamError(given.label, number, wrong.start() + 1, reason, "save the file as UTF-8 text")
        yield text
