"""One job of a campaign: an afl-fuzz, its target process, and the folder that they write."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.afl.counts import read_executions
from mirotwin.fuzz.afl.ending import why_ended
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
