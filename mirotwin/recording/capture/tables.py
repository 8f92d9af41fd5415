"""Tables of logic analysers as CSV: a character a row, an edge a row, or a sample a row.

Time [s],Value,Parity Error,Framing Error     name,type,start_time,duration,data,error     (Saleae, analysers)
Time [s],Channel 0                            ; Samplerate: 1 MHz                          (edges; sigrok, samples)
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress

import msgspec

from miro_exact.bad_input import amount
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.inputs import InputError
from mirotwin.recording.capture.clock import Clock
from mirotwin.recording.capture.hexlines import CHARACTERS, characters
from mirotwin.recording.capture.pieces import Facts, Piece, direction_in
from mirotwin.recording.capture.serial_line import Change

HEAD_LINES = 200
_TIME = re.compile(
    r"(?:start[ _]?)?(?:time(?:stamp)?|时间|zeit)(?:[ _]?[\[(]?(?P<unit>s|ms|us|µs|ns)[\])]?)?", re.I
)
_VALUE = re.compile(r"value|data(?:_hex)?|bytes?|hex|char(?:acter)?s?|数据|daten|payload", re.I)
_DIRECTION = re.compile(r"dir(?:ection)?|rx ?/ ?tx|tx ?/ ?rx|方向", re.I)
_SOURCE = re.compile(r"name|channel|analy[sz]er|port|source", re.I)
_BAD_STOP = re.compile(r"framing error|error", re.I)
_SALEAE = re.compile(r"Time ?\[s\],(?:Packet ID,)?Value\b|name,type,start_time,", re.I)
_RATE = re.compile(r";.*samplerate:\s*([0-9.]+)\s*([kMG]?)Hz", re.I)
_PREFIXES = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9}
_LEVEL = re.compile(r"[01](?:\.0*)?|X", re.I)
_HEX = re.compile(rf"\s*(?:'.*'\s*\()?(?P<data>{CHARACTERS})\)?\s*")
_BINARY = re.compile(r"\s*0b((?:[01] ?){1,8})\s*")


class Table(msgspec.Struct, frozen=True):
    """The columns of a table. `kind`: characters, edges or samples; `rate_hz` and `start`, of samples: per second, and
    the first row. `unit`: of its times, if the table contains it.
    """

    kind: str
    delimiter: str
    start: int
    time: int = -1
    value: int = -1
    source: int = -1
    direction: int = -1
    errors: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    levels: tuple[int, ...] = ()
    unit: str = ""
    rate_hz: float = 0
    decimal: bool = False

    @property
    def form(self) -> str:
        """The name of its form."""
        return (
            self.kind
            if self.kind != "characters"
            else "saleae"
            if _SALEAE.match(",".join(self.names))
            else "table"
        )

    @property
    def described(self) -> str:
        """Which columns characters come from."""
        if self.kind != "characters":
            return amount(len(self.levels) + (self.time >= 0), "column") + " used"
        stop = f"; bad stop bits from {self.names[self.errors[0]]}" if self.errors else ""
        return f"2 columns used: {self.names[self.time]} and {self.names[self.value]}{stop}"


def table_of(lines: Sequence[str]) -> Table | None:
    """The columns of the table that begins with these lines; None if it is no table."""
    rate = 0.0
    for number, line in enumerate(lines):
        if not line.strip() or line.startswith((";", "#")):
            if match := _RATE.match(line):
                with suppress(ValueError):
                    rate = float(match[1]) * _PREFIXES[match[2].lower()]
            continue
        delimiter = max(",;\t", key=line.count)
        names = [name.strip() for name in fields_of(line, delimiter)]
        rows = [fields_of(row, delimiter) for row in lines[number + 1 : number + HEAD_LINES] if row.strip()]
        rows = [row for row in rows if len(row) == len(names)]
        return (
            _samples(names, rows, delimiter, number, rate) if rate else _timed(names, rows, delimiter, number)
        )
    return None


def fields_of(line: str, delimiter: str) -> list[str]:
    """The fields of a line; quotes do not reach over its end."""
    if '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        return []


def _timed(names: Sequence[str], rows: Sequence[Sequence[str]], delimiter: str, number: int) -> Table | None:
    times = [column for column, name in enumerate(names) if _TIME.fullmatch(name)]
    if not times:
        return None
    time, start = times[0], number + 1
    match = _TIME.fullmatch(names[time])
    assert match is not None
    unit = match["unit"] or ""
    rest = [column for column in range(len(names)) if column != time]
    levels = tuple(
        column for column in rest if rows and all(_LEVEL.fullmatch(row[column].strip()) for row in rows)
    )
    values = [column for column in rest if _VALUE.fullmatch(names[column])]
    if values:
        return Table(
            kind="characters",
            delimiter=delimiter,
            start=start,
            time=time,
            value=values[0],
            source=_column(names, _SOURCE),
            direction=_column(names, _DIRECTION),
            errors=_errors(names),
            names=tuple(names),
            unit=unit,
            decimal=_decimal([row[values[0]].strip() for row in rows]),
        )
    if not levels:
        return None
    level_names = tuple(names[column] for column in levels)
    return Table(
        kind="edges", delimiter=delimiter, start=start, time=time, levels=levels, names=level_names, unit=unit
    )


def _samples(
    names: Sequence[str], rows: Sequence[Sequence[str]], delimiter: str, number: int, rate: float
) -> Table | None:
    headed = not all(map(_LEVEL.fullmatch, names))
    columns = range(len(names))
    levels = tuple(column for column in columns if all(_LEVEL.fullmatch(row[column].strip()) for row in rows))
    if not levels or not rows:
        return None
    level_names = tuple(names[column] if headed else f"{column}" for column in levels)
    return Table(
        kind="samples",
        delimiter=delimiter,
        start=number + headed,
        levels=levels,
        names=level_names,
        rate_hz=rate,
    )


def _column(names: Sequence[str], wanted: re.Pattern[str]) -> int:
    return next((column for column, name in enumerate(names) if wanted.fullmatch(name)), -1)


def _errors(names: Sequence[str]) -> tuple[int, ...]:
    framing = _column(names, re.compile("framing error", re.I))
    column = framing if framing >= 0 else _column(names, _BAD_STOP)
    return (column,) if column >= 0 else ()


def _decimal(values: Sequence[str]) -> bool:
    """True if values are decimal numbers: digits only, and not all of two."""
    return bool(values) and all(map(str.isdecimal, values)) and any(len(value) != 2 for value in values)


def read_characters(lines: Iterator[str], facts: Facts, table: Table) -> Iterator[Piece]:
    """A piece a row."""
    clock, sources = Clock(table.unit), dict[str, int]()
    for number, line in enumerate(lines, 1):
        if number <= table.start or not line.strip():
            continue
        row = fields_of(line, table.delimiter)
        try:
            tick = clock.of_text(row[table.time])
            data = _value(row[table.value], table.decimal)
        except (ValueError, IndexError):
            facts.pass_over("row", f"line {number}")
            continue
        facts.resolution_ticks = clock.resolution_ticks
        words = " ".join(row[column] for column in (table.direction, table.source) if 0 <= column < len(row))
        source = row[table.source] if 0 <= table.source < len(row) else ""
        if facts.channels and source not in facts.channels:
            continue
        bad = any(
            "fram" in row[column].lower() or _truth(row[column])
            for column in table.errors
            if column < len(row)
        )
        yield Piece(tick, direction_in(words), data, sources.setdefault(source, len(sources)), bad)


def _truth(text: str) -> bool:
    return text.strip().lower() in ("error", "true", "1", "yes")


def _value(text: str, decimal: bool) -> bytes:
    """The characters in a cell. Raises ValueError where there are none."""
    if decimal:
        return bytes([int(text)])
    if match := _HEX.fullmatch(text):
        return characters(match["data"])
    if match := _BINARY.fullmatch(text):
        return bytes([int(match[1].replace(" ", ""), 2)])
    raise ValueError(f"{text[:20]!r} is no character")


def read_levels(lines: Iterator[str], facts: Facts, table: Table) -> Iterator[Change]:
    """Level changes of the wires, in the order of the rows."""
    clock = Clock(table.unit)
    last = [""] * len(table.levels)
    sample = -1
    for number, line in enumerate(lines, 1):
        if number <= table.start or not line.strip() or line.startswith(";"):
            continue
        sample += 1
        row = fields_of(line, table.delimiter)
        try:
            levels = [row[column].strip()[0] for column in table.levels]
            tick = (
                round(sample * TICKS_PER_SECOND / table.rate_hz)
                if table.rate_hz
                else clock.of_text(row[table.time])
            )
        except (ValueError, IndexError):
            facts.pass_over("row", f"line {number}")
            continue
        for wire, level in enumerate(levels):
            if level != last[wire] and level in "01":  # X: not known there
                last[wire] = level
                yield Change(tick, wire, int(level))
    if sample < 0:
        raise InputError(facts.label, "holds no row", "export the table again")
