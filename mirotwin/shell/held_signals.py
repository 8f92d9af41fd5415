"""Delays Ctrl-C, SIGTERM and SIGHUP while files are written that an exception would damage."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")


class Hold:
    """Signals wait within `with hold:`, which may be nested; `with hold.released():` lets them through again.

    One that has waited raises when the outermost block is left, unless that is left by an exception.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._waiting: int | None = None
        self._handlers: dict[int, Callable[[int, FrameType | None], Any]] = {}

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

    def install(self) -> None:
        """Takes the place of the handlers in Python; signals that are ignored or end the process stay as they are."""
        if threading.current_thread() is not threading.main_thread():
            return
        for name in NAMES:
            number = getattr(signal, name, None)  # not every system has all
            handler = None if number is None else signal.getsignal(number)
            if number is not None and callable(handler) and not isinstance(handler, signal.Handlers):
                self._handlers[number] = handler
                signal.signal(number, self._take)

    def remove(self) -> None:
        """Puts back the handlers from before."""
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    def _take(self, number: int, frame: FrameType | None) -> None:
        if self._depth:
            self._waiting = self._waiting or number
        else:
            self._handlers[number](number, frame)

    def _deliver(self) -> None:
        if self._waiting is not None and not self._depth:
            number, self._waiting = self._waiting, None
            self._handlers[number](number, None)


@contextmanager
def held_signals() -> Iterator[Hold]:
    """A Hold whose outermost block is this one."""
    hold = Hold()
    hold.install()
    try:
        with hold:
            yield hold
    finally:
        hold.remove()
