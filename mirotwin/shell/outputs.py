"""The output folder or file of a command: refused if it has other content, completed in one step at the end.

Everything is written under another name beside its place first (run.part.mcap, FILE.xxxx.part), so an error leaves
either the earlier files or the new ones, never half of one.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from types import TracebackType

from miro_exact.bad_input import BadInput

RECORDING = "run.mcap"
FILES = (RECORDING, "figure.svg", "summary.json")
"""Files that a run writes; `--force` replaces these, and the parts of them left by an interrupted run."""
KEPT = (RECORDING, "summary.json")
"""Of these, a run that is broken off leaves the parts."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""errno values of a full disk. They occur on write only, and the OSError then names no file."""


class OutputError(BadInput):
    """A path that cannot be written to: `path`, reason, remedy."""

    def __init__(self, path: Path, reason: str, remedy: str) -> None:
        super().__init__(path, "", reason, remedy)


def part_name(name: str) -> str:
    """Name of a file until it is complete: run.part.mcap for run.mcap."""
    path = Path(name)
    return f"{path.stem}.part{path.suffix}"


RECORDINGS = (RECORDING, part_name(RECORDING))
"""A run's folder contains one of these."""


def file_in(path: str, names: Sequence[str] = RECORDINGS) -> str:
    """Of a folder, the first of these files that is in it; else the path itself."""
    inside = (os.path.join(path, name) for name in names)
    return next(filter(os.path.isfile, inside), path)


class OutputFolder:
    """`path` as the target of a command that writes files called `names`, by default those of a run.

    It is checked at once. As a context manager it locks the folder; `part` returns the path for each file. At a normal
    end the parts get their final names, and files of these names that were not written again are removed. After an
    exception the parts are removed, except those named in `keep`, and complete files stay unchanged. A killed process
    leaves all its parts.

    Raises OutputError for a folder with other content (unless `force`), for one that another process writes to, for one
    that cannot be created, and for a full disk. `ours`: the command chose the folder itself; a finished run in it is
    replaced as with `force`.
    """

    def __init__(
        self, path: Path, force: bool = False, names: Sequence[str] = FILES, ours: bool = False
    ) -> None:
        self.path = path
        self.names = names
        self.keep: Sequence[str] = ()
        self._force = force
        self._ours = ours
        self._made = False
        self._held = ExitStack()
        if path.is_dir():
            with locked_folder(path):
                pass
        _check(path, force, names, ours)

    def part(self, name: str) -> Path:
        """Path for writing the file `name` until it is complete."""
        return self.path / part_name(name)

    def __enter__(self) -> OutputFolder:
        with ExitStack() as held, refused(self.path, "choose another folder with --out"):
            self._made = not self.path.is_dir()
            self.path.mkdir(parents=True, exist_ok=True)
            held.enter_context(locked_folder(self.path))
            _check(self.path, self._force, self.names, self._ours)  # another run may have filled it since
            self._remove_parts()
            self._held = held.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._held:
            try:
                with refused(self.path, "choose another folder with --out"):
                    if kind is None:
                        self._publish()
                    elif isinstance(error, OSError) and error.errno in FULL:
                        raise error
            finally:
                self._leave()

    def _publish(self) -> None:
        for name in self.names:
            if self.part(name).exists():
                os.replace(self.part(name), self.path / name)
            else:  # one from before must not stand beside a new run as if it belonged to it
                (self.path / name).unlink(missing_ok=True)

    def _leave(self) -> None:
        with suppress(OSError):  # what is being reported says more
            self._remove_parts(self.keep)
            if self._made and not os.listdir(self.path):
                self.path.rmdir()

    def _remove_parts(self, keep: Sequence[str] = ()) -> None:
        for name in self.names:
            if name not in keep:
                self.part(name).unlink(missing_ok=True)


def locked_elsewhere(descriptor: int) -> bool:
    """Locks a file or folder until it is closed or this process is gone; True where another process has it.

    False where there are no such locks (Windows, some network disks).
    """
    try:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except (ImportError, OSError):
        return False
    return False


@contextmanager
def locked_folder(path: Path) -> Iterator[None]:
    """Holds a folder that is there. Raises OutputError if another process has it."""
    if os.name == "nt":  # where folders cannot be opened
        yield
        return
    folder = os.open(path, os.O_RDONLY)
    try:
        if locked_elsewhere(folder):
            remedy = "wait until it has finished, or choose another folder with --out"
            raise OutputError(path, "another process is writing into the folder", remedy)
        yield
    finally:
        os.close(folder)


def entries(path: Path, option: str) -> list[str]:
    """The entries of an output folder; empty if it does not exist. Raises OutputError if `path` is no folder."""
    remedy = f"choose another folder with {option}"
    try:
        present = sorted(os.listdir(path))
    except FileNotFoundError:
        if path.is_symlink():
            reason = f"is a symbolic link to {os.readlink(path)}, which does not exist"
            raise OutputError(path, reason, "make that folder, or remove the link") from None
        return []
    except OSError as error:
        reason = "exists and is not a folder" if isinstance(error, NotADirectoryError) else reason_of(error)
        raise OutputError(path, reason, remedy) from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise OutputError(path, "the folder cannot be written to", remedy)
    return present


def not_empty(path: Path, present: Sequence[str], remedy: str) -> OutputError:
    """For a folder in which there is something already."""
    return OutputError(path, f"the folder is not empty ({some(present)})", remedy)


