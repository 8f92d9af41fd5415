"""The folder or file a command writes to: refused if other things are there, filled in one go at the end.

What belongs here: deciding whether a folder or file may be used, and moving what is finished into it. What does
not: what is in the files. Everything is written to a temporary place on the same disk first, so that whatever goes
wrong leaves either the files from before or the new ones, never half of one.
"""

import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

RECORDING = "run.mcap"
FILES = (RECORDING, "figure.png", "summary.json")
"""What a run writes, and all that `--force` replaces."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What a disk says that takes no more: only writing can meet it, and the error names no file."""


class OutputError(ValueError):
    """A folder that cannot be written to: `path`, what, remedy."""

    def __init__(self, path: Path, what: str, remedy: str) -> None:
        self.path = path
        super().__init__(f"{path}: {what}; {remedy}")


class OutputFolder:
    """`path` as the target of a command that writes files called `names`, by default those of a run.

    Checks at once; as a context manager gives the folder to write into. Leaving the context normally moves the files
    over; leaving it by an exception removes them. Raises OutputError for a folder with other content (unless
    `force`), for one that cannot be made, and for a full disk.
    """

    def __init__(self, path: Path, force: bool = False, names: Sequence[str] = FILES) -> None:
        self.path = path
        self.names = names
        self._staging: Path | None = None
        _check(path, force, names)

    def __enter__(self) -> Path:
        try:
            beside = self.path if self.path.is_dir() else self.path.parent
            beside.mkdir(parents=True, exist_ok=True)
            name = tempfile.mkdtemp(prefix=f".{self.path.name}.", dir=beside)
        except OSError as error:
            raise OutputError(self.path, _reason(error), "choose another folder with --out") from None
        self._staging = Path(name)
        return self._staging

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._staging is not None
        try:
            if kind is None:
                self._publish(self._staging)
            elif isinstance(error, OSError) and error.errno in FULL:
                raise OutputError(self.path, _reason(error), _make_room("folder", "--out")) from None
        except OSError as failure:
            raise OutputError(self.path, _reason(failure), "choose another folder with --out") from None
        finally:
            shutil.rmtree(self._staging, ignore_errors=True)

    def _publish(self, staging: Path) -> None:
        self.path.mkdir(exist_ok=True)
        for name in self.names:
            if (staging / name).exists():
                os.replace(staging / name, self.path / name)
            else:  # one from before must not stand beside a new run as if it belonged to it
                (self.path / name).unlink(missing_ok=True)


def _check(path: Path, force: bool, names: Sequence[str]) -> None:
    try:
        present = sorted(os.listdir(path))
    except FileNotFoundError:
        if path.is_symlink():
            what = f"is a symbolic link to {os.readlink(path)}, which does not exist"
            raise OutputError(path, what, "make that folder, or remove the link") from None
        return
    except OSError as error:
        what = "exists and is not a folder" if isinstance(error, NotADirectoryError) else _reason(error)
        raise OutputError(path, what, "choose another folder with --out") from None
    if present and not force:
        shown = ", ".join(present[:3]) + (", .." if len(present) > 3 else "")
        ours = ", ".join(names) if len(names) <= len(FILES) else f"{names[0]} to {names[-1]}"
        remedy = f"choose another with --out, or replace {ours} with --force"
        raise OutputError(path, f"the folder is not empty ({shown})", remedy)
    if not os.access(path, os.W_OK | os.X_OK):
        raise OutputError(path, "the folder cannot be written to", "choose another folder with --out")
    for name in names:
        if (path / name).is_dir():
            raise OutputError(path / name, "is a folder where a file is to be written", "remove it")


def check_file(path: Path, option: str) -> None:
    """Whether a single file could be written there, asked before the work that fills it. Raises OutputError."""
    remedy = f"choose another file with {option}"
    if path.is_dir():
        raise OutputError(path, "is a folder", remedy)
    if path.is_symlink() and not path.exists():
        what = f"is a symbolic link to {os.readlink(path)}, which does not exist"
        raise OutputError(path, what, remedy)
    if path.exists() and not path.is_file():
        raise OutputError(path, "is there and is not a regular file", remedy)
    if path.exists() and not os.access(path, os.W_OK):
        raise OutputError(path, "the file cannot be written to", remedy)
    folder = path.resolve().parent if path.is_symlink() else path.parent
    if not folder.is_dir():
        raise OutputError(path, f"there is no folder {folder}", remedy)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(path, f"the folder {folder} cannot be written to", remedy)


def check_new(path: Path, option: str, force: bool, more: str = "") -> None:
    """The same for an output that replaces a file only by `force`; `more` is another way out. Raises OutputError."""
    check_file(path, option)
    if path.exists() and not force:
        ways = f"choose another file with {option}, {more}or replace it with --force"
        raise OutputError(path, "is there already", ways)


def check_not_input(path: Path, option: str, *inputs: str | Path | None) -> None:
    """Refuses to write over what is being read. Raises OutputError."""
    for given in inputs:
        if given is not None and path.exists() and os.path.exists(given) and os.path.samefile(path, given):
            raise OutputError(path, "is the input itself", f"choose another file with {option}")


@contextmanager
def whole_file(path: Path, option: str) -> Iterator[Path]:
    """A name beside `path` to write to; what was written takes its place at the end, or is gone if anything raised.

    A link stays one, and a file keeps its mode. Raises OutputError, before anything is done, where `check_file` does,
    and for a full disk.
    """
    check_file(path, option)
    target = path.resolve()
    mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666 & ~_umask()
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise OutputError(path, _reason(error), f"choose another file with {option}") from None
    os.close(handle)
    staging = Path(name)
    try:
        yield staging
        staging.chmod(mode)
        os.replace(staging, target)
    except OSError as error:
        if error.errno not in FULL:
            raise
        raise OutputError(path, _reason(error), _make_room("file", option)) from None
    finally:
        staging.unlink(missing_ok=True)


def _make_room(kind: str, option: str) -> str:
    return f"make room, or choose another {kind} with {option}"


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _reason(error: OSError) -> str:
    return error.strerror or type(error).__name__
