"""The house rules: ruff, mypy --strict, the layering contract, and the length of files."""

import sys
from pathlib import Path

import pytest

from tests import children

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent


@pytest.mark.parametrize(
    "command",
    [
        ["ruff", "check", "."],
        ["ruff", "format", "--check", "."],
        ["mypy"],
        ["lint-imports", "--no-cache"],
    ],
    ids=lambda command: " ".join(command),
)
def test_the_tree_passes(command):
    done = children.run([BIN / command[0], *command[1:]], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


FOLDERS = ("exact", "protocol", "robot_fw", "host", "sim", "mirotwin", "benchmarks", "examples", "tests")
SOURCES = sorted(
    path
    for folder in FOLDERS
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".py", ".pxd", ".pyx", ".c", ".h")
)
MOST_LINES = 800


def objection(source: str) -> str | None:
    """What the house rules have against the length of a file."""
    lines = len(source.splitlines())
    return f"{lines} lines, {MOST_LINES} are allowed: split it" if lines > MOST_LINES else None


def test_no_file_is_longer_than_800_lines():
    found = {str(path.relative_to(ROOT)): objection(path.read_text()) for path in SOURCES}
    assert not {path: what for path, what in found.items() if what}
    assert len(found) > 400


@pytest.mark.parametrize(("lines", "refused"), [(800, None), (801, "801 lines, 800 are allowed: split it")])
def test_what_is_said_about_the_length_of_a_file(lines, refused):
    assert objection("y = 2\n" * lines) == refused