def _check(path: Path, force: bool, names: Sequence[str], ours: bool) -> None:
    present = entries(path, "--out")
    parts = {part_name(name) for name in names} & set(present)
    finished = ours and RECORDING in present and not parts
    if present and not force and not finished:
        if parts:
            reason = f"the folder holds parts of an interrupted command ({some(sorted(parts))})"
            raise OutputError(path, reason, _ways_out(names))
        raise not_empty(path, present, _ways_out(names))
    for name in (*names, *map(part_name, names)):
        if (path / name).is_dir():
            raise OutputError(path / name, "is a folder where a file is to be written", "remove it")


def some(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (", .." if len(names) > 3 else "")


def _ways_out(names: Sequence[str]) -> str:
    ours = ", ".join(names) if len(names) <= len(FILES) else f"{names[0]} to {names[-1]}"
    return f"choose another with --out, or replace {ours} and their parts with --force"


def make_folder(path: Path, option: str) -> None:
    """Makes a folder and those above it, if they are not there. Raises OutputError."""
    with refused(path, f"choose another folder with {option}"):
        path.mkdir(parents=True, exist_ok=True)


def check_file(path: Path, option: str, *inputs: str | Path | None) -> None:
    """Raises OutputError unless the file can be written and is not an input."""
    remedy = f"choose another file with {option}"
    if path.is_dir():
        raise OutputError(path, "is a folder", remedy)
    if path.is_symlink() and not path.exists():
        reason = f"is a symbolic link to {os.readlink(path)}, which does not exist"
        raise OutputError(path, reason, remedy)
    if path.exists() and not path.is_file():
        raise OutputError(path, "exists and is not a regular file", remedy)
    if path.exists() and not os.access(path, os.W_OK):
        raise OutputError(path, "the file cannot be written to", remedy)
    folder = path.resolve().parent if path.is_symlink() else path.parent
    if not folder.is_dir():
        raise OutputError(path, f"there is no folder {folder}", remedy)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(path, f"the folder {folder} cannot be written to", remedy)
    for given in inputs:
        if given is not None and path.exists() and os.path.exists(given) and os.path.samefile(path, given):
            raise OutputError(path, "is the input itself", remedy)


def check_new(path: Path, option: str, force: bool, *inputs: str | Path | None, more: str = "") -> None:
    """Raises OutputError as `check_file`, and without `force` for a file that exists; `more` is another way out."""
    check_file(path, option, *inputs)
    if path.exists() and not force:
        ways = f"choose another file with {option}, {more}or replace it with --force"
        raise OutputError(path, "is there already", ways)


@contextmanager
def whole_file(path: Path, option: str) -> Iterator[Path]:
    """Yields a path beside `path` to write to. At the end the written file replaces `path`; after an exception it is
    removed.

    A link stays a link, and a file keeps its mode. Raises OutputError, before anything is done, if `check_file` does,
    and for a full disk.
    """
    check_file(path, option)
    target = path.resolve()
    mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666 & ~_umask()
    with refused(path, f"choose another file with {option}"):
        staging = _staging(target)
    try:
        with told_when_full(path, option, "file"):
            yield staging
            staging.chmod(mode)
            os.replace(staging, target)
    finally:
        staging.unlink(missing_ok=True)


def write_files(folder: Path, files: Mapping[str, bytes], remedy: str) -> None:
    """Writes files into `folder`, which is made, by name (`a/b` is in a folder of it): all of them, or none.

    Follows no link below `folder`. Raises OutputError with `remedy`, which names another folder.
    """
    inner = sorted({folder / parent for name in files for parent in Path(name).parents} - {folder})
    if link := next(filter(Path.is_symlink, inner), None):
        raise OutputError(link, f"is a symbolic link to {os.readlink(link)}", f"remove it, or {remedy}")
    made: list[Path] = []
    staged: dict[Path, Path] = {}
    try:
        for path in (*reversed(folder.parents), folder, *inner):
            if not path.is_dir():
                path.mkdir()
                made.append(path)
        for name, content in files.items():
            target = folder / name
            if target.is_dir():  # which renaming would refuse when other files have their names already
                raise OutputError(
                    target, "is a folder where a file is to be written", f"remove it, or {remedy}"
                )
            staged[target] = staging = _staging(target)
            staging.write_bytes(content)
            staging.chmod(0o666 & ~_umask())
        for target, staging in staged.items():
            os.replace(staging, target)
    except BaseException as error:
        with suppress(OSError):  # what is being reported says more
            for staging in staged.values():
                staging.unlink(missing_ok=True)
            for path in reversed(made):
                path.rmdir()
        if not isinstance(error, OSError):
            raise
        with refused(Path(error.filename) if isinstance(error, FileExistsError) else folder, remedy):
            raise


def _staging(target: Path) -> Path:
    """A new empty file beside `target`, under another name."""
    import tempfile  # slow to load

    handle, name = tempfile.mkstemp(".part", f"{target.name}.", target.parent)
    os.close(handle)
    return Path(name)


def told_when_full(path: Path | None, option: str, kind: str = "folder") -> AbstractContextManager[None]:
    """Converts a full disk's OSError, which names no file, to an OutputError that names the folder or file.

    `path`: None if nothing is written.
    """
    return nullcontext() if path is None else refused(path, f"choose another {kind} with {option}", FULL)


@contextmanager
def refused(path: Path, remedy: str, only: Collection[int] = ()) -> Iterator[None]:
    """Converts an OSError, or only those with an errno in `only`, to an OutputError of the path."""
    try:
        yield
    except OSError as error:
        if only and error.errno not in only:
            raise
        room = "make room, or " if error.errno in FULL else ""
        raise OutputError(path, reason_of(error), f"{room}{remedy}") from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def reason_of(error: OSError) -> str:
    return error.strerror or type(error).__name__
