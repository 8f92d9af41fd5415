"""Regions of one colour class in a window of pixels.

After CMVision (Bruce, Balch, Veloso, IROS 2000).

    pixels (Y, Cb, Cr) -> table -> class -> runs -> union-find -> regions

Runs touch if they have the same class, lie in neighbouring rows and share a column (4-connectivity): patches of two
robots that touch by a corner stay apart. Regions are numbered by their first pixel, rows from the top. All integers.
"""

from __future__ import annotations

from typing import NamedTuple

TABLE_SIZE = 65536
_PIXELS = 4096
"""Most of one window: no run is shorter than a pixel, so the arrays hold all runs of any picture."""


class Region(NamedTuple):
    """One region, in pixels of its window; `right` and `bottom` are the first column and row outside of it.

    `sum_u`, `sum_v`: sums of 2 i + 1 over the pixels' columns and rows, so that the centroid is sum / (2 area), with
    the centre of pixel i at i + 0.5. `touches`: a pixel lies on the border of the window, so a part may be missing.
    """

    kind: int
    area: int
    left: int
    top: int
    right: int
    bottom: int
    sum_u: int
    sum_v: int
    touches: bool


class Regions:
    """The regions of the window that was looked at last: `count` of them, by `region(index)`."""

    NOT_STATE = ("*",)

    def __init__(self, table: bytes) -> None:
        """`table`: class of a pixel by Y >> 4, Cb >> 2, Cr >> 2 (4, 6, 6 bits); 0 is none. ValueError: wrong size."""
        if len(table) != TABLE_SIZE:
            raise ValueError(f"the table of colour classes has {len(table)} entries, not {TABLE_SIZE}")
        self.table = table
        self.width = self.height = self.runs = self.count = 0
        self.run_kind = [0] * 4096
        self.run_row = [0] * 4096
        self.run_start = [0] * 4096
        self.run_end = [0] * 4096
        self.parent = [0] * 4096
        self.label = [0] * 4096
        self.kind = [0] * 4096
        self.area = [0] * 4096
        self.left = [0] * 4096
        self.top = [0] * 4096
        self.right = [0] * 4096
        self.bottom = [0] * 4096
        self.sum_u = [0] * 4096
        self.sum_v = [0] * 4096
        self.touches = [0] * 4096

    def __repr__(self) -> str:
        return f"Regions({self.count} in a window of {self.width} x {self.height})"

    def find(self, pixels: bytearray, width: int, height: int) -> int:
        """Looks at a window as `Frame.window` gives it; returns the number of regions. ValueError for a wrong size."""
        if width < 1 or height < 1 or width > _PIXELS or height > _PIXELS or width * height > _PIXELS:
            raise ValueError(f"a window of {width} x {height} pixels; it must have 1 to {_PIXELS}")
        if len(pixels) != 3 * width * height:
            raise ValueError(f"{len(pixels)} bytes are not {width} x {height} pixels of 3")
        self.width = width
        self.height = height
        self.find_runs(pixels)
        self.merge()
        self.collect()
        return self.count

    def region(self, index: int) -> Region:
        """A region by its number. IndexError for one that is not there."""
        if not 0 <= index < self.count:
            raise IndexError(f"region {index} of {self.count}")
        return Region(
            *(self.kind[index], self.area[index], self.left[index], self.top[index], self.right[index]),
            *(self.bottom[index], self.sum_u[index], self.sum_v[index], bool(self.touches[index])),
        )

    def centroid(self, index: int) -> tuple[float, float]:
        """(u, v) of a region's centroid in its window. IndexError for a region that is not there."""
        if not 0 <= index < self.count:
            raise IndexError(f"region {index} of {self.count}")
        return 0.5 * self.sum_u[index] / self.area[index], 0.5 * self.sum_v[index] / self.area[index]

    # ---- the three steps of `find`

    def find_runs(self, pixels: bytearray) -> None:
        """Runs of one class other than 0, row by row."""
        data = pixels
        table = self.table
        width = self.width
        at = 0
        runs = 0
        for row in range(self.height):
            before = 0
            for column in range(width):
                kind = table[(data[at] & 0xF0) << 8 | (data[at + 1] & 0xFC) << 4 | data[at + 2] >> 2]
                at += 3
                if kind == before:
                    continue
                if before != 0:
                    self.run_end[runs - 1] = column
                if kind != 0:
                    self.run_kind[runs] = kind
                    self.run_row[runs] = row
                    self.run_start[runs] = column
                    self.parent[runs] = runs
                    runs += 1
                before = kind
            if before != 0:
                self.run_end[runs - 1] = width
        self.runs = runs

    def merge(self) -> None:
        """Joins each run with those of the row above that it touches."""
        above = 0
        for run in range(self.runs):
            row = self.run_row[run]
            while self.run_row[above] < row - 1 or (
                self.run_row[above] == row - 1 and self.run_end[above] <= self.run_start[run]
            ):
                above += 1
            other = above
            while (
                other < run and self.run_row[other] == row - 1 and self.run_start[other] < self.run_end[run]
            ):
                if self.run_kind[other] == self.run_kind[run]:
                    self.join(other, run)
                other += 1

    def join(self, first: int, other: int) -> None:
        """Makes one tree of both; its root is the earliest run."""
        first, other = self.root(first), self.root(other)
        self.parent[max(first, other)] = min(first, other)

    def root(self, run: int) -> int:
        """The root of a run's tree; halves the way to it (Tarjan and van Leeuwen 1984)."""
        while self.parent[run] != run:
            self.parent[run] = self.parent[self.parent[run]]
            run = self.parent[run]
        return run

    def collect(self) -> None:
        """Regions from the trees of runs."""
        self.count = 0
        for run in range(self.runs):
            root = self.root(run)
            if root == run:  # a new, empty region
                index = self.count
                self.count += 1
                self.label[run] = index
                self.kind[index] = self.run_kind[run]
                self.area[index] = self.sum_u[index] = self.sum_v[index] = self.touches[index] = 0
                self.left[index], self.right[index] = self.width, 0
                self.top[index] = self.run_row[run]
            self.add(self.label[root], run)

    def add(self, index: int, run: int) -> None:
        """A run becomes part of a region."""
        start = self.run_start[run]
        end = self.run_end[run]
        row = self.run_row[run]
        self.area[index] += end - start
        self.sum_u[index] += (end - start) * (end + start)  # of 2 i + 1 for i from start to end - 1
        self.sum_v[index] += (end - start) * (2 * row + 1)
        self.left[index] = min(self.left[index], start)
        self.right[index] = max(self.right[index], end)
        self.bottom[index] = row + 1
        if start == 0 or end == self.width or row == 0 or row == self.height - 1:
            self.touches[index] = 1
