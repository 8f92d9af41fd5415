"""A picture as the tracker gets it: windows of pixels out of the grabber's memory."""

from typing import Protocol


class Pixels(Protocol):
    """One picture. `width`, `height` in pixels."""

    width: int
    height: int

    def window(self, left: int, top: int, width: int, height: int) -> bytearray:
        """The pixels of a window that lies inside the picture: rows from the top, three bytes a pixel.

        Y, Cb, Cr of ITU-R BT.601 in full range (JFIF): Y 0 to 255, Cb and Cr 128 where there is no colour.
        """
        ...
