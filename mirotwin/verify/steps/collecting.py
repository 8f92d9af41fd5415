"""Finds the scenario files that are tests: `*.scenario.toml`."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from miro_exact.bad_input import BadInput

SUFFIX = ".scenario.toml"
SKIPPED = ("node_modules", "__pycache__")


def collect(paths: Sequence[str]) -> list[str]:
    """The files, each once: those that are named, and all of that kind below each folder, sorted by path.

    A folder that is a link is not looked into, unless it is named.

    Raises BadInput for a path that is not there, and for a file that is no `*.scenario.toml`.
    """
    found: dict[str, None] = {}
    for path in paths:
        if os.path.isdir(path):
            found |= dict.fromkeys(_below(path))
            continue
        if not os.path.exists(path):
            raise BadInput(path, "", "there is no such file or folder", f"name a folder, or a *{SUFFIX}")
        if not path.endswith(SUFFIX):
            raise BadInput(path, "", f"is no *{SUFFIX}", "rename it; `mirotwin run` takes any scenario")
        found[path] = None
    return list(found)


def _below(folder: str) -> Iterator[str]:
    for above, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in SKIPPED)
        for name in sorted(names):
            path = Path(above, name)
            if name.endswith(SUFFIX) and (path.is_file() or path.is_symlink()):  # no pipes and devices
                yield str(path)
