"""Recorded command streams: text, one transmission a line, made to be compared by `diff` and kept in git.

    # mirotwin stream 1
    792000 > 55 55 55 55 55 ff 2d d4 fc ..  # team seq=3

TICK (24 MHz) of the first start bit, `>` host to robot or `<` robot to host, the characters in hexadecimal,
which follow each other without a pause, then a comment for people. Ticks do not go backwards from line to
line; two lines may have the same one. What belongs here: the text form. What does not: judging the bytes; any
bytes may be recorded.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from reprlib import repr as brief

from miro_protocol import files

FIRST_LINE = "# mirotwin stream 1"
DOWN = ">"
UP = "<"
DIRECTIONS = (DOWN, UP)
MAX_TICK = (1 << 61) - 1  # decoders count ticks in 64 bits

_VERSION = re.compile(r"#\s*mirotwin stream\b\s*(.*?)\s*$")
_TOKEN = re.compile(r"\S+")
_HEX = re.compile(r"[0-9a-fA-F]{2}")
_TICK = re.compile(r"[0-9]{1,19}")


class StreamError(Exception):
    """A line that cannot be read: file, line and column (from 1), the reason, and what to do about it."""

    def __init__(self, source: str, line: int, column: int, reason: str, remedy: str) -> None:
        super().__init__(f"{source}:{line}:{column}: {reason}; {remedy}")
        self.source = source
        self.line = line
        self.column = column
        self.reason = reason
        self.remedy = remedy


@dataclass(frozen=True, slots=True)
class Transmission:
    """One line: `data` on the wire from `tick` on, without a pause. `direction` is `>` or `<`."""

    tick: int
    direction: str
    data: bytes
    comment: str = ""


def format_line(sent: Transmission) -> str:
    """The line without its newline. ValueError when it could not be read back as the same transmission."""
    if not 0 <= sent.tick <= MAX_TICK:
        raise ValueError(f"tick = {sent.tick}: must be 0..{MAX_TICK}")
    if sent.direction not in DIRECTIONS:
        raise ValueError(f"direction = {sent.direction!r}: must be {DOWN!r} or {UP!r}")
    if not sent.data:
        raise ValueError("data is empty: a transmission has at least one character")
    if sent.comment != sent.comment.strip() or len(sent.comment.splitlines()) > 1:
        raise ValueError(f"comment = {sent.comment!r}: must be one line without blanks around it")
    line = f"{sent.tick} {sent.direction} {sent.data.hex(' ')}"
    return f"{line}  # {sent.comment}" if sent.comment else line


def format_stream(sent: Iterable[Transmission]) -> str:
    """The whole file. ValueError also when ticks go backwards."""
    lines, last = [FIRST_LINE], 0
    for one in sent:
        lines.append(format_line(one))
        if one.tick < last:
            raise ValueError(f"tick = {one.tick}: must not be before {last}, the one of the line above")
        last = one.tick
    return "".join(f"{line}\n" for line in lines)


def iterate(lines: Iterable[str], source: str = "<stream>") -> Iterator[Transmission]:
    """Reads line by line; StreamError at the first that is wrong. `source` names the file in errors."""
    last = 0
    for number, text in enumerate(lines, 1):
        line = _Line(source, number, text.rstrip("\r\n"))
        if number == 1:
            line.check_version()
        sent = line.parse()
        if sent is None:
            continue
        if sent.tick < last:
            remedy = f"lines are in the order of time: {last} came before it"
            raise line.error(line.first_column(), f"tick {sent.tick} goes backwards", remedy)
        last = sent.tick
        yield sent


def parse(text: str, source: str = "<stream>") -> list[Transmission]:
    return list(iterate(text.split("\n"), source))


def read(path: str | os.PathLike[str]) -> list[Transmission]:
    """Reads a stream file; StreamError, or OSError when it cannot be opened."""
    return decode(Path(path).read_bytes(), os.fspath(path))


def decode(data: bytes, source: str = "<stream>") -> list[Transmission]:
    """A stream file from its bytes; `source` names it in a StreamError."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line, column = before.count(b"\n") + 1, error.start - (before.rfind(b"\n") + 1) + 1
        reason, remedy = f"byte {data[error.start]:02x}h is not UTF-8", "save the file as UTF-8 text"
        raise StreamError(source, line, column, reason, remedy) from None
    return parse(text, source)


def write(path: str | os.PathLike[str], sent: Iterable[Transmission]) -> None:
    """Writes a stream file whole or not at all: whoever looks finds the old content or the new."""
    files.replace(path, format_stream(sent).encode())


@dataclass(frozen=True, slots=True)
class _Line:
    source: str
    number: int
    text: str

    def error(self, column: int, reason: str, remedy: str) -> StreamError:
        return StreamError(self.source, self.number, column, reason, remedy)

    def first_column(self) -> int:
        return len(self.text) - len(self.text.lstrip()) + 1

    def check_version(self) -> None:
        found = _VERSION.match(self.text)
        if found and found[1] != "1":
            reason = f"stream version {brief(found[1] or 'missing')}"
            raise self.error(
                found.start(1) + 1, reason, "this program reads version 1; use the one that wrote it"
            )

    def parse(self) -> Transmission | None:
        """The transmission, or None for a line that holds none."""
        body, _, comment = self.text.partition("#")
        tokens = list(_TOKEN.finditer(body))
        if not tokens:
            return None
        tick = self._tick(tokens[0])
        direction = self._direction(tokens, len(body.rstrip()) + 1)
        if len(tokens) == 2:
            raise self.error(len(body.rstrip()) + 1, "no characters", "write at least one as two hex digits")
        data = bytes(self._character(token) for token in tokens[2:])
        return Transmission(tick, direction, data, comment.strip())

    def _tick(self, token: re.Match[str]) -> int:
        if not _TICK.fullmatch(token[0]) or int(token[0]) > MAX_TICK:
            reason = f"{brief(token[0])} is not a tick"
            raise self.error(token.start() + 1, reason, f"a line starts with a whole number 0..{MAX_TICK}")
        return int(token[0])

    def _direction(self, tokens: list[re.Match[str]], end: int) -> str:
        remedy = f"write {DOWN} for host to robot or {UP} for robot to host after the tick"
        if len(tokens) == 1:
            raise self.error(end, "no direction", remedy)
        if tokens[1][0] not in DIRECTIONS:
            raise self.error(tokens[1].start() + 1, f"{brief(tokens[1][0])} is not a direction", remedy)
        return tokens[1][0]

    def _character(self, token: re.Match[str]) -> int:
        if not _HEX.fullmatch(token[0]):
            reason = f"{brief(token[0])} is not a character"
            raise self.error(token.start() + 1, reason, "write two hex digits each, with blanks between")
        return int(token[0], 16)
