"""What only the target process knows of a campaign: how many inputs it has run.

The file is mapped into memory: writing costs no system call, and what was written survives the process.
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path
from types import TracebackType

_FORM = struct.Struct("<Q")


class Counts:
    """The file at `path`, kept up to date; nothing is kept where `path` is None.

    It counts on from what processes before this one have written there.
    """

    def __init__(self, path: Path | None) -> None:
        self.before = 0 if path is None else read_executions(path)
        self._memory: mmap.mmap | None = None
        if path is not None:
            path.write_bytes(_FORM.pack(self.before))
            with path.open("r+b") as stream:
                self._memory = mmap.mmap(stream.fileno(), _FORM.size)

    def keep(self, executions: int) -> None:
        """Writes what this process has run."""
        if self._memory is not None:
            _FORM.pack_into(self._memory, 0, self.before + executions)

    def __enter__(self) -> Counts:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._memory is not None:
            self._memory.close()


def read_executions(path: Path) -> int:
    """The number at `path`; 0 where there is no such file, or none that is whole."""
    try:
        content = path.read_bytes()
    except OSError:
        return 0
    return int(_FORM.unpack(content)[0]) if len(content) == _FORM.size else 0
