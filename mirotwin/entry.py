"""Entry point of the `mirotwin` program: at any moment Ctrl-C gives one line and exit code 130.

Loading takes half a second, in which nothing is open yet, so Ctrl-C ends the process at once, even in the middle of an
import. A running command gets KeyboardInterrupt and cleans up (`shell.program`). When its exit code is known everything
is written, and Ctrl-C is ignored: during the interpreter's shutdown an exception would print a traceback.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import time
from _thread import start_new_thread
from types import FrameType

INTERRUPTED = 130
"""Equal to the code in `shell.verdicts`: an import here could be interrupted by Ctrl-C."""
LOADING, RUNNING, ENDED = range(3)

_phase = LOADING


def _on_interrupt(number: int, frame: FrameType | None) -> None:
    if _phase == LOADING:
        _leave()
    if _phase == RUNNING:
        raise KeyboardInterrupt


def _again(ignored: sys.UnraisableHookArgs) -> None:
    """Sends Ctrl-C again if it came within a callback of the interpreter (as in importing), where its exception is
    lost.
    """
    if ignored.exc_type is KeyboardInterrupt:
        start_new_thread(_send, ())
    else:
        sys.__unraisablehook__(ignored)


def _send() -> None:
    time.sleep(0.01)
    signal.raise_signal(signal.SIGINT)


def _leave() -> None:
    """Ends the process without clean-up, as nothing is open, and without an exception, which importing code could
    catch.
    """
    try:  # noqa: SIM105 (contextlib would have to be imported)
        os.write(2, b"mirotwin: interrupted\n")
    except OSError:  # stderr is closed
        pass
    os._exit(INTERRUPTED)


if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored, as under nohup
    signal.signal(signal.SIGINT, _on_interrupt)
    sys.unraisablehook = _again


def main() -> None:
    """Loads the command line, runs it and ends the process."""
    global _phase
    gc.set_threshold(50_000)  # a program makes little garbage: looking for it took 6 % of a report
    from mirotwin.commands import main as command

    try:
        _phase = RUNNING
        try:
            command()
        finally:
            _phase = ENDED
            gc.freeze()  # the interpreter would look through all of it once more: a sixth of a short run
            if signal.getsignal(signal.SIGINT) is _on_interrupt:
                # In its last moments the interpreter takes handlers away, and would end by the signal.
                signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:  # outside of what the command guards: nothing is open
        _leave()
    sys.exit(0)
