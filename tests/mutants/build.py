"""Firmware with changed sources, built by its own Makefile; each distinct source is built once.

The Makefile compiles only what a change concerns: the objects of the shipped sources are put beside the changed ones,
with times that say that they are older. The folder is `build/mutants`, which git ignores; an image is found there again
by the hash of all that it was built from. Processes may build at the same time.
"""

import hashlib
import os
import re
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests import children
from tests.mutants.draw import SOURCE, source_files

CACHE = Path(__file__).parents[2] / "build" / "mutants"
IMAGE = "miro.ihx"
ERROR = "error.txt"
_OTHERS = ("Makefile", "sdcc.version")
_OBJECTS = ("*.rel", "*.lst", "*.adb")
_LONG_AGO = 1_000_000_000


class Built(NamedTuple):
    """`folder` holds `miro.ihx`, `.map`, `.cdb` and `.rst`, unless `error` says why there is none."""

    folder: Path
    error: str = ""

    @property
    def image(self):
        return self.folder / IMAGE

    @property
    def is_shipped(self):
        """Whether the image has the bytes of the shipped sources' one."""
        return not self.error and self.image.read_bytes() == shipped().image.read_bytes()


def compiler():
    """What SDCC says of itself; empty where it or make is absent, or of another version than the firmware's."""
    if shutil.which("sdcc") is None or shutil.which("make") is None:
        return ""
    said = children.run(["sdcc", "--version"], capture_output=True, text=True, check=True).stdout
    return said if (SOURCE / "sdcc.version").read_text("utf-8").strip() in said else ""


@cache
def shipped():
    """The sources as they are."""
    return build({})


def build(changed, cache_folder=CACHE):
    """The firmware in which these files (by name) have these texts."""
    sources = source_files()
    if unknown := sorted(set(changed) - set(sources)):
        raise ValueError(f"the firmware has no file {unknown[0]}")
    others = {name: (SOURCE / name).read_text("utf-8") for name in _OTHERS}
    place = cache_folder / _key(others | sources | dict(changed))
    if not place.exists():
        objects = cache_folder / f"objects-{_key(others | sources)}"
        if not objects.exists():
            _make({}, None, objects, objects)
        _make(changed, objects, place)
    error = place / ERROR
    return Built(place, error.read_text("utf-8") if error.exists() else "")


def _key(texts):
    whole = hashlib.sha256(_version().encode())
    for name, text in sorted(texts.items()):
        whole.update(f"{name} {len(text)}\n{text}".encode())
    return whole.hexdigest()[:32]


@cache
def _version():
    said = compiler()
    if not said:
        raise RuntimeError(
            "building firmware needs make and SDCC of the version in robot_fw/firmware/sdcc.version"
        )
    return said


def _make(changed, objects, place, keep_objects=None):
    """Runs make in a temporary folder; leaves its result at `place`, whole or not at all."""
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=place.parent, prefix="making-") as name:
        work = Path(name)
        source, made, out = work / "firmware", work / "made", work / "out"
        shutil.copytree(SOURCE, source)
        made.mkdir()
        for path in (path for form in _OBJECTS if objects for path in objects.glob(form)):
            shutil.copy(path, made)
        _set_times(source, 0)
        _set_times(made, 1)
        for file, text in changed.items():
            (source / file).write_text(text, "utf-8")
        make = ["make", "-s", "-C", str(source), f"OUT={out}", f"BUILD={made}"]
        done = children.run(make, capture_output=True, text=True)
        if done.returncode:
            out.mkdir(exist_ok=True)
            (out / ERROR).write_text(_first_error(done.stderr), "utf-8")
            if not changed:
                raise RuntimeError(f"the firmware does not build: {_first_error(done.stderr)}")
        _move(made if keep_objects else out, place)


def _set_times(folder, later):
    for path in folder.iterdir():
        os.utime(path, (_LONG_AGO + later, _LONG_AGO + later))


def _move(made, place):
    """Another process may have been faster: then its result stays."""
    try:
        made.rename(place)
    except OSError:
        if not place.exists():
            raise


def _first_error(said):
    """The first error line of the compiler, without the folder in which it was called."""
    lines = [line.strip() for line in said.splitlines() if re.search(r"error", line)] or ["make failed"]
    return re.sub(r"\S*/", "", lines[0])
