"""A whole picture of the camera: its pixels as the tracker reads them, and as a file that people can open.

A picture that was saved and read again differs from the original by rounding (a level or two). Where noise made a pixel
that no red, green and blue can show, it also differs by the clipped part.
"""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from miro_exact.bad_input import BadInput
from miro_exact.inputs import PICTURE_BYTES, read_input
from miro_host.eye.camera_parameters import HEIGHT, WIDTH
from miro_host.eye.grabber import Pixels

SUFFIXES = (".png", ".ppm")
_DAMAGED = (
    OSError,
    ValueError,
    SyntaxError,
    LookupError,
    TypeError,
    ArithmeticError,
    struct.error,
    zlib.error,
)
"""Errors that Pillow raises for damaged pictures: an empty `iCCP` chunk is an IndexError."""
_ROWS = 12
"""Rows that are requested of a camera at once."""


class Picture:
    """An immutable picture. It implements `Pixels`, so a tracker can read it.

    `data`: three bytes a pixel; `pixels`: the same as rows of pixels.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) != 3 * WIDTH * HEIGHT:
            raise ValueError(f"{len(data)} bytes are not {WIDTH} x {HEIGHT} pixels of 3")
        self.width = WIDTH
        self.height = HEIGHT
        self.data = data
        self.pixels = np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 3)

    def __repr__(self) -> str:
        return f"Picture({self.width} x {self.height})"

    def window(self, left: int, top: int, width: int, height: int) -> bytearray:
        """See `Pixels`. Raises ValueError for a window that is not inside the picture."""
        if min(left, top, width - 1, height - 1) < 0 or left + width > WIDTH or top + height > HEIGHT:
            raise ValueError(f"window {width} x {height} at ({left}, {top}) is not inside {WIDTH} x {HEIGHT}")
        return bytearray(self.pixels[top : top + height, left : left + width].tobytes())

    def image(self) -> Image.Image:
        """In red, green and blue."""
        return Image.frombytes("YCbCr", (WIDTH, HEIGHT), self.data).convert("RGB")


def taken(frame: Pixels) -> Picture:
    """The whole picture, copied from `frame`, which can only be read by windows."""
    return Picture(b"".join(frame.window(0, top, WIDTH, _ROWS) for top in range(0, HEIGHT, _ROWS)))


def png(image: Image.Image) -> bytes:
    """An image as a PNG file, without a date or any other remark."""
    file = io.BytesIO()
    image.save(file, "PNG", compress_level=3)  # nearly as small as 6, in half the time
    return file.getvalue()


def read(path: Path) -> Picture:
    """The picture in a PNG or PPM file.

    Raises BadInput for a picture of another size and for a file that is no picture.
    """
    try:
        data = read_input(path, PICTURE_BYTES)
    except OSError as error:
        raise BadInput(path, "", f"cannot be read: {error.strerror}", "check path and permissions") from None
    return parse(data, f"{path}")


def parse(data: bytes, origin: str, place: str = "") -> Picture:
    """The picture in the bytes of a PNG or PPM file; `origin` and `place` name them in errors."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a size that is refused below, of what is not looked at
            image = Image.open(io.BytesIO(data), formats=("PNG", "PPM"))
            if image.size != (WIDTH, HEIGHT):
                reason = f"{image.size[0]} x {image.size[1]} pixels"
                remedy = f"give pictures of {WIDTH} x {HEIGHT} (of a run: `run --frames`)"
                raise BadInput(origin, place, reason, remedy)
            return Picture(image.convert("RGB").convert("YCbCr").tobytes())
    except UnidentifiedImageError:
        raise BadInput(origin, place, "is no PNG or PPM picture", "convert it to PNG") from None
    except Image.DecompressionBombError:
        reason = "far too many pixels"
        raise BadInput(origin, place, reason, f"give pictures of {WIDTH} x {HEIGHT}") from None
    except BadInput:
        raise
    except _DAMAGED as error:
        reason = f"is damaged: {error}"
        raise BadInput(origin, place, reason, "write the picture again") from None
