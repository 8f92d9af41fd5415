"""The tracker's colour classes: samples, classes, and the table from a pixel to its class.

Samples are pixels read off pictures, in a CSV file:

    colour,r,g,b            or: colour,y,cb,cr
    yellow,231,209,40
    floor,34,78,52

The classes' numbers are fixed: 1 is the first of `patterns.COLOURS`, 0 is none. A pixel belongs to the class with the
nearest hue (direction of its chroma) if its chroma, projected on the class's mean, has at least `least_chroma` of the
mean's length, and its Y at least `least_luma` of the mean's. Half the length is where a patch covers half a pixel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from miro_host.eye.eye_file import EyeError, csv_rows, text, text_of
from miro_host.eye.patterns import COLOURS

CLASS_OF = {name: number for number, name in enumerate(COLOURS, start=1)}
"""Number of a colour's class."""
FLOOR = "floor"
RGB = ("colour", "r", "g", "b")
YCC = ("colour", "y", "cb", "cr")

SIGMAS = 2.5
"""Two hues overlap if their border is nearer to a mean than this many times the spread of its samples."""
LEAST_CHROMA = 10.0
"""Levels: a mean chroma shorter than this is grey."""

MOST_FLOOR = 0.45
"""Share of a colour's chroma that the floor may have."""

Level = Annotated[float, Meta(ge=0.0, le=255.0)]
Share = Annotated[float, Meta(gt=0.0, le=1.0)]
Samples = dict[str, list[tuple[int, int, int]]]


def read_samples(path: str | Path) -> Samples:
    """Pixels (Y, Cb, Cr) by colour name. Raises EyeError."""
    return parse_samples(text_of(path), f"{path}")


def parse_samples(text: str, origin: str) -> Samples:
    """Colour samples from CSV text.

    Raises EyeError with the line for wrong columns and for a value that is no level.
    """
    samples: Samples = {}
    for line, cells in csv_rows(text, origin, RGB, YCC):
        name = cells.pop("colour").strip()
        columns = RGB if "r" in cells else YCC
        first, second, third = (_level(cells[column], origin, line) for column in columns[1:])
        pixel = _of_rgb(first, second, third) if columns is RGB else (first, second, third)
        samples.setdefault(name, []).append(pixel)
    return samples


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


