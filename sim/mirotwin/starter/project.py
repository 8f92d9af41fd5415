"""The files of the sample project, and writing them into a folder.

What belongs here: where they come from. What does not: their contents (`examples/hil`, and the firmware's own folder);
`setup.py` puts both into a wheel.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from miro_exact.bad_input import BadInput
from miro_robot.firmware import source_folder

_IN_WHEEL = Path(__file__).parent / "files"
_IN_TREE = Path(__file__).parents[3] / "examples" / "hil"
FIRMWARE = "firmware"
OF_FIRMWARE = "tests/test_firmware.py"
"""What only this firmware passes, because it names a function of it."""


def files(firmware: bool = True) -> Iterator[tuple[str, Path]]:
    """(name in the project, file) of all, in the order of names; with the C sources if `firmware`."""
    folder = _IN_WHEEL if _IN_WHEEL.is_dir() else _IN_TREE
    sources = source_folder()
    if sources is None or not folder.is_dir():
        what = "the sample project is not part of this installation"
        raise BadInput("", "mirotwin init", what, "install mirotwin from a wheel or a checkout")
    found = [(path.relative_to(folder).as_posix(), path) for path in _all(folder)]
    if not firmware:
        yield from (one for one in found if one[0] != OF_FIRMWARE)
        return
    found += [(f"{FIRMWARE}/{path.relative_to(sources).as_posix()}", path) for path in _all(sources)]
    yield from sorted(found)


def _all(folder: Path) -> Iterator[Path]:
    """Regular files, but for what tools leave behind."""
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        if path.is_file() and not {"build", "runs", "__pycache__", ".pytest_cache", ".venv"} & set(parts):
            yield path


def begin(target: Path, firmware: bool = True) -> list[str]:
    """Writes the project into `target`, which is made, and returns the names. Raises BadInput if one is there."""
    wanted = list(files(firmware))
    if target.exists() and not target.is_dir():
        raise BadInput(target, "", "is no folder", "name one that is new or empty")
    present = [name for name, _ in wanted if (target / name).exists() or (target / name).is_symlink()]
    if present:
        some = ", ".join(present[:3]) + (", .." if len(present) > 3 else "")
        raise BadInput(target, "", f"holds {some} already", "name a folder that is new or empty")
    for name, path in wanted:
        place = target / name
        place.parent.mkdir(parents=True, exist_ok=True)
        with open(place, "xb") as out:
            out.write(path.read_bytes())
    return [name for name, _ in wanted]
