"""The target process: one machine behind AFL++'s fork-server protocol. It never forks.

    python -m mirotwin.fuzz.afl.serve SPECIFICATION [BESIDE]

SPECIFICATION is the JSON of a `TargetSpec`. BESIDE is a path without suffix: `BESIDE.target` gets error messages,
`BESIDE.counts` the number of inputs run (`engine.counter`).

AFL++ expects a server that forks a child for each input, and tells its process id and its wait status. Here the target
restores its own state instead. It reports an id that no process has, because AFL++ kills that process when an answer
takes too long. The wait status is 0, or a signal number for a crash. AFL++ reads the id without a limit of time, so
both are written at once at the end: AFL++ is woken once per input instead of twice, and a slow target is not taken for
a hang. Real hangs are failures that the target reports itself, as it limits virtual time.

The four bytes at the start (`FS_OPT_..` in AFL++ 4's types.h) mean: options are used, the size of the map, and test
cases come through shared memory (a length of 4 bytes, then the bytes).
"""

from __future__ import annotations

import ctypes
import os
import signal
import struct
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from miro_exact.bad_input import BadInput
from mirotwin.fuzz.engine import counter
from mirotwin.fuzz.making import make_target
from mirotwin.fuzz.spec import spec_of
from mirotwin.shell.processes import end_with_parent

if TYPE_CHECKING:
    from mirotwin.fuzz.target import Target

_FAILED = ctypes.c_void_p(-1).value


def attach(number: int, size: int) -> memoryview:
    """The first `size` bytes of a shared memory segment, writable.

    Raises OSError if there is no segment of this number.
    """
    library = ctypes.CDLL(None, use_errno=True)
    library.shmat.restype = ctypes.c_void_p
    library.shmat.argtypes = (ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
    address = library.shmat(number, None, 0)
    if address == _FAILED:
        code = ctypes.get_errno()
        raise OSError(code, f"shared memory {number}: {os.strerror(code)}")
    return memoryview((ctypes.c_ubyte * size).from_address(address)).cast("B")


CONTROL_FD, STATUS_FD = 198, 199
MAP_VARIABLE, CASES_VARIABLE = "__AFL_SHM_ID", "__AFL_SHM_FUZZ_ID"

ENABLED, MAP_SIZE_FOLLOWS, CASES_IN_SHARED_MEMORY = 0x8000_0001, 0x4000_0000, 0x0100_0000
CASES_BYTES = 4 + (1 << 20)
"""Size of the shared memory for a test case: its length, then up to AFL++'s largest input (MAX_FILE of its
config.h).
"""
NO_PROCESS = 0x7FFF_FFFE
"""Above the highest process id of Linux (2^22)."""

FIRST_SIGNAL, LAST_SIGNAL = 33, 126
"""Signals that encode the failure kinds 1, 2, ..; none of them kills a program by accident."""

NOTHING, FOUND, REFUSED, BROKEN = 0, 1, 2, 70
"""Exit codes. AFL++ does not see them: it ends a server by a signal."""
RUNS_A_COUNT = 64
"""Executions after which the counters are written again."""


def wait_status(kind: int) -> int:
    """The status that AFL++ receives for a run of this `kind`: 0, or a signal, the number in a crash's file name."""
    return min(FIRST_SIGNAL + kind - 1, LAST_SIGNAL) if kind else 0


def hello(map_size: int) -> bytes:
    """The server's first message."""
    options = ENABLED | MAP_SIZE_FOLLOWS | CASES_IN_SHARED_MEMORY | (map_size - 1) << 1
    return struct.pack("<I", options)


def answer(target: Target, cases: memoryview, control: int, status: int, keep: Callable[[int], None]) -> None:
    """Runs the inputs that AFL++ puts into `cases` until it closes `control`. `keep` gets the executions at times."""
    length, data = cases[:4].cast("I"), cases[4:]
    answers = [struct.pack("<II", NO_PROCESS, wait_status(kind)) for kind in range(256)]
    run, read, write = target.run, os.read, os.write
    while True:
        for _ in range(RUNS_A_COUNT):
            if not read(control, 4):
                return
            write(status, answers[run(data[: length[0]])])
        keep(target.executions)


def serve(target: Target, keep: Callable[[int], None]) -> bool:
    """Serves AFL++ until it ends; False when there is none."""
    if MAP_VARIABLE in os.environ:
        target.use_map(attach(int(os.environ[MAP_VARIABLE]), target.map_size))
    if not _is_writable(STATUS_FD):
        return False
    if MAP_VARIABLE not in os.environ:
        raise BadInput("AFL++", "", f"{MAP_VARIABLE} is not set", "start this program by afl-fuzz")
    with suppress(BrokenPipeError):  # AFL++ has ended
        os.write(STATUS_FD, hello(target.map_size))
        if not os.read(CONTROL_FD, 4):
            return True
        if CASES_VARIABLE not in os.environ:
            raise BadInput("AFL++", "", f"{CASES_VARIABLE} is not set", "install AFL++ 4.00c or newer")
        cases = attach(int(os.environ[CASES_VARIABLE]), CASES_BYTES)
        answer(target, cases, CONTROL_FD, STATUS_FD, keep)
    return True


def _is_writable(number: int) -> bool:
    try:
        return os.write(number, b"") == 0
    except OSError:
        return False


def run_once(target: Target, data: bytes) -> int:
    """Runs one input for a person: prints the failure, and the input as lines. Returns the exit code."""
    if not target.run(data):
        print("nothing found")
        return NOTHING
    failure = target.failure
    print(
        f"{failure.check}: {failure.what} (tick {failure.tick}, PC {failure.pc:#06x})" if failure else "found"
    )
    print(target.describe(data))
    return FOUND


def main(arguments: Sequence[str]) -> int:
    """The process: returns its exit code."""
    beside = arguments[1] if len(arguments) > 1 else ""
    try:
        target = make_target(spec_of(arguments[0]))
        if serve(target, counter(Path(f"{beside}.counts")) if beside else lambda executions: None):
            return NOTHING
        return run_once(target, sys.stdin.buffer.read())
    except BadInput as error:
        _complain(beside, f"{error}")
        return REFUSED
    except Exception:  # AFL++ shows nothing of it, and says only that its server is gone
        _complain(beside, traceback.format_exc())
        return BROKEN


def _complain(beside: str, text: str) -> None:
    print(text, file=sys.stderr)
    if beside:
        Path(f"{beside}.target").write_text(text, encoding="utf-8", errors="backslashreplace")


if __name__ == "__main__":
    if _is_writable(STATUS_FD):
        end_with_parent(signal.SIGKILL)
    sys.exit(main(sys.argv[1:]))
