"""Recorded command streams: text, one transmission or action a line, made to be compared by `diff` and kept in git.

    # mirotwin stream 2
    #: scenario = "fig6"
    792000 > 55 55 55 55 55 ff 2d d4 fc ..  # team seq=3
    900000 *@0/1 reset 1

TICK (24 MHz) of the first start bit, `>` host to robot or `<` robot to host, the characters in hexadecimal,
which follow each other without a pause, then a comment for people. For the tick a time such as `4ms` may stand.
Ticks do not go backwards from line to line; two lines may have the same one. What belongs here: whole files. What
does not: the grammar of a line (`stream_line.py`) and of the header (`stream_header.py`), and judging the bytes; any
bytes may be recorded.

A file is written as version 1 if that has words for everything in it: no header, no action, one network and no bad stop
bit; as version 3 if it puts values of parts, or is for a board. What is written is read back as the same.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator

import msgspec

from miro_exact.inputs import read_input, replace_file
from miro_protocol import stream_header
from miro_protocol.actions import WHO_CAN, ScriptItem, put_on_pin
from miro_protocol.stream_header import PREFIX, Header
from miro_protocol.stream_line import (
    FIRST_LINE,
    MAX_TICK,
    Entry,
    StreamItem,
    StreamLine,
    format_line,
    version_of,
)
from miro_protocol.stream_line import StreamError as StreamError
from miro_protocol.transmission import Transmission

__all__ = [
    "MAX_TICK", "Entry", "Header", "Reader", "StreamError", "StreamFile", "decode", "format_line",
    "format_stream", "parse", "read", "write",
]  # fmt: skip


class StreamFile(msgspec.Struct, frozen=True):
    """A stream file: what it says about itself, and its lines in the order of time. `source` names it in errors."""

    entries: tuple[Entry, ...]
    header: Header = Header()
    source: str = "<stream>"

    def transmissions(self) -> list[Transmission]:
        """All transmissions. Raises StreamError for an action: for readers that cannot act on any."""
        return [characters(entry, self.source) for entry in self.entries]

    def script(self) -> list[ScriptItem]:
        """All transmissions and actions; a level on a pin is a put."""
        return [put_on_pin(entry.what) for entry in self.entries]


def characters(entry: Entry, source: str) -> Transmission:
    """The transmission in a line. Raises StreamError for an action, which says who can act on it."""
    if isinstance(entry.what, Transmission):
        return entry.what
    problem = "an action, which this command does not support"
    raise StreamError(source, entry.line, 1, problem, WHO_CAN[type(entry.what)])


class Reader:
    """Reads line by line: an iterator of entries. StreamError at the first line that is wrong.

    `source` names the file in errors. `header` is read when the first entry, or the end, has come.
    """

    def __init__(self, lines: Iterable[str], source: str = "<stream>") -> None:
        self.source = source
        self.version = 1
        self.header = Header()
        self._lines = lines
        self._header_lines: list[tuple[int, str]] = []
        self._in_header = True

    def __iter__(self) -> Iterator[Entry]:
        last = 0
        for number, text in enumerate(self._lines, 1):
            line = StreamLine(self.source, number, text.rstrip("\r\n"))
            if number == 1:
                self.version = line.version()
            if self.version > 1 and line.text.startswith(PREFIX):
                self._take_header(line)
                continue
            if line.tokens:
                self._close_header()
            entry = line.parse(self.version, self.header.clock)
            if entry is None:
                continue
            if entry.what.tick < last:
                remedy = f"put the lines in the order of their ticks; the line before has {last}"
                raise line.error(line.tokens[0], f"tick {entry.what.tick} goes backwards", remedy)
            last = entry.what.tick
            yield entry
        self._close_header()

    def _take_header(self, line: StreamLine) -> None:
        if not self._in_header:
            raise line.error(1, "a line of the header after the first tick", "put it above all ticks")
        self._header_lines.append((line.number, line.text))

    def _close_header(self) -> None:
        if self._in_header:
            self.header = stream_header.parse(self._header_lines, self.source)
            self._in_header = False


def parse(text: str, source: str = "<stream>") -> StreamFile:
    """A stream file from its text."""
    reader = Reader(text.split("\n"), source)
    entries = tuple(reader)
    return StreamFile(entries, reader.header, source)


def read(path: str | os.PathLike[str]) -> StreamFile:
    """Reads a stream file; StreamError, or OSError when it cannot be opened."""
    return decode(read_input(path), os.fspath(path))


def decode(data: bytes, source: str = "<stream>") -> StreamFile:
    """A stream file from its bytes; `source` names it in a StreamError."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line, column = before.count(b"\n") + 1, error.start - (before.rfind(b"\n") + 1) + 1
        reason, remedy = f"byte {data[error.start]:02x}h is not UTF-8", "save the file as UTF-8 text"
        raise StreamError(source, line, column, reason, remedy) from None
    return parse(text, source)


def format_stream(lines: Iterable[Entry | StreamItem], header: Header | None = None) -> str:
    """The whole file. ValueError for what could not be read back, and when ticks go backwards."""
    written, last = [], 0
    version = 1 if header is None or not header.text else header.needed_version
    for item in lines:
        entry = item if isinstance(item, Entry) else Entry(item)
        written.append(format_line(entry.what, entry.comment))
        if entry.what.tick < last:
            raise ValueError(
                f"tick = {entry.what.tick}: must not be before {last}, the one of the line above"
            )
        last = entry.what.tick
        version = max(version, version_of(entry.what))
    head = [FIRST_LINE.format(version), *stream_header.lines(header or Header())]
    return "".join(f"{line}\n" for line in (*head, *written))


def write(
    path: str | os.PathLike[str], lines: Iterable[Entry | StreamItem], header: Header | None = None
) -> None:
    """Writes a stream file whole or not at all: a reader finds the old content or the new."""
    replace_file(path, format_stream(lines, header).encode())
