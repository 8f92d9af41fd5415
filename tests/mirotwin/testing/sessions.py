"""pytest sessions as a user runs them: a folder with tests of its own, and pytest there."""

import contextlib
import io
import os
import shlex
import sys
from typing import NamedTuple

import pytest

from tests import children
from tests.mirotwin.program import mirotwin

HEAD = """
import pytest
from mirotwin import ServiceFrame, TeamFrame, Telemetry, conditions, ms, us
"""


PLAIN = ["-p", "no:hypothesispytest"]
"""Options of each session: Hypothesis' plug-in takes as long to load as all else, and no session draws."""


class Done(NamedTuple):
    """What came of a command."""

    returncode: int
    stdout: str
    stderr: str


def session(folder, *arguments, tests="", child=False):
    """`tests`: the content of `test_mine.py`, whose imports are there already; "" for what stands there.

    It runs in this process, or with `child` in one of its own: where its modules or its workers matter.
    """
    if tests:
        (folder / "test_mine.py").write_text(HEAD + tests)
    if not (folder / "pytest.ini").exists():
        (folder / "pytest.ini").write_text("[pytest]\naddopts = -p no:cacheprovider\n")
    words = [*PLAIN, *map(str, arguments)]
    if not child:
        return _in_this_process(folder, words)
    done = children.run([sys.executable, "-m", "pytest", *words], cwd=folder, capture_output=True, text=True)
    return Done(done.returncode, done.stdout, done.stderr)


def _in_this_process(folder, words):
    """The modules of the folder are forgotten afterwards."""
    out, err = io.StringIO(), io.StringIO()
    path, environment = list(sys.path), dict(os.environ)
    with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = pytest.main(["-W", "ignore::pytest.PytestAssertRewriteWarning", *words])
    sys.path[:] = path
    os.environ.update(environment)
    for name, module in list(sys.modules.items()):
        if f"{getattr(module, '__file__', None)}".startswith(f"{folder}{os.sep}"):
            del sys.modules[name]
    return Done(int(code), out.getvalue(), err.getvalue())


def run(folder, line):
    """A line that a report printed, in the same folder."""
    program, *words = shlex.split(line)
    if program == "pytest":
        return _in_this_process(folder, words)
    assert program == "mirotwin"
    with contextlib.chdir(folder):
        return Done(*mirotwin(*words))
