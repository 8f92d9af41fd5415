"""The grabber: pictures reach the PC whole frames late, some not at all, some twice."""

from __future__ import annotations

from typing import Protocol

from miro_exact.state import TICK, Rows
from miro_host.eye.track import Sighting


class Pixels(Protocol):
    """A picture as the tracker gets it, out of the grabber's memory. `width`, `height` in pixels."""

    width: int
    height: int

    def window(self, left: int, top: int, width: int, height: int) -> bytearray:
        """The pixels of a window that lies inside the picture: rows from the top, three bytes a pixel.

        Y, Cb, Cr of ITU-R BT.601 in full range (JFIF): Y 0 to 255, Cb and Cr 128 where there is no colour.
        """
        ...


Sightings = tuple[Sighting | None, ...]
_NUMBER = ("d", -1e6, 1e6)


def _split(sighting: Sighting | None) -> tuple[bool, float, float, float, int, float]:
    if sighting is None:
        return (False, 0.0, 0.0, 0.0, 0, 0.0)
    return (True, sighting.x_m, sighting.y_m, sighting.theta_rad, sighting.tick, sighting.confidence)


class Grabber:
    """Frames under way of one camera that follows `robots` robots, `delay_frames` of them."""

    STATE = {
        "under_way": Rows(
            *(1 << 10, "?", _NUMBER, _NUMBER, _NUMBER, TICK, _NUMBER),
            split=_split,
            make=lambda cells: Sighting(*cells[1:]) if cells[0] else None,
        )
    }
    NOT_STATE = ("robots", "delay_frames")

    def __init__(self, robots: int, delay_frames: int = 1) -> None:
        self.robots = robots
        self.delay_frames = delay_frames
        self.under_way: list[Sighting | None] = [None] * (robots * (delay_frames + 1))

    def __repr__(self) -> str:
        return f"Grabber(robots={self.robots}, delay_frames={self.delay_frames}, {self.under_way!r})"

    def take(self, frame: Sightings | None) -> Sightings:
        """Takes the sightings in a new frame and returns those that arrive now; None: the previous frame is repeated.

        The first `delay_frames` answers are frames in which no robot was found.
        """
        under_way = self.under_way
        under_way += under_way[len(under_way) - self.robots :] if frame is None else frame
        del under_way[: self.robots]
        return tuple(under_way[: self.robots])

    def after_load(self) -> None:
        """Raises ValueError unless as many frames are under way as the delay requires."""
        if len(self.under_way) != self.robots * (self.delay_frames + 1):
            raise ValueError(f"{len(self.under_way)} sightings are under way of {self.robots} robots")
