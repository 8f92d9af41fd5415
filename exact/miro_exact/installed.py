"""Plug-ins that other distributions register by entry points, and the hashes of their sources.

A run depends on the sources of its plug-ins. A version does not identify them, because a distribution may be installed
editable. The sources are the modules and packages of the distribution, with compiled modules and data inside, without
imports from other distributions.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache, lru_cache
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import Distribution, EntryPoint

PREFIX = "mirotwin."
"""Begins the names of all groups of entry points."""
DIGITS = 12
"""Of a hash of sources."""
in_files: dict[tuple[str, str], str] = {}
"""(kind, name) of a plug-in brought by the command line in a file -> description of its sources."""


def entries_of(group: str, name: str | None = None) -> list[EntryPoint]:
    """The entry points of a group, all or those with this name."""
    entries = _registered(group, tuple((path, _changed_ns(path)) for path in sys.path))
    return [entry for entry in entries if name in (None, entry.name)]


def _changed_ns(path: str) -> int:
    try:
        return os.stat(path or ".").st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=32)
def _registered(group: str, paths: tuple[tuple[str, int], ...]) -> tuple[EntryPoint, ...]:
    if not any(_may_register(path) for path, _ in paths):
        return ()
    from importlib.metadata import entry_points  # takes 30 ms to import, more than the look at the folders

    return tuple(entry_points(group=group))


def _may_register(path: str) -> bool:
    """True if a distribution at this path may have entry points for us.

    A path that is no folder, such as a zip file, may.
    """
    try:
        with os.scandir(path or ".") as children:
            folders = [
                child.path for child in children if child.name.lower().endswith((".dist-info", "egg-info"))
            ]
    except NotADirectoryError:
        return True
    except OSError:
        return False
    return any(_mentions_us(os.path.join(folder, "entry_points.txt")) for folder in folders)


def _mentions_us(path: str) -> bool:
    try:
        with open(path, "rb") as file:
            return f"[{PREFIX}".encode() in file.read()
    except OSError:
        return False


def owner(entry: EntryPoint) -> str:
    """Name and version of the distribution that registers it."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist is not None else "an unknown distribution"


def place(entry: EntryPoint) -> str:
    """Name and version of the distribution, and the registered object."""
    return f"{owner(entry)} ({entry.value})"


def described(kind: str, name: str) -> str:
    """A plug-in (`kind`: law, estimator, reference, check, part) with version and hash of its present sources.

    `law samson: samson-law 1.0, sources 0123456789ab`; "" for our own, which no distribution registers.
    """
    if (kind, name) in in_files:
        return f"{kind} {name}: {in_files[kind, name]}"
    entries = entries_of(f"{PREFIX}{kind}s", name)
    made = (f"{owner(entry)}, sources {sources_hash(entry)}" for entry in entries)
    return f"{kind} {name}: {' and '.join(made)}" if entries else ""


_described_once = cache(described)


def described_once(kind: str, name: str) -> str:
    """Like `described`, with the sources as this process first read them: later edits do not count."""
    return described(kind, name) if (kind, name) in in_files else _described_once(kind, name)


def differences(
    recorded: Iterable[str], describe: Callable[[str, str], str] = described_once
) -> Iterator[str]:
    """A line for each of these plug-ins, as `described`, that is another one here."""
    for text in recorded:
        plugin, _, then = text.partition(": ")
        kind, _, name = plugin.partition(" ")
        now = describe(kind, name).partition(": ")[2]
        if now != then:
            yield f"{plugin} is {now or 'not installed'} instead of {then}"


def sources_hash(entry: EntryPoint) -> str:
    """Hash over the names and the contents of all its files; the same wherever they are installed."""
    digest = hashlib.sha256(entry.value.encode())
    for name, path in sorted(_sources(entry).items()):
        digest.update(f"\0{name}\0".encode("utf-8", "surrogateescape"))
        with suppress(OSError), path.open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()[:DIGITS]


def _sources(entry: EntryPoint) -> dict[str, Path]:
    """Path below the folder of a top-level module or package -> file."""
    files: dict[str, Path] = {}
    with suppress(AttributeError, ValueError):  # of an entry point that names no module
        files |= _files_of_module(entry.module)
    if entry.dist is not None:
        for module in sorted(_top_level(entry.dist)):
            files |= _files_of_module(module)
        for folder in _editable_folders(entry.dist):
            for path in sorted(folder.iterdir()):
                if _module(path.name, path.joinpath("__init__.py").is_file()):
                    files |= _files(path.name, path)
    return files


def _files_of_module(module: str) -> dict[str, Path]:
    """Of the outermost package of a module that is no namespace, which others share; imports none but these."""
    parts = module.split(".")
    for count in range(1, len(parts) + 1):
        try:
            spec = find_spec(".".join(parts[:count]))
        except (ImportError, ValueError):  # a module without a spec, as __main__ is
            return {}
        if spec is not None and spec.origin is not None and spec.has_location:
            origin = Path(spec.origin)
            path = origin if spec.submodule_search_locations is None else origin.parent
            return _files("/".join([*parts[: count - 1], path.name]), path)
    return {}


def _files(name: str, path: Path) -> dict[str, Path]:
    """The file, or all files in the folder without those of Python and editors."""
    if path.is_file():
        return {name: path}
    listed = {}
    for folder, folders, files in os.walk(path):
        folders[:] = [entry for entry in folders if entry != "__pycache__" and not entry.startswith(".")]
        for file in (Path(folder, entry) for entry in files if not entry.startswith(".")):
            if file.is_file() and not file.name.endswith((".pyc", "~")):
                listed[f"{name}/{file.relative_to(path).as_posix()}"] = file
    return listed


def _top_level(dist: Distribution) -> set[str]:
    """The modules and packages of a distribution, if it lists them."""
    if stated := dist.read_text("top_level.txt"):
        return set(stated.split())
    paths = [path for path in dist.files or () if ".." not in path.parts]
    return {_module(path.parts[0], len(path.parts) > 1) for path in paths} - {""}


def _editable_folders(dist: Distribution) -> Iterator[Path]:
    """Source folders of an editable distribution that does not list its modules."""
    if dist.read_text("top_level.txt"):
        return
    for path in dist.files or ():
        if path.suffix == ".pth" and len(path.parts) == 1:
            with suppress(OSError):
                lines = Path(str(path.locate())).read_text("utf-8", "surrogateescape").splitlines()
                yield from (Path(line) for line in lines if os.path.isabs(line) and os.path.isdir(line))


def _module(name: str, package: bool) -> str:
    """The module name of a file or package; "" for neither."""
    stem = name.partition(".")[0]
    is_module = name == stem if package else name.endswith((".py", *EXTENSION_SUFFIXES))
    return stem if is_module and stem.isidentifier() and not stem.startswith("__") else ""
