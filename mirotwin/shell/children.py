"""Python processes that a command starts, so that no file of the current folder is imported in them.

`python -m` and the processes of `multiprocessing` put the current folder in front of the paths of modules: a
`msgspec.py` in a folder of recordings would be executed. Python leaves it out with `-P` or PYTHONSAFEPATH.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_SAFE_PATH = "PYTHONSAFEPATH"


def python_module(name: str, *arguments: str) -> list[str]:
    """The command that runs a module of ours in a new process."""
    return [sys.executable, "-P", "-m", name, *arguments]


@contextmanager
def safe_path() -> Iterator[None]:
    """Processes that begin meanwhile do not import from the current folder, whatever starts them."""
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before
