"""The table that `mirotwin run` prints at the end of a run of a board."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from miro_exact.bad_input import amount
from mirotwin.runs.board_summary import BoardSummary, SerialCounts
from mirotwin.runs.result import expectations_text
from mirotwin.shell.console import facts_table

LONGEST_TEXT = 100
"""Of a value in the table: rows of a display are shorter."""


def board_table(summary: BoardSummary, serial: SerialCounts, image: str, folder: Path) -> Table:
    firmware, table = summary.firmware, facts_table()
    mhz = f"{summary.crystal_hz / 1e6:.6f}".rstrip("0").rstrip(".")
    table.add_row("scenario", f"{summary.scenario}, seed {summary.seed}")
    table.add_row("board", f"{summary.board}: {summary.chip}, {mhz} MHz")
    if summary.set:
        table.add_row("set", " ".join(summary.set))
    began = f"{summary.resumed_s:.2f} s to " if summary.resumed_s is not None else ""
    table.add_row(
        "time",
        f"{began}{summary.simulated_s:.2f} s in {summary.wall_s:.2f} s ({summary.realtime_factor:.1f} x real time, "
        f"engine {summary.engine})",
    )
    if summary.resumed_s is not None:
        table.add_row(
            "resumed", f"at {summary.resumed_s:.2f} s: serial port and checks from there; firmware from 0 s"
        )
    table.add_row("serial port", _serial_text(summary, serial))
    for part, values in _by_part(summary).items():
        table.add_row(part, ", ".join(values))
    idle = 100.0 * firmware.idle_cycles / firmware.machine_cycles if firmware.machine_cycles else 0.0
    table.add_row(
        "firmware",
        f"{image}: {firmware.instructions} instructions, {firmware.machine_cycles} cycles ({idle:.0f} % idle), "
        f"{amount(firmware.faults, 'fault')}",
    )
    table.add_row("expected", expectations_text(summary.expectations))
    table.add_row("digest", summary.digest)
    table.add_row("files", str(folder))
    return table


def _serial_text(summary: BoardSummary, serial: SerialCounts) -> str:
    text = f"{amount(summary.serial.to_board, 'byte')} to the board, {summary.serial.from_board} from it"
    if not serial.tail:
        return text
    shown = serial.tail.decode("ascii", "backslashreplace")
    return f"{text}; the last: {'..' if serial.from_board > len(serial.tail) else ''}{shown!r}"


def _by_part(summary: BoardSummary) -> dict[str, list[str]]:
    """The values of each part as text."""
    parts: dict[str, list[str]] = {}
    for path, value in summary.parts.items():
        part, _, key = path.partition(".")
        parts.setdefault(part, []).append(f"{key} {_shown(value)}")
    return parts


def _shown(value: float | int | bool | str) -> str:
    """A value for people; of a long text, such as what a memory holds, the beginning."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if not isinstance(value, str):
        return f"{value}"
    return (
        f"{value!r}"
        if len(value) <= LONGEST_TEXT
        else f"{value[:LONGEST_TEXT]!r}.. ({len(value)} characters)"
    )
