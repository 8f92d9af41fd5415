"""The edge of a campaign: the wall clock, and the end of a process whose parent has ended."""

from __future__ import annotations

import os
import threading
import time
from multiprocessing import parent_process


def now_s() -> float:
    """Seconds since some moment; only differences mean anything."""
    return time.perf_counter()


def end_with_parent() -> None:
    """Ends this process when its parent does: it would wait for jobs for ever if that was killed."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
