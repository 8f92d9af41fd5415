"""One job of a campaign: an afl-fuzz, its target process, the files that they write, and why it ended."""

from __future__ import annotations

import mmap
import os
import re
import signal
import struct
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.afl.settings import end_with_parent

PATIENCE_S = 10.0
"""Time for afl-fuzz to write its last files after a SIGINT."""

LOG_BYTES = 1 << 20
"""A log is emptied when it is longer: afl-fuzz writes a line for each input that it takes up."""


class AflJob:
    """A job by the name `name` in the folder `out`."""

    def __init__(self, out: Path, name: str) -> None:
        self.name = name
        self.folder = out / name
        self.log = out / f"{name}.log"
        self.complaint = out / f"{name}.target"
        self._counts = out / f"{name}.counts"
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False

    def start(self, line: Sequence[str], environment: Mapping[str, str], core: int | None) -> None:
        """Starts afl-fuzz, bound to `core`. It gets no Ctrl-C of a terminal, and ends with this process."""

        def prepare() -> None:
            end_with_parent(signal.SIGINT)
            if core is not None:
                os.sched_setaffinity(0, {core})

        self.complaint.unlink(missing_ok=True)
        number = os.open(self.log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o666)
        with os.fdopen(number, "wb") as log:
            try:
                self._process = subprocess.Popen(
                    line,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                    env=environment,
                    start_new_session=True,
                    preexec_fn=prepare,
                )
            except OSError as error:
                raise BadInput(line[0], "", error.strerror or f"{error}", "install AFL++ again") from None

    @property
    def process(self) -> int:
        """Process id of its afl-fuzz, 0 before it has begun."""
        return 0 if self._process is None else self._process.pid

    @property
    def running(self) -> bool:
        """Has it begun and not ended? Raises BadInput when afl-fuzz ended with an error."""
        if self._process is None or self._stopped:
            return False
        code = self._process.poll()
        if code:
            raise why_ended(self.log, self.complaint)
        return code is None

    def interrupt(self) -> None:
        """Tells afl-fuzz to end."""
        self._stopped = True
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)

    def wait(self) -> None:
        """Waits until it has ended; one that does not end is killed, and its target with it."""
        if self._process is None:
            return
        try:
            self._process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def shorten_log(self) -> None:
        """Empties a log that has become long."""
        if self.log.exists() and self.log.stat().st_size > LOG_BYTES:
            os.truncate(self.log, 0)  # it is open for appending: the next line is its first

    def executions(self) -> int:
        """How many inputs the target has run, as it says."""
        return read_executions(self._counts)

    def inputs(self, kind: str, jobs: Sequence[str]) -> list[Path]:
        """Inputs that it has left in `queue` or `crashes`, by number, without those taken over from one of `jobs`."""
        try:
            names = sorted(os.listdir(self.folder / kind))
        except (FileNotFoundError, NotADirectoryError):
            return []
        return [self.folder / kind / name for name in names if _is_own(name, jobs)]


def _is_own(name: str, jobs: Sequence[str]) -> bool:
    """Is this the name of an input (`id:000003,sync:main,src:000002`) that no job of the campaign has already?"""
    parts = name.split(",")
    return parts[0].startswith("id:") and not any(f"sync:{job}" in parts for job in jobs)


_FORM = struct.Struct("<Q")


class Counts:
    """Of a target process, the file at `path`: how many inputs it has run. Nothing is kept where `path` is None.

    The file is mapped into memory: writing costs no system call, and what was written survives the process.
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

    def __exit__(self, *raised: object) -> None:
        if self._memory is not None:
            self._memory.close()


def read_executions(path: Path) -> int:
    """The number at `path`; 0 where there is no such file, or none that is whole."""
    try:
        content = path.read_bytes()
    except OSError:
        return 0
    return int(_FORM.unpack(content)[0]) if len(content) == _FORM.size else 0


_COLOUR = re.compile(r"\x1b(\[[0-9;?]*[a-zA-Z]|[()].)")
_ABORT = re.compile(r"\[-\]\s+(?:PROGRAM ABORT|SYSTEM ERROR) : (.*)")
_REASON = re.compile(r"OS message : (.*)")

REMEDIES = (
    (
        "valid input seed that does not crash",
        "each seed fails by itself: these are crashes; give one that does not",
    ),
    ("No usable test cases", "give a folder with at least one file that is not empty"),
    ("no test cases", "give a folder with at least one file that is not empty"),
    ("core_pattern", "run `echo core | sudo tee /proc/sys/kernel/core_pattern`"),
    ("CPU scaling", "set AFL_SKIP_CPUFREQ=1"),
    ("free CPU cores", "give fewer --jobs, or end other programs that are bound to cores"),
    ("' is in use", "another campaign runs in this folder: end it, or choose another one"),
    ("shmget", "segments of killed programs may fill the limit: see `ipcs -m`, remove them with `ipcrm`"),
    ("initializing fork server", "the target took too long to start: give fewer --jobs"),
    ("cleanup failed", "something in it is not afl-fuzz's: choose another folder"),
    ("Unable to create", "choose a folder that can be written to"),
    ("Unable to open", "choose a folder that can be read"),
)
"""A part of afl-fuzz's line -> what to do about it. The first that fits counts."""

_ELSE = "its whole output is in the file named first"


def why_ended(log: Path, target: Path) -> BadInput:
    """What is to be told of an afl-fuzz that ended by itself with an error.

    `log` is its output. `target` is what the target process complained of, if it did: that is the cause then.
    """
    own = _read(target).strip().splitlines()
    if own:
        return BadInput(target, len(own), own[-1], "" if len(own) == 1 else f"whole text: {target}")
    text = _COLOUR.sub("", _read(log))
    found = list(_ABORT.finditer(text))
    if not found:
        last = next((line for line in reversed(text.splitlines()) if line.strip()), "it said nothing")
        return BadInput(log, "", f"afl-fuzz ended: {last.strip()}", _ELSE)
    line = found[-1][1].strip()
    reason = _REASON.search(text, found[-1].end())
    said = f"{line} ({reason[1].strip()})" if reason else line
    remedy = next((what for part, what in REMEDIES if part in said), _ELSE)
    return BadInput(log, "", f"afl-fuzz ended: {said}", remedy)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return ""
