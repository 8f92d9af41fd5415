"""Sampled pixels in a CSV file: what somebody reads off his own pictures, so that the tracker knows its colours.

colour,r,g,b            or: colour,y,cb,cr
yellow,231,209,40
floor,34,78,52
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

from miro_host.eye.eye_file import EyeError, text_of

RGB = ("colour", "r", "g", "b")
YCC = ("colour", "y", "cb", "cr")

Samples = dict[str, list[tuple[int, int, int]]]


def read_samples(path: str | Path) -> Samples:
    """Pixels (Y, Cb, Cr) by colour name. Raises EyeError."""
    return parse_samples(text_of(path), f"{path}")


def parse_samples(text: str, origin: str) -> Samples:
    """The same from CSV text. Raises EyeError with the line for wrong columns and for what is no level."""
    reader = csv.reader(io.StringIO(text))
    try:
        header = tuple(name.strip() for name in next(reader, []))
        if header not in (RGB, YCC):
            remedy = f"they must be {', '.join(RGB)} or {', '.join(YCC)}"
            raise EyeError(origin, 1, f"the columns are {', '.join(header)}", remedy)
        found: Samples = {}
        for row in reader:
            if row:
                pixel = _pixel(row, origin, reader.line_num)
                found.setdefault(row[0].strip(), []).append(_of_rgb(*pixel) if header == RGB else pixel)
        return found
    except csv.Error as error:
        raise EyeError(origin, reader.line_num, f"is no CSV: {error}", "mend the line") from None


def _pixel(row: list[str], origin: str, line: int) -> tuple[int, int, int]:
    if len(row) != len(RGB):
        raise EyeError(origin, line, f"{len(row)} cells", f"a line must have {len(RGB)}")
    levels = []
    for cell in row[1:]:
        level = cell.strip()
        if not (level.isascii() and level.isdigit() and len(level) < 4 and int(level) < 256):
            raise EyeError(origin, line, f"{cell[:20]!r} is no level", "write whole numbers from 0 to 255")
        levels.append(int(level))
    return levels[0], levels[1], levels[2]


def _of_rgb(red: int, green: int, blue: int) -> tuple[int, int, int]:
    """ITU-R BT.601 in full range (JFIF), rounded."""
    return (
        (77 * red + 150 * green + 29 * blue + 128) >> 8,
        min(128 + ((0 - 43 * red - 85 * green + 128 * blue + 128) >> 8), 255),
        min(128 + ((128 * red - 107 * green - 21 * blue + 128) >> 8), 255),
    )
