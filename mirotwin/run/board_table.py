"""The table that `mirotwin run` prints at the end of a run of a board."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from miro_exact.bad_input import amount
from mirotwin.run.run_table import begun_table, ended_table
from mirotwin.runs.board_summary import BoardSummary, SerialCounts

LONGEST_TEXT = 100
"""Of a value in the table: rows of a display are shorter."""


def board_table(summary: BoardSummary, serial: SerialCounts, image: str, folder: Path) -> Table:
    mhz = f"{summary.crystal_hz / 1e6:.6f}".rstrip("0").rstrip(".")
    board = ("board", f"{summary.board}: {summary.chip}, {mhz} MHz")
    table = begun_table(summary, "serial port and checks from there; firmware from 0 s", board)
    table.add_row("serial port", _serial_text(summary, serial))
    for part, values in _by_part(summary).items():
        table.add_row(part, ", ".join(values))
    return ended_table(table, summary, folder, f"{image}: ")


def _serial_text(summary: BoardSummary, serial: SerialCounts) -> str:
    text = f"{amount(summary.serial.to_board, 'byte')} to the board, {summary.serial.from_board} from it"
    if summary.serial.firmware_baud:
        text += f"; the firmware has {summary.serial.firmware_baud} baud, [serial] has another rate"
    if not serial.tail:
        return text
    return f"{text}; the last: {'..' if serial.from_board > len(serial.tail) else ''}{serial.tail.decode('latin-1')!a}"


def _by_part(summary: BoardSummary) -> dict[str, list[str]]:
    """The values of each part as text."""
    parts: dict[str, list[str]] = {}
    for path, value in summary.parts.items():
        part, _, key = path.partition(".")
        parts.setdefault(part, []).append(f"{key} {_shown(value)}")
    return parts


def _shown(value: float | int | bool | str) -> str:
    """A value for people; of a long text, such as a memory's content, the beginning."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if not isinstance(value, str):
        return f"{value}"
    return (
        f"{value!r}"
        if len(value) <= LONGEST_TEXT
        else f"{value[:LONGEST_TEXT]!r}.. ({len(value)} characters)"
    )
