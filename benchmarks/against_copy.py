"""A copy of another commit, built once: what `benchmarks.against` compares this tree with.

The copy lies in the folder for temporary files, under the hash of the commit's content: two commits with the same
content share a copy, and a second comparison with it builds nothing.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).resolve().parent.parent
OURS = "mirotwin"
_BUILT = "built"
"""Name of a file that is written when the extensions are built."""


class Tree(NamedTuple):
    """A checkout: its name in the table, its folder, and the folders that go on PYTHONPATH."""

    name: str
    folder: Path
    roots: tuple[Path, ...]

    def environment(self) -> dict[str, str]:
        """Environment of a child that imports this tree's packages."""
        return {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, self.roots))}


def this_tree() -> Tree:
    """The working tree as it is, with the extensions that are built in it."""
    found = (*HERE.glob("*/__init__.py"), *HERE.glob("*/*/__init__.py"))
    names = sorted(path.parent.relative_to(HERE).as_posix() for path in found)
    return Tree("this tree", HERE, _roots(HERE, names))


def copy_of(commit: str) -> Tree:
    """The copy of `commit`, built now if it is not there yet. SystemExit where git does not know it."""
    content = _git("rev-parse", "--verify", f"{commit}^{{tree}}").decode().strip()
    folder = Path(tempfile.gettempdir()) / f"mirotwin-{content[:16]}"
    if not (folder / _BUILT).exists():
        _extract(content, folder)
        print(f"building {commit} in {folder}", file=sys.stderr)
        command = [sys.executable, "setup.py", "-q", "build_ext", "--inplace"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{commit}: its extensions cannot be built:\n{done.stderr[-2000:]}")
        (folder / _BUILT).touch()
    listed = _git("ls-tree", "-r", "--name-only", content).decode().splitlines()
    packages = [name.removesuffix("/__init__.py") for name in listed if name.endswith("/__init__.py")]
    return Tree(commit, folder, _roots(folder, packages))


def _roots(folder: Path, packages: list[str]) -> tuple[Path, ...]:
    """Folders directly in `folder` that hold a package `miro..`, and `folder` itself where it holds one."""
    tops = [name.split("/") for name in packages if name.count("/") == 1]
    roots = [
        folder / root for root in sorted({root for root, name in tops if name.startswith("miro")} - {OURS})
    ]
    return (*roots, folder) if OURS in packages else tuple(roots)


def _extract(content: str, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    archive = subprocess.Popen(["git", "archive", content], cwd=HERE, stdout=subprocess.PIPE)
    with archive, tarfile.open(fileobj=archive.stdout, mode="r|") as files:
        files.extractall(folder, filter="data")


def _git(*arguments: str) -> bytes:
    done = subprocess.run(["git", *arguments], cwd=HERE, capture_output=True)
    if done.returncode:
        sys.exit(f"git {' '.join(arguments)}: {done.stderr.decode().strip()}")
    return done.stdout
