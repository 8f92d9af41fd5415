"""pytest sessions as a user runs them: a folder with tests of its own, and pytest in another process."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

from tests import children

HEAD = """
import pytest
from mirotwin import ServiceFrame, TeamFrame, Telemetry, conditions, ms, us
"""


def session(folder: Path, *arguments: object, tests: str = "") -> subprocess.CompletedProcess[str]:
    """`tests`: the content of `test_mine.py`, whose imports are there already; "" for what stands there."""
    if tests:
        (folder / "test_mine.py").write_text(HEAD + tests)
    if not (folder / "pytest.ini").exists():
        (folder / "pytest.ini").write_text("[pytest]\n")
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *map(str, arguments)]
    return children.run(command, cwd=folder, capture_output=True, text=True)


def run(folder: Path, line: str) -> subprocess.CompletedProcess[str]:
    """A line that a report printed, in the same folder."""
    program, *words = shlex.split(line)
    starts = {"pytest": ["-m", "pytest"], "mirotwin": ["-c", "from mirotwin.entry import main; main()"]}
    command = [sys.executable, *starts[program], *words]
    return children.run(command, cwd=folder, capture_output=True, text=True)
