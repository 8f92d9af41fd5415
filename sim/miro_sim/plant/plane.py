# cython: cdivision=True
# No divisor below is ever zero: `Car` has no walls shorter than 0.01 cm, and the others are looked at before.
"""The floor that a car drives on: walls, and dark lines on light ground, in cm.

Walls are segments without thickness. Lines are polylines of one width with round ends and corners, and a picture of
square cells. All that asks for it is worked out anew each time: nothing here is state.
"""

from __future__ import annotations

import math

Segment = tuple[float, float, float, float]

MOST_SEGMENTS = 1024
_FAR = 1e9  # cm: there is no wall
_NO_LENGTH = 1e-9  # cm2: a dot
_EDGE = 1e-9  # cm: how far a cell of the picture says that its edge is
_BEAM_TAN = 0.13165249758739583  # of 7.5 degrees, half the angle of the beam
_GRAZING_COS = 0.7071067811865476  # of 45 degrees
_SAME = 1.000001


class Plane:
    """`walls`, `lines`: segments; `line_cm`: width of the lines. `picture`: rows of cells, the top one first, whose
    lower left corner is at the origin; what is neither blank, `.` nor `-` is dark.
    """

    NOT_STATE = ("*",)

    def __init__(
        self, walls: list[Segment], lines: list[Segment], line_cm: float, picture: list[str], cell_cm: float
    ) -> None:
        self.walls = [0.0] * 4096
        self.lines = [0.0] * 4096
        self.walls_end, self.lines_end = 4 * len(walls), 4 * len(lines)
        for at, value in enumerate([value for wall in walls for value in wall]):
            self.walls[at] = value
        for at, value in enumerate([value for line in lines for value in line]):
            self.lines[at] = value
        self.half_cm = 0.5 * line_cm
        self.rows = [[cell not in " .-" for cell in row] for row in reversed(picture)]  # the lowest first
        self.cell_cm = cell_cm

    def room_cm(self, x: float, y: float) -> float:
        """From a point to the nearest wall."""
        return self._nearest(self.walls, self.walls_end, x, y)

    def _nearest(self, ends: list[float], end: int, x: float, y: float) -> float:
        least = _FAR * _FAR
        for at in range(0, end, 4):
            a_x = ends[at] - x
            a_y = ends[at + 1] - y
            d_x = ends[at + 2] - ends[at]
            d_y = ends[at + 3] - ends[at + 1]
            length2 = d_x * d_x + d_y * d_y
            share = 0.0
            if length2 > _NO_LENGTH:
                share = min(max(-(a_x * d_x + a_y * d_y) / length2, 0.0), 1.0)
            a_x += share * d_x
            a_y += share * d_y
            least = min(least, a_x * a_x + a_y * a_y)
        return math.sqrt(least)

    def edge_cm(self, x: float, y: float) -> float:
        """Lower bound of the distance from a point of the light floor to the next edge of a line, in cm; negative on a
        line.
        """
        away = self._nearest(self.lines, self.lines_end, x, y) - self.half_cm
        if not self.rows:
            return away
        return min(away, -_EDGE if self._is_dark(x, y) else _EDGE)

    def _is_dark(self, x: float, y: float) -> bool:
        """True if the cell of the picture at a point is dark."""
        if x < 0.0 or y < 0.0 or x >= _FAR or y >= _FAR:
            return False
        row, column = int(y / self.cell_cm), int(x / self.cell_cm)
        if row >= len(self.rows) or column >= len(self.rows[row]):
            return False
        dark: bool = self.rows[row][column]
        return dark

    def echo_cm(self, x: float, y: float, cosine: float, sine: float) -> float:
        """From a point to the nearest place of a wall in the beam that sends sound back; below 0: there is none.

        The beam is a cone of 15 degrees. A place of a wall that it meets at more than 45 degrees from the perpendicular
        sends no echo; neither does what is behind the wall that the middle of the beam meets.
        """
        nearest = beyond = _FAR
        for at in range(0, self.walls_end, 4):
            a_x = self.walls[at] - x
            a_y = self.walls[at + 1] - y
            d_x = self.walls[at + 2] - self.walls[at]
            d_y = self.walls[at + 3] - self.walls[at + 1]
            # ahead and to the left, of both ends
            ahead = a_x * cosine + a_y * sine
            left = a_y * cosine - a_x * sine
            more = d_x * cosine + d_y * sine
            aside = d_y * cosine - d_x * sine
            if left * (left + aside) <= 0.0 and aside != 0.0:
                middle = ahead - more * left / aside
                if middle >= 0.0:
                    beyond = min(beyond, middle)
            nearest = min(nearest, self._beam_cm(ahead, left, more, aside))
        return nearest if nearest < _FAR and nearest <= beyond * _SAME else -1.0

    def _beam_cm(self, ahead: float, left: float, more: float, aside: float) -> float:
        """From the ranger to the nearest place of one wall that sends an echo, or `_FAR`.

        The wall goes from (ahead, left) by (more, aside), in the axes of the beam.
        """
        first, last = 0.0, 1.0
        for side in (-1.0, 1.0):  # cut off what is beyond each edge of the beam
            inside = _BEAM_TAN * ahead + side * left
            change = _BEAM_TAN * more + side * aside
            if inside < 0.0 and inside + change < 0.0:
                return _FAR
            if inside < 0.0:
                first = max(first, -inside / change)
            elif inside + change < 0.0:
                last = min(last, -inside / change)
        if first > last:
            return _FAR
        length2 = more * more + aside * aside
        share = min(max(-(ahead * more + left * aside) / length2, first), last)
        normal_cm = abs(ahead * aside - left * more) / math.sqrt(length2)
        ahead += share * more
        left += share * aside
        distance = math.sqrt(ahead * ahead + left * left)
        return distance if normal_cm >= _GRAZING_COS * distance else _FAR

    def __repr__(self) -> str:
        return f"Plane({self.walls_end // 4} walls, {self.lines_end // 4} pieces of lines)"
