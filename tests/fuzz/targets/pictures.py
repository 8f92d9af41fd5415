"""What the tracker reads: pictures, calibrations, colours, points, samples; and the tracker on drawn patches."""

import math
import warnings
import zlib

from miro_exact.bad_input import BadInput
from miro_host.eye import eye_file
from miro_host.eye.calibration import Calibration
from miro_host.eye.calibration_kinds import exact
from miro_host.eye.camera_parameters import CameraParameters
from miro_host.eye.colours import ColourClasses, classes_of, parse_samples
from miro_host.eye.eye_file import EyeError
from miro_host.eye.fit import fit, parse_points
from miro_host.eye.patterns import PATTERNS
from miro_host.eye.tracker import Tracker
from miro_sim.pitch.colour_samples import colours_of
from miro_sim.pitch.picture_settings import PictureSettings
from mirotwin.camera.picture import Picture, parse, png
from tests.fuzz.target import Draws, Target, always, refused

_ORIGIN = "fuzz.file"
_WIDTH, _HEIGHT = 320, 240


def _with_sums(png):
    """A PNG file whose chunks have the right sums."""
    data, place = bytearray(png), 8
    while place + 12 <= len(data):
        size = int.from_bytes(data[place : place + 4], "big")
        end = place + 8 + size
        if end + 4 > len(data):
            break
        data[end : end + 4] = zlib.crc32(data[place + 4 : end]).to_bytes(4, "big")
        place = end + 4
    return bytes(data)


def _picture():
    def read(data):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                found = parse(data, _ORIGIN)
            except BadInput as error:
                return refused(error)
        assert len(found.window(0, 0, _WIDTH, _HEIGHT)) == 3 * _WIDTH * _HEIGHT
        assert isinstance(parse(png(found.image()), "again"), Picture)
        return "taken"

    def run(data):
        return f"{read(data)}; sums put right: {read(_with_sums(data))}"

    return run


def _calibration(data):
    try:
        found = eye_file.parse(data.decode("utf-8", "replace"), Calibration, _ORIGIN)
    except EyeError as error:
        return refused(error)
    assert eye_file.parse(found.text(), Calibration, "again") == found, "written and read again, it differs"
    lens, drawn = found.lens(), 0
    for u, v in ((0.0, 0.0), (160.0, 120.0), (319.0, 239.0)):
        try:
            x_m, y_m = lens.ground(u, v, found.height_m(0.05))
        except ValueError as error:
            refused(error)
            continue
        assert math.isfinite(x_m + y_m), "a place that is no number"
        drawn += 1
    return f"taken, {drawn} of 3 pixels lie on the ground"


def _colours(data):
    try:
        found = eye_file.parse(data.decode("utf-8", "replace"), ColourClasses, _ORIGIN)
    except EyeError as error:
        return refused(error)
    assert eye_file.parse(found.text(), ColourClasses, "again") == found, (
        "written and read again, they differ"
    )
    assert len(found.table) == 65536
    return f"{min(len(found.colours), 3)} colours"


def _points(data):
    try:
        found = parse_points(data.decode("utf-8", "replace"), _ORIGIN)
        fit(found, CameraParameters(), _ORIGIN)
    except EyeError as error:
        return refused(error)
    return "fits"


def _samples(data):
    try:
        found = classes_of(parse_samples(data.decode("utf-8", "replace"), _ORIGIN), _ORIGIN)
    except EyeError as error:
        return refused(error)
    assert found.text()
    return f"{min(len(found.colours), 3)} colours"


def _tracker():
    """Rectangles of the classes' colours, anywhere, also over the edge, in a few pictures one after the other."""
    classes = eye_file.parse(_colours_toml().decode(), ColourClasses, "colours")
    paints = [bytes((int(mean.y), int(mean.cb), int(mean.cr))) for mean in classes.colours.values()]
    plain = bytes((40, 128, 128)) * (_WIDTH * _HEIGHT)
    calibration = exact(CameraParameters())

    def run(data):
        draw = Draws(data)
        pattern = list(PATTERNS)[draw.below(len(PATTERNS))]
        centroid = ("binary", "weighted")[draw.below(2)]
        tracker = Tracker("yellow", (0, 1, 2), pattern, calibration, classes, centroid)
        pixels, tick, seen = bytearray(plain), 0, 0
        while True:
            kind = draw.below(16)
            if kind == 0 or not draw.left:
                tick += 800_800 * (1 + draw.below(4))
                found = tracker.track(Picture(bytes(pixels)), tick)
                assert len(found) == 3
                seen = max(seen, sum(one is not None for one in found))
                pixels = bytearray(plain)
                if not draw.left:
                    return f"{seen} robots"
            left, top, width, height = (
                draw.below(_WIDTH),
                draw.below(_HEIGHT),
                1 + draw.below(64),
                1 + draw.below(64),
            )
            paint = paints[kind % len(paints)] if kind < 12 else draw.take(3).ljust(3, b"\x80")
            width = min(width, _WIDTH - left)
            for row in range(top, min(top + height, _HEIGHT)):
                at = 3 * (row * _WIDTH + left)
                pixels[at : at + 3 * width] = paint * width

    return run


def _colours_toml():
    return colours_of(CameraParameters(), PictureSettings(), "diagonal", True).text().encode()


_PICTURE_WORDS = b"IHDR|IDAT|PLTE|tRNS|iCCP|zTXt|iTXt|acTL|fcTL|fdAT|P3 320 240 ".split(b"|")
_TOML = b"[camera]\n|[residuals]\n|[colours.|[floor]\n|version = 1| = |1e300|-0.0|inf".split(b"|")

TARGETS = {
    "picture": Target("PNG and PPM files, also with right sums", _picture, words=_PICTURE_WORDS),
    "calibration": Target("calibrations, written again, and their lens", always(_calibration), words=_TOML),
    "colours": Target("colour classes, written again, and their table", always(_colours), words=_TOML),
    "points": Target("control points, and the camera that fits them", always(_points), most_bytes=2048),
    "samples": Target("sampled pixels, and their classes", always(_samples), most_bytes=1024),
    "tracker": Target("the tracker on pictures of rectangles", _tracker, most_bytes=256),
}
