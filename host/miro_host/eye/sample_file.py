"""Sampled pixels in a CSV file: what somebody reads off his own pictures, so that the tracker knows its colours.

colour,r,g,b            or: colour,y,cb,cr
yellow,231,209,40
floor,34,78,52
"""

from __future__ import annotations

from pathlib import Path

from miro_host.eye.eye_file import EyeError, csv_rows, text_of

RGB = ("colour", "r", "g", "b")
YCC = ("colour", "y", "cb", "cr")

Samples = dict[str, list[tuple[int, int, int]]]


def read_samples(path: str | Path) -> Samples:
    """Pixels (Y, Cb, Cr) by colour name. Raises EyeError."""
    return parse_samples(text_of(path), f"{path}")


def parse_samples(text: str, origin: str) -> Samples:
    """The same from CSV text. Raises EyeError with the line for wrong columns and for what is no level."""
    found: Samples = {}
    for line, cells in csv_rows(text, origin, RGB, YCC):
        name = cells.pop("colour").strip()
        columns = RGB if "r" in cells else YCC
        one, two, three = (_level(cells[column], origin, line) for column in columns[1:])
        pixel = _of_rgb(one, two, three) if columns is RGB else (one, two, three)
        found.setdefault(name, []).append(pixel)
    return found


def _level(cell: str, origin: str, line: int) -> int:
    level = cell.strip()
    if not (level.isascii() and level.isdigit() and len(level) < 4 and int(level) < 256):
        raise EyeError(origin, line, f"{cell[:20]!r} is no level", "write whole numbers from 0 to 255")
    return int(level)


def _of_rgb(red: int, green: int, blue: int) -> tuple[int, int, int]:
    """ITU-R BT.601 in full range (JFIF), rounded."""
    return (
        (77 * red + 150 * green + 29 * blue + 128) >> 8,
        min(128 + ((0 - 43 * red - 85 * green + 128 * blue + 128) >> 8), 255),
        min(128 + ((128 * red - 107 * green - 21 * blue + 128) >> 8), 255),
    )
