"""An open file or pipe that supports peeking and counts the bytes read."""

from __future__ import annotations

import io
import os
import stat
import sys
from io import BytesIO
from typing import BinaryIO

from miro_exact.inputs import InputError, check_ends, check_no_folder
from mirotwin.shell.outputs import RECORDING

STDIN = "-"
HEAD_BYTES = 1 << 16
CHUNK_BYTES = 1 << 16


class Input:
    """`path` ("-": standard input), open for reading; `size` is None for a pipe; `position`: bytes read so far.

    Raises InputError for folders, named pipes, and devices other than the null device, OSError as `open` does.
    """

    def __init__(self, path: str) -> None:
        self.path = path
        self.label = "standard input" if path == STDIN else path
        self.position = 0
        self._head = b""
        if path != STDIN:
            check_no_folder(path, RECORDING)
            check_ends(path)
        elif vars(sys)["stdin"] is None:
            raise InputError(self.label, "is closed", "name a file or a pipe")
        self._file: BinaryIO = sys.stdin.buffer if path == STDIN else open(path, "rb")  # noqa: SIM115
        self.size = self._size()

    def _size(self) -> int | None:
        try:
            status = os.fstat(self._file.fileno())
        except (OSError, io.UnsupportedOperation):  # no real file: a test's, say
            return None
        if stat.S_ISBLK(status.st_mode) or (stat.S_ISCHR(status.st_mode) and not self._readable(status)):
            raise InputError(self.label, "is a device", "name a file or a pipe")
        return status.st_size if stat.S_ISREG(status.st_mode) else None

    def _readable(self, status: os.stat_result) -> bool:
        """True if a character device has an end: the null device, or a terminal with a keyboard."""
        return self._file.isatty() or os.path.samestat(status, os.stat(os.devnull))

    def peek(self, size: int = HEAD_BYTES) -> bytes:
        """The next `size` bytes without consuming them; fewer only at the end."""
        while len(self._head) < size and (more := self._file.read(size - len(self._head))):
            self._head += more
        return self._head[:size]

    def read(self, size: int, /) -> bytes:
        """`size` bytes, fewer only at the end."""
        taken = self._head[:size]
        self._head = self._head[len(taken) :]
        if len(taken) < size:
            taken += self._file.read(size - len(taken))
        self.position += len(taken)
        return taken

    def read_some(self) -> bytes:
        """The next available bytes, waiting for the first; empty at the end."""
        if self._head:
            return self.read(len(self._head))
        read1 = getattr(self._file, "read1", self._file.read)
        data = bytes(read1(CHUNK_BYTES))
        self.position += len(data)
        return data

    def whole(self) -> BinaryIO:
        """The whole file from its beginning, in which one can move; of a pipe, a copy."""
        if self.size is not None:
            self._head = b""
            self._file.seek(0)
            return self._file
        import tempfile

        copy = tempfile.TemporaryFile()  # noqa: SIM115
        while data := self.read_some():
            copy.write(data)
        copy.seek(0)
        return copy

    @classmethod
    def of(cls, data: bytes, path: str) -> Input:
        """An input of `data`, read before from `path`."""
        given = cls.__new__(cls)
        given.path = given.label = path
        given.position, given._head = 0, b""
        given._file, given.size = BytesIO(data), len(data)
        return given

    def readline(self, limit: int) -> bytes:
        """The next line with its end, or the first `limit` bytes of a longer one; empty at the end."""
        line = self._head[: min(limit, self._head.find(b"\n") + 1 or limit)]
        self._head = self._head[len(line) :]
        if not line.endswith(b"\n") and len(line) < limit:
            line += self._file.readline(limit - len(line))
        self.position += len(line)
        return line

    def __enter__(self) -> Input:
        return self

    def __exit__(self, *raised: object) -> None:
        if self.path != STDIN:
            self._file.close()
