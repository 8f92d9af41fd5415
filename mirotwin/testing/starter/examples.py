"""The examples that the pages use, and writing one of them into a folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from miro_exact.bad_input import BadInput, did_you_mean, shortened
from miro_robot.firmware import image_path
from mirotwin.testing.starter.writing import all_files

_IN_WHEEL = Path(__file__).parent / "examples"
_IN_TREE = Path(__file__).parents[3] / "examples"
EXAMPLES = {
    "firmware": "mine.ihx; late.ihx stops 15 ms late when the host falls silent.",
    "hil-steps": "Scenario files with steps: send, wait, expect, reset.",
    "campaign": "A campaign of 240 runs: radio, latency, two controllers.",
    "two_teams": "A scenario with six robots, to look at pictures.",
    "laws": "Two laws in a distribution of their own, to install.",
    "checks": "A check in a distribution of its own, to install.",
    "fuzz-slip": "An 8051 firmware that is no robot, its wire format, its check.",
    "foxglove": "A layout for Foxglove.",
    "vscode": "The extension for VS Code: debugging firmware, backwards too.",
}
"""Name, and what `mirotwin examples` says of it."""
PROJECT = "hil"
"""The folder that `mirotwin init` writes."""
_DEBUG_FILES = {"mine": (".map", ".cdb", ".rst"), "late": (".map", ".cdb")}
"""The two images differ in one byte, a constant, so names and lines are the same; .rst holds the bytes, too."""


def folder() -> Path:
    """Where the examples are. Raises BadInput in an installation without them."""
    for place in (_IN_WHEEL, _IN_TREE):
        if place.is_dir():
            return place
    what = "the examples are not part of this installation"
    raise BadInput("", "mirotwin", what, "install mirotwin from a wheel or a checkout")


def files(name: str) -> Iterator[tuple[str, Path]]:
    """(name to write, file) of an example. Raises BadInput for a name that is not one."""
    if name not in EXAMPLES:
        hint = did_you_mean(name, EXAMPLES) or f"there are {', '.join(EXAMPLES)}"
        raise BadInput("", "", f"no such example {shortened(repr(name))}", hint)
    if name == "firmware":
        yield from _images()
        return
    found = folder() / name
    if found.is_dir():
        yield from ((f"{name}/{path.relative_to(found).as_posix()}", path) for path in all_files(found))
    else:
        (path,) = folder().glob(f"{name}.*")
        yield path.name, path


def _images() -> Iterator[tuple[str, Path]]:
    own = image_path()
    yield "mine.ihx", own
    yield "late.ihx", folder() / "firmware" / "late.ihx"
    for name, suffixes in _DEBUG_FILES.items():
        yield from ((f"{name}{suffix}", own.with_suffix(suffix)) for suffix in suffixes)
