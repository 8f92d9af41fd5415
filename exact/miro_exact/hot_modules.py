"""Finds hot modules, their compiled files, and the hash that ties source and compiled file together.

A hot module is an `x.py`, or an `x.pyx`, with an `x.pxd` beside it. The choice between source and compiled file is made
in `engine`. `setup.py` loads this file by its path, before anything is installed, so it imports none of our packages.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

DISPATCH_MARK = b"mirotwin: dispatch replicated"
"""Bytes that the build puts into a compiled module whose interpreter loop it has reshaped (`threaded` in setup.py)."""
SHARED = "miro_exact.cython_shared"
"""A compiled module without source of ours: Cython's own code that all the others import."""
_CIMPORT = re.compile(r"^from (\S+) cimport ([^#\n]+)", re.MULTILINE)


def hot_sources(package_dirs: dict[str, Path]) -> dict[str, Path]:
    """Dotted name -> source file of every hot module below the given package folders."""
    sources = {}
    for package, folder in package_dirs.items():
        root = len(os.fspath(folder))
        # quicker than `rglob`: every start of a program waits for it
        for inner, folders, files in os.walk(folder):
            folders[:] = [name for name in folders if name != "__pycache__"]
            within = f"{package}{inner[root:]}".replace(os.sep, ".")
            for stem in (name[:-4] for name in files if name.endswith(".pxd")):
                for source in (f"{stem}.py", f"{stem}.pyx"):
                    if source in files:
                        sources[f"{within}.{stem}"] = Path(inner, source)
    return dict(sorted(sources.items()))


def source_hashes(package_dirs: dict[str, Path], sources: dict[str, Path]) -> dict[str, str]:
    """Dotted name -> SHA-256 over the module's source, its `.pxd` and every `.pxd` that this one builds upon.

    These files fix the C layout that a compiled module relies on. `places.py` counts too: it adds to each of them.
    `sources`: the result of `hot_sources` for these folders, which takes as long as this function.
    """
    texts = {name: _text(source.with_suffix(".pxd")) for name, source in sources.items()}
    import hashlib  # slow to load

    added = package_dirs.get("miro_exact", Path()) / "places.py"
    basis = _text(added) if added.exists() else b""
    cimported = {name: _cimported(text, texts) for name, text in texts.items()}
    hashes = {}
    for name, source in sources.items():
        digest = hashlib.sha256(basis)
        for used in sorted(_layout(name, cimported)):
            digest.update(f"{used}\n".encode() + texts[used])
        hashes[name] = hashlib.sha256(digest.digest() + _text(source)).hexdigest()
    return hashes


def _cimported(text: bytes, texts: dict[str, bytes]) -> list[str]:
    """The hot modules in `texts` that this `.pxd` cimports directly."""
    used: list[str] = []
    for package, names in _CIMPORT.findall(text.decode()):
        modules = [package, *(f"{package}.{part.strip()}" for part in names.split(","))]
        used += [module for module in modules if module in texts]
    return used


def _layout(name: str, cimported: dict[str, list[str]]) -> set[str]:
    """The hot modules whose `.pxd` is part of this one's layout, including itself."""
    layout: set[str] = set()
    waiting = [name]
    while waiting:
        used = waiting.pop()
        if used not in layout:
            layout.add(used)
            waiting += cimported[used]
    return layout


def _text(path: Path) -> bytes:
    text = path.read_bytes()
    return text.replace(b"\r\n", b"\n") if b"\r" in text else text  # to look for one byte is quicker


def compiled_file(source: Path) -> Path | None:
    """The extension module built from this source; None if there is none."""
    for suffix in EXTENSION_SUFFIXES:
        candidate = source.with_name(source.stem + suffix)
        if candidate.exists():
            return candidate
    return None


def dispatch_replicated(modules: Iterable[Path]) -> bool:
    """True if one of these compiled modules has an interpreter loop with replicated dispatch."""
    return any(DISPATCH_MARK in module.read_bytes() for module in modules)
