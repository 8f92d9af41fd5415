"""Delays Ctrl-C, SIGTERM and SIGHUP while files are written that an exception would damage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType

from mirotwin.shell.program import Handler, handled_signals

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")


class Hold:
    """Signals wait within `with hold:`, which may be nested; `with hold.released():` lets them through again.

    One that has waited raises when the outermost block is left, unless that is left by an exception.
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
        """Within it, signals raise where the program stands."""
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
    """A Hold whose outermost block is this one; signals that are ignored or end the process stay as they are."""
    hold = Hold()
    with hold, handled_signals(NAMES, hold.take, callable) as hold.handlers:
        yield hold
