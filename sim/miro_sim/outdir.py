"""The folder a run writes to: refused if it holds other things, filled in one go at the end.

What belongs here: deciding whether a folder may be used, and moving finished files into it. What does not:
what is in the files. Everything is written to a temporary folder beside the target first, so that whatever
goes wrong leaves either the files from before or the new ones, never half of one.
"""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

FILES = ("run.mcap", "figure.png", "summary.json")
"""What a run writes, and all that `--force` replaces."""


class OutputError(ValueError):
    """A folder that cannot be written to: `path`, what, remedy."""

    def __init__(self, path: Path, what: str, remedy: str) -> None:
        self.path = path
        super().__init__(f"{path}: {what}; {remedy}")


class OutputFolder:
    """`path` as the target of a run. Checks at once; as a context manager gives the folder to write into.

    Leaving the context normally moves the files over; leaving it by an exception removes them. Raises
    OutputError for a folder with other content (unless `force`) and for one that cannot be made.
    """

    def __init__(self, path: Path, force: bool = False) -> None:
        self.path = path
        self._staging: Path | None = None
        _check(path, force)

    def __enter__(self) -> Path:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            name = tempfile.mkdtemp(prefix=f".{self.path.name}.", dir=self.path.parent)
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
        except OSError as failure:
            raise OutputError(self.path, _reason(failure), "choose another folder with --out") from None
        finally:
            shutil.rmtree(self._staging, ignore_errors=True)

    def _publish(self, staging: Path) -> None:
        self.path.mkdir(exist_ok=True)
        for name in FILES:
            if (staging / name).exists():
                os.replace(staging / name, self.path / name)
            else:  # one from before must not stand beside a new run as if it belonged to it
                (self.path / name).unlink(missing_ok=True)


def _check(path: Path, force: bool) -> None:
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
        remedy = f"choose another with --out, or replace {', '.join(FILES)} with --force"
        raise OutputError(path, f"the folder is not empty ({shown})", remedy)
    if not os.access(path, os.W_OK | os.X_OK):
        raise OutputError(path, "the folder cannot be written to", "choose another folder with --out")
    for name in FILES:
        if (path / name).is_dir():
            raise OutputError(path / name, "is a folder where a run writes a file", "remove it")


def check_file(path: Path, option: str) -> None:
    """Whether a single file could be written there, asked before the work that fills it. Raises OutputError."""
    folder = path.parent
    remedy = f"choose another file with {option}"
    if path.is_dir():
        raise OutputError(path, "is a folder", remedy)
    if path.exists():
        if not os.access(path, os.W_OK):
            raise OutputError(path, "the file cannot be written to", remedy)
    elif path.is_symlink():
        what = f"is a symbolic link to {os.readlink(path)}, which does not exist"
        raise OutputError(path, what, remedy)
    elif not folder.is_dir():
        raise OutputError(path, f"there is no folder {folder}", remedy)
    elif not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(path, f"the folder {folder} cannot be written to", remedy)


def check_not_input(path: Path, option: str, *inputs: str | Path | None) -> None:
    """Refuses to write over what is being read. Raises OutputError."""
    for given in inputs:
        if given is not None and path.exists() and os.path.exists(given) and os.path.samefile(path, given):
            raise OutputError(path, "is the input itself", f"choose another file with {option}")


@contextmanager
def whole_file(path: Path, option: str) -> Iterator[Path]:
    """A name beside `path` to write to; what was written takes its place at the end, or is gone if anything raised.

    Raises OutputError, before anything is done, where `check_file` does and for what is there and is no file.
    """
    check_file(path, option)
    if path.exists() and not path.is_file():
        raise OutputError(path, "is there and is not a regular file", f"choose another file with {option}")
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    except OSError as error:
        raise OutputError(path, _reason(error), f"choose another file with {option}") from None
    os.close(handle)
    staging = Path(name)
    try:
        yield staging
        staging.chmod(0o666 & ~_umask())
        os.replace(staging, path)
    finally:
        staging.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _reason(error: OSError) -> str:
    return error.strerror or type(error).__name__
