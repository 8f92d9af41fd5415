"""Finds the files that are tests: scenarios, `*.scenario.toml`, and cases, `*.stream`."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from miro_exact.bad_input import BadInput
from mirotwin.verify.cases.case import SUFFIX as CASE_SUFFIX
from mirotwin.verify.cases.case import is_case

SUFFIX = ".scenario.toml"
KINDS = f"*{SUFFIX} or *{CASE_SUFFIX}"
SKIPPED = ("node_modules", "__pycache__")


def collect(paths: Sequence[str]) -> list[str]:
    """The files, each once: those that are named, and all of these kinds below each folder, sorted by path.

    Of streams below a folder those are tests that expect something. A folder that is a link is not looked into, unless
    it is named.

    Raises BadInput for a path that is not there, and for a file of another kind.
    """
    found: dict[str, None] = {}
    for path in paths:
        if os.path.isdir(path):
            found |= dict.fromkeys(_below(path))
            continue
        if not os.path.exists(path):
            raise BadInput(path, "", "there is no such file or folder", f"name a folder, or a {KINDS}")
        if not path.endswith((SUFFIX, CASE_SUFFIX)):
            raise BadInput(path, "", f"is no {KINDS}", "rename it; `mirotwin run` takes any scenario")
        found[path] = None
    return list(found)


def _below(folder: str) -> Iterator[str]:
    for above, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in SKIPPED)
        for name in sorted(names):
            path = Path(above, name)
            if not path.is_file() and not path.is_symlink():  # no pipes and devices
                continue
            if name.endswith(SUFFIX) or (name.endswith(CASE_SUFFIX) and is_case(path)):
                yield str(path)
