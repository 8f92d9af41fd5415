"""The house rules: ruff, mypy --strict, the layering contract, and the length of files."""

import re
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


FOLDERS = ("exact", "protocol", "robot_fw", "host", "sim", "benchmarks", "examples", "tests")
SOURCES = sorted(
    path
    for folder in FOLDERS
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".py", ".pxd", ".pyx", ".c", ".h")
)
MOST_LINES = 500
LONG_LINES = 300


HEAD = re.compile(r'"""(.*?)"""|/\*(.*?)\*/|(?:#[^\n]*\n)+', re.DOTALL)


def head(source: str) -> str:
    """The docstring or comment that a source file opens with, as one line."""
    found = HEAD.match(source)
    return " ".join(found[0].split()) if found else ""


def objection(source: str) -> str | None:
    """What the house rules have against the length of a file."""
    lines = len(source.splitlines())
    if lines > MOST_LINES:
        return f"{lines} lines, {MOST_LINES} are allowed: split it"
    if lines > LONG_LINES and "Long because " not in head(source):
        return f'{lines} lines, more than {LONG_LINES}: split it, or give the reason in its head ("Long because ..")'
    return None


def test_a_long_file_gives_the_reason_in_its_head_and_none_is_longer_than_500_lines():
    found = {str(path.relative_to(ROOT)): objection(path.read_text()) for path in SOURCES}
    assert not {path: what for path, what in found.items() if what}
    assert len(found) > 400


@pytest.mark.parametrize(
    ("opening", "lines", "refused"),
    [
        ("x = 1", 300, None),
        ("x = 1", 301, "give the reason"),
        ('"""A table.\n\nLong because it has a row an opcode.\n"""', 497, None),
        ('"""A table.\n\nLong because it has a row an opcode.\n"""', 498, "split it"),
        ("/* A table. Long\n   because it has a row an opcode. */", 300, None),
        ('x = 1\n"""Long because it is not in the head."""', 300, "give the reason"),
    ],
)
def test_what_is_said_about_the_length_of_a_file(opening, lines, refused):
    said = objection(opening + "\n" + "y = 2\n" * (lines - 1))
    assert refused in said if refused else said is None
