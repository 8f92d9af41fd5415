"""Ctrl-C at any moment: one line and exit code 130, or the whole result if it came too late; never a traceback."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests import children

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
MARK = b"started\n"
PROGRAM = (
    "import sys, os; import mirotwin.entry as entry; os.write(2, b'started\\n'); sys.argv[0] = 'mirotwin';"
    "entry.main()"
)
LONGEST_S = 1.2


def interrupted(delay_s, *words, program=PROGRAM):
    """Exit code, stdout and stderr of the program, which is interrupted so long after our first line of code ran."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "env": ENVIRONMENT}
    with children.start([sys.executable, "-c", program, *words], **pipes) as process:
        assert process.stderr.readline() == MARK
        time.sleep(delay_s)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    return process.returncode, out, err


def moments(count, seed):
    draw = random.Random(seed)
    return [draw.uniform(0.0, LONGEST_S) for _ in range(count)]


def check(code, out, err):
    if code == 0:
        assert err == b""
        assert out.endswith(b"bytes of 8192\n")
    else:
        assert code == 130
        assert err.strip() == b"mirotwin: interrupted"


@pytest.mark.parametrize("delay_s", moments(8, 1))
def test_ctrl_c_is_one_line_at_any_moment(delay_s):
    check(*interrupted(delay_s, "info"))


def test_ctrl_c_while_modules_are_loaded_ends_the_program_at_once():
    assert interrupted(0.0, "info") == (130, b"", b"mirotwin: interrupted\n")


IN_A_CALLBACK = """
import signal, time, weakref
import mirotwin.commands, mirotwin.entry

class Module: pass

def command():
    module = Module()
    lock = weakref.ref(module, lambda _: signal.raise_signal(signal.SIGINT))
    del module
    time.sleep(20)
    print("went on")

mirotwin.commands.main = command
mirotwin.entry.main()
"""


def test_ctrl_c_in_a_callback_of_the_interpreter_ends_the_program_after_it():
    found = children.run([sys.executable, "-c", IN_A_CALLBACK], capture_output=True, env=ENVIRONMENT)
    assert (found.returncode, found.stdout, found.stderr) == (130, b"", b"mirotwin: interrupted\n")


def test_a_program_that_was_started_with_ctrl_c_ignored_ignores_it():
    ignoring = f"import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); {PROGRAM}"
    code, out, err = interrupted(0.0, "--version", program=ignoring)
    assert (code, err) == (0, b"")
    assert out.startswith(b"mirotwin, version")


if __name__ == "__main__":  # python -m tests.mirotwin.shell.test_interrupt: 200 moments
    ends = {}
    for moment in moments(200, 2):
        ended = interrupted(moment, "info")
        check(*ended)
        ends[ended[0]] = ends.get(ended[0], 0) + 1
    print(ends)
