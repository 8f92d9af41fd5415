"""Programs that tests start: each begins with the default action of every signal, whichever program started the tests.

A shell that puts a job in the background without job control leaves SIGINT ignored, and `nohup` does so with SIGHUP.
Children inherit that, and `restore_signals` of `subprocess` does not undo it. Python installs no handler for a SIGINT
that is ignored: a child that a test interrupts then runs to its end. So the signals are reset in the child, before its
program begins. The process that runs the tests keeps what it was given.

A child with a `preexec_fn` writes no bytecode: a limit on the length of files would cut it short, and Python takes what
is left for a whole module's.
"""

import os
import signal
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[1]
SIGNALS = ("SIGINT", "SIGHUP", "SIGTERM", "SIGQUIT")


def reset_signals():
    """Gives this process the default action of the signals that a user or a shell sends."""
    for name in SIGNALS:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)


def run(command, **named):
    """`subprocess.run`, with default signals."""
    return subprocess.run(command, **_with_reset(named))


def start(command, **named):
    """`subprocess.Popen`, with default signals."""
    return subprocess.Popen(command, **_with_reset(named))


def uncompiled(code):
    """What this code prints in a process that runs the sources instead of compiled modules."""
    code = f"from miro_exact import engine; engine.select('python'); {code}"
    command = [sys.executable, "-c", code]
    return run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout


def same_uncompiled(call):
    """Whether the text that this function of a module gives is the same uncompiled; true where nothing is compiled."""
    from miro_exact import engine  # builders of packages, which start children too, need not have it

    if engine.active() == "python":
        return True
    code = f"from {call.__module__} import {call.__name__}; print({call.__name__}())"
    return uncompiled(code).strip() == call()


def pool(count=None):
    """`ProcessPoolExecutor`, with default signals."""
    return ProcessPoolExecutor(count, initializer=reset_signals)


def fork():
    """`os.fork`, with default signals in the child."""
    process = os.fork()
    if process == 0:
        reset_signals()
    return process


def _with_reset(named):
    if os.name != "posix":
        return named  # no preexec_fn there, and none of the shells in question
    before = named.get("preexec_fn")

    def prepare():
        reset_signals()
        if before is not None:
            before()

    if before is not None:
        named = {**named, "env": {**(named.get("env") or os.environ), "PYTHONDONTWRITEBYTECODE": "1"}}
    return {**named, "preexec_fn": prepare}
