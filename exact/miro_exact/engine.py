"""Which twin of a hot module runs: the compiled one, or the source it was compiled from.

A hot module is an `x.py` with an `x.pxd` beside it. Both twins give the same bits; this file decides which of
them an import gets, keeps the two from being mixed, and refuses a compiled module whose source has changed since.
Nothing about frames, chips or physics belongs here; it lives in the lowest package because all the others need it.
"""

from __future__ import annotations

import hashlib
import importlib.util
import re
import sys
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.abc import MetaPathFinder
from importlib.machinery import EXTENSION_SUFFIXES, ModuleSpec, SourceFileLoader
from pathlib import Path
from types import ModuleType

from miro_exact.bad_input import BadInput

PACKAGES = ("miro_exact", "miro_protocol", "miro_robot", "miro_host", "miro_sim")
ENGINES = ("compiled", "python")
DISPATCH_MARK = b"mirotwin: dispatch replicated"
"""Bytes that the build leaves in a compiled module whose interpreter loop it could reshape (`setup.py`, `threaded`)."""
_CIMPORT = re.compile(r"^from (\S+) cimport ([^#\n]+)", re.MULTILINE)
REMEDY = "reinstall with `pip install -e .` (or `pip install .`), or run with `--engine python`"


class EngineError(BadInput, ImportError):  # type: ignore[misc]  # both have a `path`, which here is ""
    """A compiled module that does not belong to its source, or an engine that is not there."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__("", "", what, remedy)


def hot_sources(package_dirs: dict[str, Path]) -> dict[str, Path]:
    """Dotted name -> source file of every hot module below the given package folders."""
    found = {}
    for package, folder in package_dirs.items():
        for pxd in sorted(folder.rglob("*.pxd")):
            source = pxd.with_suffix(".py")
            if source.exists():
                relative = source.relative_to(folder).with_suffix("")
                found[".".join((package, *relative.parts))] = source
    return found


def source_hashes(package_dirs: dict[str, Path]) -> dict[str, str]:
    """Dotted name -> SHA-256 over the module's source, its `.pxd` and every `.pxd` that this one builds upon.

    These files fix the C layout that a compiled module relies on.
    """
    sources = hot_sources(package_dirs)
    texts = {name: _text(source.with_suffix(".pxd")) for name, source in sources.items()}
    hashes = {}
    for name, source in sources.items():
        found = hashlib.sha256()
        for used in sorted(_layout(name, texts)):
            found.update(f"{used}\n".encode() + texts[used])
        hashes[name] = hashlib.sha256(found.digest() + _text(source)).hexdigest()
    return hashes


def _layout(name: str, texts: dict[str, bytes]) -> set[str]:
    """The hot modules whose `.pxd` is part of this one's, itself among them."""
    layout: set[str] = set()
    waiting = [name]
    while waiting:
        used = waiting.pop()
        if used in layout:
            continue
        layout.add(used)
        for package, names in _CIMPORT.findall(texts[used].decode()):
            modules = [package, *(f"{package}.{part.strip()}" for part in names.split(","))]
            waiting += [module for module in modules if module in texts]
    return layout


def _text(path: Path) -> bytes:
    return path.read_bytes().replace(b"\r\n", b"\n")


@cache
def installed_dirs() -> dict[str, Path]:
    """Package name -> folder, for those of our packages that are installed."""
    dirs = {}
    for package in PACKAGES:
        spec = importlib.util.find_spec(package)
        if spec is not None and spec.submodule_search_locations:
            dirs[package] = Path(next(iter(spec.submodule_search_locations)))
    return dirs


@cache
def _installed_hashes() -> dict[str, str]:
    return source_hashes(installed_dirs())


def refuse_if_stale(name: str, stamp: str) -> None:
    """Called by every compiled module at import with the hash it was built from."""
    expected = _installed_hashes().get(name)
    if expected != stamp:
        raise EngineError(f"compiled {name} is stale: its source has changed since it was built", REMEDY)


def compiled_file(source: Path) -> Path | None:
    """The extension module that stands for this source, if one was built."""
    for suffix in EXTENSION_SUFFIXES:
        candidate = source.with_name(source.stem + suffix)
        if candidate.exists():
            return candidate
    return None


def dispatch_replicated(modules: Iterable[Path]) -> bool:
    """Whether one of these compiled modules has an interpreter loop with the dispatch at the end of each arm."""
    return any(DISPATCH_MARK in module.read_bytes() for module in modules)


class EngineFinder(MetaPathFinder):
    """First on `sys.meta_path`: sends hot modules to their source when the engine is `python`."""

    def __init__(self) -> None:
        self.engine: str | None = None
        self.sources = hot_sources(installed_dirs())

    def missing(self) -> list[str]:
        """Hot modules that have no compiled twin."""
        return [name for name, source in self.sources.items() if compiled_file(source) is None]

    def compiled(self) -> list[Path]:
        """The compiled twins that are there."""
        return [file for file in map(compiled_file, self.sources.values()) if file is not None]

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        source = self.sources.get(fullname)
        if source is None:
            return None
        if self.engine is None:
            self.engine = "python" if self.missing() else "compiled"
        if self.engine == "compiled":
            return None
        return importlib.util.spec_from_file_location(
            fullname, source, loader=SourceFileLoader(fullname, str(source))
        )


def install() -> EngineFinder:
    """Puts the finder in place once; later calls return the one that is there."""
    for finder in sys.meta_path:
        if isinstance(finder, EngineFinder):
            return finder
    finder = EngineFinder()
    sys.meta_path.insert(0, finder)
    return finder


def select(engine: str) -> None:
    """Chooses the engine of this process. Must come before the first hot module is imported.

    Raises EngineError when another engine is already in use, or when `compiled` is asked for and a hot module
    has no compiled twin.
    """
    if engine not in ENGINES:
        raise EngineError(f"unknown engine {engine!r}", f"choose one of {', '.join(ENGINES)}")
    finder = install()
    if finder.engine not in (None, engine):
        what = f"engine {finder.engine} is already in use in this process, cannot change to {engine}"
        raise EngineError(what, "select the engine before anything else is imported")
    if engine == "compiled" and finder.missing():
        raise EngineError(f"no compiled module for {', '.join(finder.missing())}", REMEDY)
    finder.engine = engine


def active() -> str:
    """`compiled` or `python`: what hot modules run as (deciding it now if nothing has yet)."""
    finder = install()
    if finder.engine is None:
        finder.engine = "python" if finder.missing() else "compiled"
    return finder.engine
