"""The header of a stream file of version 2: the lines that begin with `#:`, which are one TOML document.

    #: scenario = "fig6"
    #: seed = 7

One blank after `#:` is not part of the document.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any, NoReturn

import msgspec
from msgspec import Meta

from miro_exact.bad_input import did_you_mean
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.domain import MAX_SEED
from miro_protocol.stream_line import StreamError
from miro_protocol.toml_text import TomlError, tables

PREFIX = "#:"


class Header(msgspec.Struct, frozen=True, kw_only=True):
    """The header of a stream file; a missing key is None. `text` is the document, without prefixes.

    `scenario`: the name of a built-in scenario, or a whole one. `set`: changes to the scenario, by the path of a key.
    `expect`: checks, as in a scenario. `verdict`: what the one of them said that failed, `end_tick`: where that run
    ended; with them the file is a case. `bare`: clock and bit length where it is for a bare processor and not for the
    robot. `board`: the file, the name or the table of the board that it is for; `crystal_hz`: ticks per second, default
    24,000,000. `version`: of the program that wrote the file.
    """

    text: str = ""
    scenario: str | dict[str, Any] | None = None
    seed: Annotated[int, Meta(ge=0, le=MAX_SEED)] | None = None
    firmware_sha256: Annotated[str, Meta(pattern=r"\A[0-9a-f]{64}\Z")] | None = None
    set: dict[str, Any] | None = None
    expect: dict[str, Any] | None = None
    verdict: str | None = None
    end_tick: Annotated[int, Meta(ge=1, le=(1 << 61) - 1)] | None = None
    bare: dict[str, Any] | None = None
    board: str | dict[str, Any] | None = None
    crystal_hz: Annotated[int, Meta(ge=1, le=10**9)] | None = None
    version: str | None = None

    @property
    def needed_version(self) -> int:
        """The first version of a stream file whose header may have these keys."""
        return 2 if self.board is None and self.crystal_hz is None else 3

    @property
    def clock(self) -> int:
        """Ticks per second: of the crystal that the file names, or that a case for a bare processor names."""
        named = self.crystal_hz or (self.bare or {}).get("crystal_hz")
        return named if type(named) is int and named > 0 else TICKS_PER_SECOND


KEYS = {field.name: field.type for field in msgspec.structs.fields(Header) if field.name != "text"}


def of_text(text: str) -> Header:
    """The header that a TOML document makes. Raises StreamError with lines of the document."""
    return parse(
        [(number, f"{PREFIX} {line}") for number, line in enumerate(text.split("\n"), 1)], "<header>"
    )


def lines(header: Header) -> list[str]:
    """The header's lines, without newlines. ValueError when they could not be read back."""
    if not header.text:
        return []
    if "\r" in header.text:
        raise ValueError("the header holds a carriage return, which ends no line of a stream file")
    return [f"{PREFIX} {line}" if line else PREFIX for line in header.text.split("\n")]


def parse(numbered: Sequence[tuple[int, str]], source: str) -> Header:
    """The header in the lines with these numbers, prefixes included. Raises StreamError."""
    return _Document(numbered, source).header() if numbered else Header()


class _Document:
    def __init__(self, numbered: Sequence[tuple[int, str]], source: str) -> None:
        self.source = source
        self.numbers = [number for number, _ in numbered]
        behind = [line[len(PREFIX) :] for _, line in numbered]
        self.blanks = [line.startswith(" ") for line in behind]
        self.lines = [line.removeprefix(" ") for line in behind]

    def header(self) -> Header:
        text = "\n".join(self.lines)
        try:
            raw = tables(text)
        except TomlError as error:
            remedy = error.remedy or "the lines that begin with #: are one TOML document"
            self._fail(max(error.line - 1, 0), max(error.column - 1, 0), f"the header: {error.what}", remedy)
        for key in raw:
            if key not in KEYS:
                remedy = did_you_mean(key, KEYS, f"a header has {', '.join(KEYS)}")
                self._fail(*self._place(key), f"unknown key {key[:40]!r}", remedy)
        values = {key: self._value(key, value) for key, value in raw.items()}
        return Header(text=text, **values)

    def _value(self, key: str, value: Any) -> Any:
        try:
            return msgspec.convert(value, KEYS[key])
        except msgspec.ValidationError as error:
            self._fail(*self._place(key), f"{key}: {str(error).partition(' - at ')[0]}", _REMEDIES[key])

    def _place(self, key: str) -> tuple[int, int]:
        """Line and column, from 0, where `key` stands."""
        named = re.compile(rf"""\s*\[?\s*["']?{re.escape(key)}["']?\s*[]=.]""")
        for number, line in enumerate(self.lines):
            if named.match(line):
                return number, line.index(key)
        return 0, 0

    def _fail(self, line: int, column: int, reason: str, remedy: str) -> NoReturn:
        before = len(PREFIX) + self.blanks[line] + 1
        raise StreamError(self.source, self.numbers[line], column + before, reason, remedy) from None


_REMEDIES = {
    "scenario": "give the name of a built-in scenario, or a whole one as a table",
    "seed": f"give a whole number 0..{MAX_SEED}",
    "firmware_sha256": "give 64 hex digits in small letters",
    "set": "give a table: paths of keys and their values",
    "expect": "give a table: checks and what they expect",
    "verdict": "give the line of the check that failed as text",
    "bare": "give a table: crystal_hz, bit_ticks, begin_tick",
    "board": "give the path of a board file, the name of a built-in board, or a whole one as a table",
    "crystal_hz": "give a whole number of hertz",
    "end_tick": f"give a whole number 1..{(1 << 61) - 1}",
    "version": "give the version as text",
}
