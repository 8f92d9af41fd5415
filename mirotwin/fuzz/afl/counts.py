"""What only the target process knows of a campaign: executions, frames and characters fed.

The file is mapped into memory: writing costs no system call, and what was written survives the process. A campaign
that is taken up again counts on.
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path
from types import TracebackType
from typing import Protocol

import msgspec

_FORM = struct.Struct("<QQQ")


class Counted(Protocol):
    """What is counted."""

    executions: int
    frames_fed: int
    characters_fed: int


class Fed(msgspec.Struct, frozen=True):
    """Counters of one target process, with those of the processes before it."""

    executions: int = 0
    frames: int = 0
    characters: int = 0


class Counts:
    """The file at `path`, kept up to date; nothing is kept where `path` is None."""

    def __init__(self, path: Path | None) -> None:
        self.before = Fed() if path is None else read_counts(path)
        self._memory: mmap.mmap | None = None
        if path is not None:
            path.write_bytes(_FORM.pack(self.before.executions, self.before.frames, self.before.characters))
            with path.open("r+b") as stream:
                self._memory = mmap.mmap(stream.fileno(), _FORM.size)

    def keep(self, target: Counted) -> None:
        """Writes what `target` has counted."""
        if self._memory is not None:
            before = self.before
            _FORM.pack_into(
                self._memory,
                0,
                before.executions + target.executions,
                before.frames + target.frames_fed,
                before.characters + target.characters_fed,
            )

    def __enter__(self) -> Counts:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._memory is not None:
            self._memory.close()


def read_counts(path: Path) -> Fed:
    """The counters at `path`; zeros where there is no such file, or none that is whole."""
    try:
        content = path.read_bytes()
    except OSError:
        return Fed()
    return Fed(*_FORM.unpack(content)) if len(content) == _FORM.size else Fed()