class ColourMean(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A colour as measured: means of Y, Cb, Cr (0 to 255, Cb and Cr 128 for grey), rms distance of chroma from them."""

    y: Level
    cb: Level
    cr: Level
    spread: Annotated[float, Meta(ge=0.0, le=255.0)] = 0.0

    def chroma(self) -> tuple[int, int]:
        """Cb - 128 and Cr - 128 in 1/16 level."""
        return _sixteenths(self.cb - 128.0), _sixteenths(self.cr - 128.0)


class ColourClasses(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, dict=True):
    """The classes of some or all of `patterns.COLOURS`, by name, and the floor's colour, if known.

    Raises ValueError for colours that cannot be distinguished.
    """

    colours: dict[str, ColourMean]
    floor: ColourMean | None = None
    least_chroma: Share = 0.5
    least_luma: Share = 0.25

    def __post_init__(self) -> None:
        problem = _problem(self.colours, self.floor)
        if problem is not None:
            raise ValueError(f"{problem[0]}: {problem[1]}; {problem[2]}")

    def text(self) -> str:
        """The classes as TOML for `eye_file.read`."""
        return text(self)

    def chroma(self, name: str) -> tuple[int, int]:
        """Mean Cb - 128 and Cr - 128 of a colour in 1/16 level. Raises EyeError for one without a class."""
        if name not in self.colours:
            raise EyeError("", f"colours.{name}", "no class of this colour", "sample it")
        return self.colours[name].chroma()

    @cached_property
    def table(self) -> bytes:
        """Class by Y >> 4, Cb >> 2, Cr >> 2, as `Regions` takes it: decided in the middle of each cell."""
        cells = self._by_chroma()
        table = bytearray()
        for luma in range(16):
            numbers = bytearray(range(256))  # of a class, and what a pixel of this luma is then
            for name, mean in self.colours.items():
                if 16.0 * luma + 8.0 < self.least_luma * mean.y:
                    numbers[CLASS_OF[name]] = 0
            table += cells.translate(numbers)
        return bytes(table)

    def _by_chroma(self) -> bytearray:
        """Table from (Cb >> 2, Cr >> 2) of a bright enough pixel to its class: that of the nearest hue, 0 for too
        little chroma.
        """
        middles = [64.0 * cell - 2016.0 for cell in range(64)]  # in 1/16 level around grey
        numbers, nearest = bytearray(4096), [0.0] * 4096
        for name, mean in self.colours.items():
            cb, cr = mean.chroma()
            length = math.sqrt(float(cb * cb + cr * cr))
            number, least = CLASS_OF[name], self.least_chroma * length
            along_cr = [middle * float(cr) for middle in middles]
            cells = ((middle * float(cb) + part) / length for middle in middles for part in along_cr)
            for cell, along in enumerate(cells):  # cosine to the class's hue, times the pixel's chroma
                if along > nearest[cell]:
                    numbers[cell], nearest[cell] = (number if along >= least else 0), along
        return numbers


def classes_of(
    samples: Mapping[str, Sequence[tuple[int, int, int]]], origin: str = "colours"
) -> ColourClasses:
    """Classes from sampled pixels (Y, Cb, Cr) by colour name; `FLOOR` may be among the names.

    Raises EyeError for an unknown colour, none or too few samples, grey samples, and colours that overlap.
    """
    means = {}
    for name, pixels in samples.items():
        if len(pixels) < 4:
            sampled = f"{len(pixels)} sampled pixels"
            raise EyeError(origin, f"colours.{name}", sampled, "sample at least 4, better a whole patch")
        means[name] = _mean(pixels)
    floor = means.pop(FLOOR, None)
    problem = _problem(means, floor)
    if problem is not None:
        raise EyeError(origin, *problem)
    return ColourClasses(colours=means, floor=floor)


def _mean(pixels: Sequence[tuple[int, int, int]]) -> ColourMean:
    """Means to 1/16 level, from integer sums."""
    count = len(pixels)
    y, cb, cr = map(sum, zip(*pixels, strict=True))
    squares = 0
    for _, blue, red in pixels:
        squares += blue * blue + red * red
    variance = (squares * count - cb * cb - cr * cr) / (count * count)
    means = [(32 * total + count) // (2 * count) / 16.0 for total in (y, cb, cr)]
    spread = _sixteenths(math.sqrt(variance)) / 16.0
    return ColourMean(y=means[0], cb=means[1], cr=means[2], spread=spread)


def _sixteenths(x: float) -> int:
    return math.floor(16.0 * x + 0.5)


def _problem(means: Mapping[str, ColourMean], floor: ColourMean | None) -> tuple[str, str, str] | None:
    """Place, reason and remedy for the first colour that cannot be distinguished."""
    if not means:
        return "colours", "there is no colour", "sample the team's colour and the identities'"
    names = list(means)
    for index, name in enumerate(names):
        place, mean = f"colours.{name}", means[name]
        if name not in CLASS_OF:
            return place, "unknown colour", f"use {', '.join(COLOURS)}"
        if _length(mean) < LEAST_CHROMA:
            return place, "the samples are grey", "sample inside the patch, or use a stronger paint"
        if floor is not None and _share(floor, mean) > MOST_FLOOR:
            return place, "the floor has nearly the same colour", "use another paint, or a duller floor"
        for other in names[:index]:
            if _overlap(mean, means[other]):
                problem = f"cannot be told from {other}: hues too near for the noise in the samples"
                return place, problem, "use another paint, more light, or sample inside the patches"
    return None


def _overlap(mean: ColourMean, other: ColourMean) -> bool:
    """True if noise takes samples of one across the line of equal hue distance, the bisector of both directions."""
    first, second = _length(mean), _length(other)
    dx = (mean.cb - 128.0) / first - (other.cb - 128.0) / second
    dy = (mean.cr - 128.0) / first - (other.cr - 128.0) / second
    sine = 0.5 * math.sqrt(dx * dx + dy * dy)  # of half the angle between the hues
    spread = max(mean.spread, other.spread, 1.0)
    return sine * min(first, second) < SIGMAS * spread / math.sqrt(2.0)


def _share(floor: ColourMean, mean: ColourMean) -> float:
    """The floor's chroma, projected on a colour's, by the length of that."""
    along = (floor.cb - 128.0) * (mean.cb - 128.0) + (floor.cr - 128.0) * (mean.cr - 128.0)
    length = _length(mean)
    return along / (length * length)


def _length(mean: ColourMean) -> float:
    cb, cr = mean.cb - 128.0, mean.cr - 128.0
    return math.sqrt(cb * cb + cr * cr)
