"""Writing given files into a folder of the user's, all or none."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from miro_exact.bad_input import BadInput

_LEFT_BEHIND = {"build", "runs", "__pycache__", ".pytest_cache", ".venv"}


def all_files(folder: Path) -> Iterator[Path]:
    """Regular files, but for what tools leave behind."""
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        left_behind = any(part in _LEFT_BEHIND or part.endswith(".egg-info") for part in parts)
        if path.is_file() and not left_behind:
            yield path


def write(target: Path, wanted: Iterable[tuple[str, Path]], remedy: str, force: bool = False) -> list[str]:
    """Writes (name, file) into `target`, which is made, and returns the names.

    Raises BadInput with `remedy`, before anything is written, if a file of that name has other content: not if
    `force`, unless it is no regular file. A file with the same content stays.
    """
    files = [(name, path.read_bytes()) for name, path in wanted]
    if target.exists() and not target.is_dir():
        raise BadInput(target, "", "is no folder", "name one that is new or empty")
    present = [name for name, content in files if _is_in_the_way(target / name, content, force)]
    if present:
        some = ", ".join(present[:3]) + (", .." if len(present) > 3 else "")
        raise BadInput(target, "", f"holds {some} already", remedy)
    for name, content in files:
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return [name for name, _ in files]


def _is_in_the_way(path: Path, content: bytes, force: bool) -> bool:
    if not path.exists() and not path.is_symlink():
        return False
    if path.is_symlink() or not path.is_file():
        return True
    return not force and path.read_bytes() != content
