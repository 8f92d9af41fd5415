"""Reads an input file whole; refuses devices, pipes that may never end, and files larger than any valid one.

Every file from an untrusted source is read through this module. `replace_file` writes one, completely or not at all.
"""

import codecs
import os
import re
import stat
from contextlib import suppress
from pathlib import Path

from miro_exact.bad_input import BadInput, one_line, shortened

TEXT_BYTES = 64 << 20
"""Size limit of files written by hand or by tools: scenarios, symbol files, listings, streams, serial input."""
IMAGE_BYTES = 4 << 20
"""Intel HEX: 64 KB of code with one byte a record is 1 MB."""
BOARD_BYTES = EYE_BYTES = 1 << 20
PICTURE_BYTES = 4 << 20
"""320 x 240 pixels of 48 bits are 0.5 MB."""
WORLD_BYTES = 64 << 20
RECORDING_BYTES = 1 << 30
RECORDING_NEEDS = 7
"""Memory that reading a whole large recording takes, in sizes of the file; more for a small one (docs/measured.md)."""
CHUNK_BYTES = 1 << 20
_OF_PROCESSES = ("/dev/", "/proc/self/fd/")
"""Folders in which a shell puts the pipe of `<(command)`."""


class InputError(BadInput):
    """A file that is not read: `path`, reason, remedy."""

    def __init__(self, path: str, reason: str, remedy: str) -> None:
        super().__init__(path, "", reason, remedy)


def check_no_folder(path: str | os.PathLike[str], likely: str = "") -> None:
    """Refuses a folder; names the file `likely` in it, if that exists, as the probable intention."""
    if os.path.isdir(path):
        meant = os.path.join(path, likely)
        hint = f", such as {meant}" if os.path.isfile(meant) else ""
        raise InputError(str(path), "is a folder", f"name a file in it{hint}")


def check_regular(path: str | os.PathLike[str]) -> None:
    """Refuses an existing path that is no regular file: a file read twice cannot be a pipe."""
    check_no_folder(path)
    if os.path.exists(path) and not os.path.isfile(path):
        raise InputError(str(path), "is not a regular file", "copy the content to a file first")


def path_beside(file: str | os.PathLike[str], name: str) -> str:
    """The path of a file named inside `file`. With links resolved it must be in the folder of `file` or below.

    Raises InputError, so that the author of a file cannot select other files of this machine.
    """
    folder = os.path.dirname(file)
    path = os.path.join(folder, name)
    try:
        real = os.path.realpath(folder)
        inside = os.path.commonpath([real, os.path.realpath(path)]) == real
    except ValueError:  # a NUL, another drive
        inside = False
    if not inside:
        reason = f"{one_line(shortened(name))} lies outside of the folder of the file that names it"
        raise InputError(str(file), reason, "put it into that folder, or the file above both")
    return path


def read_input(
    path: str | os.PathLike[str], limit: int = TEXT_BYTES, prefix: bytes = b"", prefix_limit: int = 0
) -> bytes:
    """The content of a file or pipe of at most `limit` bytes, or `prefix_limit` if it begins with `prefix`.

    Raises InputError for folders, devices (but the null device, which is empty), named pipes and longer files, OSError
    as `open` does.
    """
    check_no_folder(path)
    check_ends(path)
    with open(path, "rb") as file:
        state = os.fstat(file.fileno())
        head = file.read(min(CHUNK_BYTES, limit + 1))
        if prefix and head.startswith(prefix):
            limit = prefix_limit
        if stat.S_ISREG(state.st_mode):
            if state.st_size > limit:
                raise _too_long(path, limit)
            if limit == RECORDING_BYTES:
                check_memory(path, state.st_size)
            file.seek(0)
            data = file.read()  # in one piece: joining chunks takes its size once more
        else:
            chunks, length = [head], len(head)
            while length <= limit and (more := file.read(CHUNK_BYTES)):
                chunks.append(more)
                length += len(more)
            data = b"".join(chunks)
    if len(data) > limit:
        raise _too_long(path, limit)
    return data


_MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))
_NON_ASCII = re.compile(rb"[\x80-\xff]+")


def decode(data: bytes) -> str:
    """Decodes a text file of any program, with the encoding from `encoding_of`."""
    encoding, mark = encoding_of(data)
    return data[mark:].decode(encoding, "replace")


def encoding_of(data: bytes, whole: bool = True) -> tuple[str, int]:
    """UTF-16 or UTF-8 by its mark, else UTF-8, CP936 (Chinese Windows), or CP1252; and the length of the mark.

    Other text is CP936 if its bytes above 7Fh come in pairs: letters of CP1252 are mostly single. If `data` is not the
    `whole` file, its last character may be cut.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return encoding, len(mark)
    with suppress(UnicodeDecodeError):
        codecs.getincrementaldecoder("utf-8")().decode(data, whole)
        return "utf-8", 0
    lengths = [len(run) for run in _NON_ASCII.findall(data)]
    odd = [length for length in lengths if length & 1]
    return ("gb18030" if 2 * len(odd) < len(lengths) else "cp1252"), 0


def check_ends(path: str | os.PathLike[str]) -> None:
    """Refuses an input that may never end before it is opened, because opening a pipe waits for its writer."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return  # `open` says what is wrong
    if (stat.S_ISCHR(mode) or stat.S_ISBLK(mode)) and not os.path.samefile(path, os.devnull):
        raise InputError(str(path), "is a device", "name a file or a pipe")
    if stat.S_ISFIFO(mode) and not os.fspath(path).startswith(_OF_PROCESSES):
        raise InputError(str(path), "is a named pipe, which may never end", "give a file, or <(COMMAND)")


def check_memory(path: str | os.PathLike[str], size: int) -> None:
    """Refuses a recording that needs more memory than available: the system would kill this program, or others."""
    available = available_bytes()
    if available is not None and size * RECORDING_NEEDS > available:
        needed = _in_mb(size * RECORDING_NEEDS)
        reason = f"takes up to {needed} of memory to read, and {_in_mb(available)} are available"
        raise InputError(str(path), reason, "end other programs, or read it on a machine with more")


def available_bytes() -> int | None:
    """Memory that this process may still allocate, in bytes: by the system, its control group and its limits; None if
    unknown.
    """
    amounts = []
    with suppress(OSError, KeyError, ValueError):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        kb = {name: int(value.split()[0]) for name, _, value in (line.partition(":") for line in lines)}
        amounts.append((kb["MemAvailable"] + kb["SwapFree"]) << 10)
    with suppress(OSError, ValueError):
        inner = Path("/proc/self/cgroup").read_text(encoding="utf-8").rpartition("0::/")[2].strip()
        group = Path("/sys/fs/cgroup") / inner
        for folder in (group, *group.parents[: len(Path(inner).parts)]):
            with suppress(OSError, ValueError):  # "max", and the topmost group has no such files
                limit, used = (int((folder / name).read_text()) for name in ("memory.max", "memory.current"))
                amounts.append(limit - used)
    with suppress(ImportError, OSError, ValueError):
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
            amounts.append(limit - pages * resource.getpagesize())
    return max(0, min(amounts)) if amounts else None


def _in_mb(size: int) -> str:
    return f"{size / 1e6:.0f} MB"


def _too_long(path: str | os.PathLike[str], limit: int) -> InputError:
    size = f"{limit >> 20} MiB" if limit >= 1 << 20 else f"{limit >> 10} KiB"
    return InputError(str(path), f"holds more than {size}", "is this the right file?")


def replace_file(path: str | os.PathLike[str], content: bytes) -> None:
    """Puts `content` in the place of whatever is at `path`: old content or new. Raises OSError."""
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
