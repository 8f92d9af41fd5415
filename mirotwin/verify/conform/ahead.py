"""A second process that tries every second rule, where Linux has a core for it.

A trial depends on its rule, the image and the seed alone, so the verdicts are those of one process, and they come in
the same order. The second process does not know what fails in the first: it tries rules that are then not judged, too.
What it does not tell, because it was ended, is tried by the first.
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from mirotwin.verify.conform.rule import Rule
    from mirotwin.verify.conform.run import Outcome

FEWEST = 10
"""Rules for which a process is worth starting."""


def has_core() -> bool:
    """Whether a second process would have one. A process with threads is not forked: their locks would stay locked."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    return cores > 1 and threading.active_count() == 1


@contextmanager
def tried_ahead(
    rules: Sequence[Rule], tried: Callable[[Rule], Outcome]
) -> Iterator[Callable[[Rule], Outcome]]:
    """`tried`, for all or some of `rules` in this order; a second process does every second of them."""
    if len(rules) < FEWEST or not has_core():
        yield tried
        return
    theirs = rules[::2]
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        _tell(theirs, tried, reading, writing)
    os.close(writing)
    ids = {rule.id for rule in theirs}

    def taken(rule: Rule) -> Outcome:
        try:
            while rule.id in ids:
                outcome: Outcome = pickle.load(told)
                if outcome.rule == rule.id:
                    return outcome
        except (EOFError, pickle.UnpicklingError):
            ids.clear()
        return tried(rule)

    try:
        with open(reading, "rb") as told:
            yield taken
    finally:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)


def _tell(rules: Sequence[Rule], tried: Callable[[Rule], Outcome], reading: int, writing: int) -> NoReturn:
    """The second process. It ends when its outcomes have no reader, as after a signal that the first one got."""
    try:
        os.close(reading)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        with open(writing, "wb") as pipe:
            for rule in rules:
                pickle.dump(tried(rule), pipe)
                pipe.flush()
    finally:
        os._exit(0)
