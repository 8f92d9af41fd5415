"""Writes a file whole or not at all: a reader finds the old content or the new."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path


def replace(path: str | os.PathLike[str], content: bytes) -> None:
    """Puts `content` in the place of whatever is at `path`; OSError when that cannot be done."""
    import tempfile  # slow to load

    target = Path(path)
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(name, 0o644)  # mkstemp's 0600 is for secrets
        os.replace(name, target)
    except BaseException:
        with suppress(FileNotFoundError):
            os.unlink(name)
        raise
