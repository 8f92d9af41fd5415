"""Delays Ctrl-C, SIGTERM and SIGHUP while files are written that an exception would damage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType

from mirotwin.shell.program import Handler, handled_signals

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")


class Hold:
    """Delays signals within `with hold:`, which may be nested; `with hold.released():` lets them through again. A
    delayed signal raises at the end of the outermost block, unless that block ends with an exception.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._waiting: int | None = None
        self.handlers: dict[int, Handler] = {}
        """Of signals that are let through."""

    def __enter__(self) -> Hold:
        self._depth += 1
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._depth -= 1
        if kind is None:
            self._deliver()

    @contextmanager
    def released(self) -> Iterator[None]:
        """Within this block, signals raise immediately."""
        depth, self._depth = self._depth, 0
        try:
            self._deliver()
            yield
        finally:
            self._depth = depth

    def take(self, number: int, frame: FrameType | None) -> None:
        if self._depth:
            self._waiting = self._waiting or number
        else:
            self.handlers[number](number, frame)

    def _deliver(self) -> None:
        if self._waiting is not None and not self._depth:
            number, self._waiting = self._waiting, None
            self.handlers[number](number, None)


@contextmanager
def held_signals() -> Iterator[Hold]:
    """A Hold whose outermost block is this one; ignored signals and signals that end the process are not changed."""
    hold = Hold()
    with hold, handled_signals(NAMES, hold.take, callable) as hold.handlers:
        yield hold
