"""An enlarged picture with the tracker's result drawn on it.

thin grey frame          a window in which a robot was looked for and found; red: it was not found there in the end
thin blue frame          a window of the search of the whole picture
coloured outline         pixels that the tracker classified as that colour, in the windows
small cross              centroid of a patch
arrow, "2 0.93"          measured posture, number of the robot, confidence
"2 lost"                 at the window in which it was looked for last, if there is one, and below the picture
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageOps
from PIL.ImageFont import load_default

from miro_exact.dmath import sincos
from miro_host.eye.patterns import COLOURS
from miro_host.eye.tracker import Notes, Pair, Tracker, Window
from mirotwin.camera.picture import Picture

SCALE = 3
STRIP_PX = 24
"""Height of the line of text below the picture."""
INK = {
    "yellow": (255, 235, 60),
    "blue": (90, 150, 255),
    "magenta": (255, 70, 190),
    "cyan": (70, 235, 255),
    "green": (70, 235, 90),
    "violet": (190, 120, 255),
    "lime": (200, 255, 60),
    "orange": (255, 160, 40),
}
"""Outline of each colour class: like the colour, and visible on black."""
WHITE = (255, 255, 255)
BLACK = (0, 0, 0)
FOUND = (150, 150, 150)
LOST = (255, 90, 80)
SEARCHED = (110, 160, 230)
ARROW_M = 0.07
"""From the middle of the robot; its edge is at 3.75 cm."""
HEAD_M = 0.018
ROBOT_PX = 34
"""Half the size of a robot in the enlarged picture, in pixels."""
ASIDE_PX = 56
"""From the middle of a robot to its label: outside of the usual window."""

Point = tuple[float, float]


class Box(NamedTuple):
    """A rectangle of the enlarged picture."""

    left: float
    top: float
    right: float
    bottom: float

    def shared(self, other: Box) -> float:
        """Area of the intersection of both boxes."""
        width = min(self.right, other.right) - max(self.left, other.left)
        height = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(width, 0.0) * max(height, 0.0)


class _Label(NamedTuple):
    number: str
    text: str
    at: Point
    away: float
    tip: Point | None
    colour: tuple[int, int, int]


def draw(picture: Picture, tracker: Tracker, notes: Notes | None, caption: str) -> Image.Image:
    """The picture with everything above; `notes` None: the tracker never got this picture."""
    image = picture.image().resize((SCALE * picture.width, SCALE * picture.height), Image.Resampling.NEAREST)
    lost = []
    if notes is not None:
        image = _outlined(image, picture, tracker.table, notes.windows)
        lost = [robot for robot, pair in zip(tracker.robots, notes.pairs, strict=True) if pair is None]
        brush = ImageDraw.Draw(image)
        _draw_windows(brush, notes)
        _draw_arrows(image, tracker, notes.pairs)
        for pair in notes.pairs:
            if pair is not None:
                _cross(brush, pair.u, pair.v)
                _cross(brush, pair.identity_u, pair.identity_v)
        _draw_labels(brush, _labels(tracker, notes), tracker.team, Box(0.0, 0.0, *map(float, image.size)))
    return _with_strip(image, caption, lost)


def _outlined(image: Image.Image, picture: Picture, table: bytes, windows: Sequence[Window]) -> Image.Image:
    """Lines around the pixels of each colour class, on the pixels outside of them."""
    kinds = np.pad(_classes(picture, table, windows).repeat(SCALE, axis=0).repeat(SCALE, axis=1), 1)
    pixels = np.array(image)
    for kind, name in enumerate(COLOURS, start=1):
        own = kinds == kind
        around = own[:-2, 1:-1] | own[2:, 1:-1] | own[1:-1, :-2] | own[1:-1, 2:]
        pixels[around & ~own[1:-1, 1:-1]] = INK[name]
    return Image.fromarray(pixels)


def _classes(
    picture: Picture, table: bytes, windows: Sequence[Window]
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """The class of each pixel in the windows, 0 outside."""
    data = picture.pixels.astype(np.int32)
    cells = (data[..., 0] >> 4) << 12 | (data[..., 1] >> 2) << 6 | data[..., 2] >> 2
    covered = np.zeros(cells.shape, bool)
    for window in windows:
        covered[window.top : window.top + window.height, window.left : window.left + window.width] = True
    kinds = np.frombuffer(table, np.uint8)[cells]
    return np.where(covered, kinds, np.uint8(0))


def _draw_windows(brush: ImageDraw.ImageDraw, notes: Notes) -> None:
    for window in notes.windows:
        if window.slot < 0:
            colour = SEARCHED
        else:
            colour = LOST if notes.pairs[window.slot] is None else FOUND
        brush.rectangle(_window_box(window), outline=colour)


def _window_box(window: Window) -> Box:
    left, top = SCALE * window.left, SCALE * window.top
    return Box(left, top, left + SCALE * window.width - 1, top + SCALE * window.height - 1)


def _draw_arrows(image: Image.Image, tracker: Tracker, pairs: Sequence[Pair | None]) -> None:
    """Arrows with smooth edges: each is drawn four times as large, then made smaller."""
    for pair in pairs:
        ends = None if pair is None else _arrow(tracker, pair)
        if ends is None:
            continue
        left, top = (int(min(end[axis] for end in ends)) - 4 for axis in (0, 1))
        right, bottom = (int(max(end[axis] for end in ends)) + 5 for axis in (0, 1))
        layer = Image.new("RGBA", (4 * (right - left), 4 * (bottom - top)))
        brush = ImageDraw.Draw(layer)
        tail, tip, first, other = [(4.0 * (x - left), 4.0 * (y - top)) for x, y in ends]
        for colour, width in (((0, 0, 0, 200), 14), ((255, 255, 255, 255), 6)):
            brush.line([tail, tip], fill=colour, width=width)
            brush.line([first, tip, other], fill=colour, width=width, joint="curve")
        layer = layer.reduce(4)
        image.paste(layer, (left, top), layer)


def _arrow(tracker: Tracker, pair: Pair) -> tuple[Point, Point, Point, Point] | None:
    """Tail, tip and both ends of the head in the enlarged picture; None where the lens cannot project them."""
    sighting = pair.sighting
    sine, cosine = sincos(sighting.theta_rad)
    ends = ((0.0, 0.0), (ARROW_M, 0.0), (ARROW_M - HEAD_M, 0.6 * HEAD_M), (ARROW_M - HEAD_M, -0.6 * HEAD_M))
    try:
        tail, tip, left, right = (
            _point(
                tracker,
                sighting.x_m + ahead * cosine - aside * sine,
                sighting.y_m + ahead * sine + aside * cosine,
            )
            for ahead, aside in ends
        )
    except ValueError:
        return None
    return tail, tip, left, right


def _point(tracker: Tracker, x_m: float, y_m: float) -> Point:
    u, v = tracker.top.lens.pixel(x_m, y_m, tracker.top.z_m)
    return SCALE * u, SCALE * v


def _cross(brush: ImageDraw.ImageDraw, u: float, v: float) -> None:
    x, y = int(SCALE * u), int(SCALE * v)
    for colour, reach, width in ((BLACK, 4, 3), (WHITE, 3, 1)):
        brush.line([(x - reach, y), (x + reach, y)], fill=colour, width=width)
        brush.line([(x, y - reach), (x, y + reach)], fill=colour, width=width)


def _labels(tracker: Tracker, notes: Notes) -> list[_Label]:
    labels = []
    for slot, (robot, pair) in enumerate(zip(tracker.robots, notes.pairs, strict=True)):
        if pair is not None:
            middle = 0.5 * SCALE * (pair.u + pair.identity_u), 0.5 * SCALE * (pair.v + pair.identity_v)
            arrow = _arrow(tracker, pair)
            tip = None if arrow is None else arrow[1]
            labels.append(_Label(f"{robot}", f"{pair.sighting.confidence:.2f}", middle, ASIDE_PX, tip, WHITE))
            continue
        windows = [window for window in notes.windows if window.slot == slot]
        if windows:
            box = _window_box(windows[-1])
            middle = 0.5 * (box.left + box.right), 0.5 * (box.top + box.bottom)
            labels.append(_Label(f"{robot}", "lost", middle, 0.5 * (box.right - box.left) + 6.0, None, LOST))
    return labels


def _draw_labels(brush: ImageDraw.ImageDraw, labels: Sequence[_Label], team: str, sheet: Box) -> None:
    """Each beside its robot, where it covers least of robots, arrows and other labels."""
    bold, font = load_default(17), load_default(14)
    others = [_around(label.at, ROBOT_PX) for label in labels]
    others += [_around(label.tip, 9.0) for label in labels if label.tip is not None]
    for label in labels:
        first = brush.textlength(label.number, bold) + 7.0
        width, height = first + brush.textlength(label.text, font), 14.0
        places = _places(label, width, height)
        costs = [_cost(place, others, sheet) for place in places]
        box = places[costs.index(min(costs))]
        others.append(box)
        words = ((0.0, label.number, INK[team], bold), (first, label.text, label.colour, font))
        for x, text, colour, its_font in words:
            corner = (box.left + x, box.bottom)
            brush.text(corner, text, colour, its_font, anchor="ls", stroke_width=2, stroke_fill=BLACK)


def _around(middle: Point, reach: float) -> Box:
    return Box(middle[0] - reach, middle[1] - reach, middle[0] + reach, middle[1] + reach)


def _places(label: _Label, width: float, height: float) -> list[Box]:
    """Candidate places of a label: above, below, at the sides, at the corners."""
    (x, y), away = label.at, label.away
    left, right, middle = x - away - width, x + away, x - 0.5 * width
    up, down, level = y - away - height, y + away, y - 0.5 * height
    corners = [
        *((middle, up), (middle, down), (right, level), (left, level)),
        *((right, up), (left, up), (right, down), (left, down)),
    ]
    return [Box(x, y, x + width, y + height) for x, y in corners]


def _cost(place: Box, others: Sequence[Box], sheet: Box) -> float:
    covered = 0.0
    for other in others:
        covered += place.shared(other)
    outside = (place.right - place.left) * (place.bottom - place.top) - place.shared(sheet)
    return covered + 10.0 * outside


def _with_strip(image: Image.Image, caption: str, lost: Sequence[int]) -> Image.Image:
    """The picture with a line of text below it."""
    whole = ImageOps.expand(image, (0, 0, 0, STRIP_PX), (24, 24, 24))
    brush, font, y = ImageDraw.Draw(whole), load_default(14), image.height + 3
    brush.text((8, y), caption, (225, 225, 225), font)
    if lost:
        text = f"lost: {', '.join(map(str, lost))}"
        brush.text((image.width - 8 - brush.textlength(text, font), y), text, LOST, font)
    return whole
