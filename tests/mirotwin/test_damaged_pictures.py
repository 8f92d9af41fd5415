"""A picture that the camera cannot have made is refused in a line, whatever the library behind says about it."""

import struct
import warnings
import zlib
from contextlib import suppress

import pytest
from PIL import Image

from miro_exact.bad_input import BadInput
from mirotwin.camera.picture import parse, png

WHOLE = png(Image.new("RGB", (320, 240), (30, 60, 90)))
BEHIND_HEAD, BEFORE_END = 33, len(WHOLE) - 12
KINDS = (
    b"tRNS",
    b"gAMA",
    b"cHRM",
    b"sRGB",
    b"pHYs",
    b"iCCP",
    b"tEXt",
    b"zTXt",
    b"iTXt",
    b"eXIf",
    b"acTL",
    b"fcTL",
    b"fdAT",
)


def with_chunk(kind, data, at):
    """The picture with a chunk more, whose sum is right."""
    body = kind + data
    chunk = struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))
    return WHOLE[:at] + chunk + WHOLE[at:]


@pytest.mark.parametrize("at", [BEHIND_HEAD, BEFORE_END])
@pytest.mark.parametrize("kind", KINDS)
def test_a_chunk_of_any_kind_and_size_is_passed_over_or_refused_without_a_warning(kind, at):
    for size in range(0, 30, 3):
        for data in (bytes(size), b"\xff" * size, b"a\0\0" + zlib.compress(bytes(size))):
            with warnings.catch_warnings(), suppress(BadInput):
                warnings.simplefilter("error")
                assert parse(with_chunk(kind, data, at), "x.png").width == 320


def test_a_colour_profile_of_nothing_is_damage():
    with pytest.raises(BadInput, match=r"x\.png: is damaged: .*; write the picture again"):
        parse(with_chunk(b"iCCP", b"", BEFORE_END), "x.png")
