"""Selects the engine: a hot module runs compiled, or as the source it was compiled from.

A hot module is an `x.py` with an `x.pxd` beside it (`hot_modules`). Both forms give the same bits. This file decides
which form an import gets, prevents mixing, and refuses a compiled module whose source has changed. An `x.pyx` has no
Python form: only the compiled engine uses it.

Every process that imports one of our packages loads this file, even `mirotwin --help`, so it imports little, and
examines a module only when that is imported.
"""

from __future__ import annotations

import os
import struct
import sys
from collections.abc import Sequence
from functools import cache, cached_property
from importlib.machinery import ModuleSpec, SourceFileLoader
from typing import TYPE_CHECKING

from miro_exact.bad_input import BadInput

if TYPE_CHECKING:
    from pathlib import Path
    from types import ModuleType

PACKAGES = ("miro_exact", "miro_protocol", "miro_robot", "miro_host", "miro_sim", "mirotwin")
MAY_BE_SOURCE = "mirotwin"
"""In a checkout, Python finds the source of this package before the installed one; no other builds upon its layouts."""
ENGINES = ("compiled", "python")
REMEDY = "reinstall with `pip install -e .` (or `pip install .`), or run with `--engine python`"


class EngineError(BadInput, ImportError):  # type: ignore[misc]  # both have a `path`, which here is ""
    """A compiled module that does not belong to its source, or an engine that is not there."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__("", "", reason, remedy)


# Sums of names: the compiler of the source would add literals. The subnormal is made from its bits, without arithmetic.
_ONE, _BIG, _ODD = 1.0, 1e16, 2.9999
_UNSEEN = 8.673617379884035e-19  # 2**-60: to nearest, 1 + this is 1
_NEARLY = 1.6653345369377348e-16  # three quarters of the last place of 1: to nearest, 1 + this is the number after 1
_FOUR, _QUARTER, _SMALLEST = 4.0, 0.25, sys.float_info.min
(_SUBNORMAL,) = struct.unpack("<d", bytes((0, 0, 0, 0, 0, 0, 8, 0)))  # half of the smallest normal number
_ZERO = bytes(8)  # a comparison may take a subnormal for zero, which is another thing


def check_arithmetic() -> None:
    """Raises EngineError, with the difference, if sums and products of doubles have other bits here than elsewhere.

    It checks the present state of the calling thread: a library may change rounding, or flush to zero, when it is
    loaded.
    """
    mode = (
        "up" if _ONE + _UNSEEN != _ONE
        else "down" if -_ONE - _UNSEEN != -_ONE
        else "towards zero" if _ONE + _NEARLY == _ONE
        else ""
    )  # fmt: skip
    subnormal = {"results (FTZ)": _SMALLEST * _QUARTER, "operands (DAZ)": _SUBNORMAL * _FOUR}
    flushed = [name for name, value in subnormal.items() if struct.pack("<d", value) == _ZERO]
    if mode:
        reason = f"the processor rounds {mode} and not to nearest"
        remedy = "something in this process, a plug-in or a library, called fesetround: let it set FE_TONEAREST again"
    elif flushed:
        reason = f"the processor takes subnormal {' and '.join(flushed)} for zero"
        remedy = (
            "something in this process, a plug-in or a library in LD_PRELOAD, was linked with -ffast-math:"
            " build it without, or leave it out"
        )
    elif _BIG + _ODD != 10000000000000002.0:
        reason = "this Python rounds sums of doubles twice (x87 arithmetic)"
        remedy = "use a 64-bit Python, or one that was built with -msse2 -mfpmath=sse"
    else:
        return
    raise EngineError(f"{reason}, so that runs would have other bits", remedy)


@cache
def installed_dirs() -> dict[str, Path]:
    """Package name -> folder, for those of our packages that are installed."""
    from importlib.util import find_spec
    from pathlib import Path

    dirs = {}
    for package in PACKAGES:
        spec = find_spec(package)
        if spec is not None and spec.submodule_search_locations:
            dirs[package] = Path(next(iter(spec.submodule_search_locations)))
    return dirs


@cache
def _installed_sources() -> dict[str, Path]:
    from miro_exact.hot_modules import hot_sources

    return hot_sources(installed_dirs())


@cache
def _installed_hashes() -> dict[str, str]:
    from miro_exact.hot_modules import source_hashes

    return source_hashes(installed_dirs(), _installed_sources())


def refuse_if_stale(name: str, stamp: str) -> None:
    """Called by every compiled module at import with the hash it was built from."""
    expected = _installed_hashes().get(name)
    if expected != stamp:
        raise EngineError(f"compiled {name} is stale: its source has changed since it was built", REMEDY)


class EngineFinder:
    """First on `sys.meta_path`: sends hot modules to their source when the engine is `python`."""

    def __init__(self) -> None:
        self.engine: str | None = None

    @cached_property
    def sources(self) -> dict[str, Path]:
        """Dotted name -> source file of every installed hot module, and of the files they share."""
        from miro_exact.hot_modules import SHARED

        package, _, name = SHARED.partition(".")
        return {SHARED: installed_dirs()[package] / name, **_installed_sources()}

    def missing(self) -> list[str]:
        """Hot modules without a compiled twin, other than those of `MAY_BE_SOURCE`."""
        from miro_exact.hot_modules import compiled_file

        needed = [name for name in self.sources if name.partition(".")[0] != MAY_BE_SOURCE]
        return [name for name in needed if compiled_file(self.sources[name]) is None]

    def compiled(self) -> list[Path]:
        """The compiled twins that are there."""
        from miro_exact.hot_modules import compiled_file

        return [file for file in map(compiled_file, self.sources.values()) if file is not None]

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """A spec for the source of a hot module when the engine is `python`, else None: others find it."""
        if self.engine == "compiled":
            return None
        package, _, stem = fullname.rpartition(".")
        if path is None or package.partition(".")[0] not in PACKAGES:
            return None
        source = next((place for folder in path if (place := _hot_source(folder, stem))), None)
        if source is None:
            return None
        if self.engine is None:
            check_arithmetic()
            self.engine = "python" if self.missing() else "compiled"
            if self.engine == "compiled":
                return None
        from importlib.util import spec_from_file_location

        return spec_from_file_location(fullname, source, loader=SourceFileLoader(fullname, source))


def _hot_source(folder: str, stem: str) -> str | None:
    """The source of the hot module `stem` in a package's folder, None if there is no such hot module."""
    source = os.path.join(folder, f"{stem}.py")
    return source if os.path.exists(source[:-3] + ".pxd") and os.path.exists(source) else None


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

    Raises EngineError if another engine is already in use, or if `compiled` is requested and a hot module is not
    compiled.
    """
    if engine not in ENGINES:
        raise EngineError(f"unknown engine {engine!r}", f"choose one of {', '.join(ENGINES)}")
    check_arithmetic()
    finder = install()
    if engine == "compiled" and finder.missing():
        raise EngineError(f"no compiled module for {', '.join(finder.missing())}", REMEDY)
    if finder.engine not in (None, engine):
        reason = f"engine {finder.engine} is already in use in this process, cannot change to {engine}"
        raise EngineError(reason, "select the engine before anything else is imported")
    finder.engine = engine


def active() -> str:
    """The engine of hot modules, `compiled` or `python`; it is decided now if it was not before."""
    finder = install()
    if finder.engine is None:
        finder.engine = "python" if finder.missing() else "compiled"
    return finder.engine
