"""A port as a pseudo-terminal, which programs open like /dev/ttyUSB0.

The kernel reports only whether anybody has it open, not how many: two programs that open it share the received bytes,
as on a real port. It is raw, without echo, at 9600 baud or at the rate of the board's file, and made so again whenever
it was closed; a terminal accepts any baud rate, and one that differs from the line's is reported once. Bytes that a
program has not read when it closes are lost.
"""

from __future__ import annotations

import os
import select
from contextlib import suppress
from pathlib import Path
from typing import Any

from miro_exact.bad_input import BadInput
from mirotwin.ports.endpoint import CHUNK_BYTES, Endpoint, PortContext

SOMEBODY = "a program"
RATES = (
    300,
    600,
    1200,
    1800,
    2400,
    4800,
    9600,
    19200,
    38400,
    57600,
    115200,
    230400,
    460800,
    500000,
    576000,
    921600,
)
"""Baud rates that a terminal supports."""


class PtyEndpoint(Endpoint):
    """`link`: a symbolic link that is made to it, None for none. Raises BadInput where either cannot be had.

    `force`: replaces a link to a terminal; one that leads nowhere is replaced anyway. A session that was killed leaves
    its link, and the kernel may have given the terminal's number to another program. A link that a living session
    serves is never replaced: that one holds the lock of `.NAME.lock` beside it.
    """

    kind = "pty"

    def __init__(self, context: PortContext, link: Path | None, force: bool = False) -> None:
        try:
            import termios
            import tty
        except ImportError:
            raise BadInput("--pty", "", "there are no pseudo-terminals on this system", "use --tcp") from None
        self._termios: Any = termios
        self._tty: Any = tty
        self._rates = {getattr(termios, f"B{baud}"): baud for baud in RATES if hasattr(termios, f"B{baud}")}
        self._default_rate = getattr(termios, f"B{context.port.baud}", 0)
        self._master, slave = os.openpty()
        self.path = os.ttyname(slave)
        os.set_blocking(self._master, False)
        self._make_raw()
        os.close(slave)
        self._link: Path | None = None
        self._lock: int | None = None
        if link is not None:
            self._make_link(link, force)
        super().__init__(context, self.path if link is None else f"{link}")
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)

    @property
    def baud(self) -> int:
        """The rate that a program has set. 0: no program has set one, and the terminal began with another rate."""
        rate = self._termios.tcgetattr(self._master)[5]
        if not self._default_rate and rate == self._termios.B9600:
            return 0
        return self._rates.get(rate, 0)

    def _make_raw(self) -> None:
        self._tty.setraw(self._master)
        modes = self._termios.tcgetattr(self._master)
        modes[4] = modes[5] = self._default_rate or self._termios.B9600
        self._termios.tcsetattr(self._master, self._termios.TCSANOW, modes)

    def _make_link(self, link: Path, force: bool) -> None:
        try:
            self._lock = _locked(_lock_of(link))
            ours = force and link.is_symlink() and os.path.dirname(os.readlink(link)) == "/dev/pts"
            if link.is_symlink() and (ours or not link.exists()):
                link.unlink()
            link.symlink_to(self.path)
        except OSError as error:
            os.close(self._master)
            if self._lock is not None:
                _unlock(link, self._lock)
            reason = (
                "is there already" if isinstance(error, FileExistsError) else f"{error.strerror or error}"
            )
            remedy = "choose another link with --pty, or replace a link to a terminal with --force"
            if isinstance(error, BlockingIOError):
                reason, remedy = (
                    "another session serves it",
                    "end that one, or choose another link with --pty",
                )
            raise BadInput(link, "", reason, remedy) from None
        self._link = link

    def receive(self) -> bytes:
        events, data = dict(self._poll.poll(0)).get(self._master, 0), b""
        if events & select.POLLIN and self.port.room:
            with suppress(BlockingIOError, OSError):
                data = os.read(self._master, min(CHUNK_BYTES, self.port.room))
        is_open = not events & select.POLLHUP
        was_there = bool(self.client)
        if not was_there and (data or is_open):
            self.has_come(SOMEBODY)
        if was_there and not is_open and not events & select.POLLIN:
            self._hang_up()
        self._watch()
        return data

    def _hang_up(self) -> None:
        self._watch(leave=True)
        self.has_gone()
        self._termios.tcflush(self._master, self._termios.TCIOFLUSH)
        self._make_raw()

    def push(self) -> None:
        if not self.client or not self.out:
            return
        with suppress(BlockingIOError, OSError):  # nobody has it open any more, which `receive` notices
            count = os.write(self._master, self.out.data[:CHUNK_BYTES])
            self.bytes_out += count
            self.out.take(count)
        self._watch()

    def close(self) -> None:
        self._watch(leave=True)
        if self.client:
            self.has_gone("is left: the session ends")
        if self._link is not None and self._lock is not None:
            if self._link.is_symlink() and os.readlink(self._link) == self.path:
                self._link.unlink()
            _unlock(self._link, self._lock)
        os.close(self._master)

    def _watch(self, leave: bool = False) -> None:
        """Lets the selector wake for the terminal while somebody has it open: a closed one would never let it sleep."""
        looks = bool(self.client) and not leave
        self.watch(self._master, looks and self.port.room > 0, looks and len(self.out) > 0)


def _lock_of(link: Path) -> Path:
    return link.with_name(f".{link.name}.lock")


def _locked(path: Path) -> int:
    """The descriptor that holds the lock; it is free once that is closed or the process is gone.

    Raises BlockingIOError where another process has it.
    """
    import fcntl

    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            raise
        if os.fstat(descriptor).st_nlink:
            return descriptor
        os.close(descriptor)  # the session that had it removed the file meanwhile


def _unlock(link: Path, descriptor: int) -> None:
    _lock_of(link).unlink(missing_ok=True)
    os.close(descriptor)
