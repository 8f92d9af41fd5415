"""The tools that hold the house rules: ruff, mypy --strict, and the layering contract."""

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


def test_no_source_file_is_longer_than_500_lines():
    sources = [
        path
        for folder in ("exact", "protocol", "robot_fw", "host", "sim", "tools", "tests")
        for path in (ROOT / folder).rglob("*")
    ]
    long = {
        str(path.relative_to(ROOT)): lines
        for path in sources
        if path.suffix in (".py", ".pxd", ".c", ".h") and (lines := len(path.read_text().splitlines())) > 500
    }
    assert not long
