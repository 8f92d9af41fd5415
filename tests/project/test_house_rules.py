"""The house rules: ruff, mypy --strict, layers, the length of files, tests without types, indices that compile."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

from tests import children

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent


@pytest.mark.parametrize(
    "command",
    [["ruff", "check", "."], ["ruff", "format", "--check", "."], ["mypy"], ["lint-imports", "--no-cache"]],
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


def problem(source):
    """What the house rules have against the length of a file."""
    lines = len(source.splitlines())
    return f"{lines} lines, {MOST_LINES} are allowed: split it" if lines > MOST_LINES else None


def test_no_file_is_longer_than_800_lines():
    found = {str(path.relative_to(ROOT)): problem(path.read_text()) for path in SOURCES}
    assert not {path: what for path, what in found.items() if what}
    assert len(found) > 400


@pytest.mark.parametrize(("lines", "refused"), [(800, None), (801, "801 lines, 800 are allowed: split it")])
def test_what_is_said_about_the_length_of_a_file(lines, refused):
    assert problem("y = 2\n" * lines) == refused


LAYERS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
FLOORS = {
    room.strip(): floor
    for contract in LAYERS
    if contract.get("containers") == ["mirotwin"]
    for floor, rooms in enumerate(reversed(contract["layers"]))
    for room in rooms.split("|")
}


def higher_rooms(source, room):
    """The rooms on the same floor as `room` or above it that a text of the source names as a module."""
    texts = [
        node.value
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]
    found = [match[1] for text in texts if (match := re.fullmatch(r"mirotwin\.(\w+)(\.\w+)*(:\w+)?", text))]
    return [other for other in found if other != room and FLOORS.get(other, -1) >= FLOORS[room]]


def test_no_room_names_a_higher_one_by_a_text():
    paths = [path for path in SOURCES if path.suffix == ".py" and path.is_relative_to(ROOT / "mirotwin")]
    rooms = {path: path.relative_to(ROOT / "mirotwin").parts[0].removesuffix(".py") for path in paths}
    found = {
        str(path): higher_rooms(path.read_text(), room) for path, room in rooms.items() if room in FLOORS
    }
    assert not {path: others for path, others in found.items() if others}
    assert len(found) > 100


def test_a_room_that_is_named_by_a_text_is_found():
    source = (
        'OWN = {"a": "mirotwin.conform.rule:Rule", "b": "mirotwin.shell.options", "c": "mirotwin.checks"}'
    )
    assert higher_rooms(source, "verify") == ["conform"]
    assert higher_rooms(source, "commands") == []


def annotated_tests(source):
    """The names of the test functions in `source` that annotate a parameter or what they return."""
    tests = [
        node
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    ]
    return [test.name for test in tests if test.returns or any(arg.annotation for arg in test.args.args)]


@pytest.mark.slow
def test_no_test_is_annotated():
    found = {
        str(path.relative_to(ROOT)): annotated_tests(path.read_text("utf-8"))
        for path in (ROOT / "tests").rglob("*.py")
    }
    assert not {path: names for path, names in found.items() if names}
    assert len(found) > 200


@pytest.mark.parametrize(
    "source",
    ["def test_a() -> None: ...", "def test_a(b: int): ...", "class A:\n def test_a(self, b: int): ..."],
)
def test_an_annotated_test_is_found(source):
    assert annotated_tests(source) == ["test_a"]


def from_the_end(source):
    """Lines that index from the end. Compiled code does not: it reads what lies before the first item."""
    indices = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Subscript))
    return [index.lineno for index in indices if isinstance(index.slice, ast.UnaryOp)]


def test_no_hot_module_indexes_from_the_end():
    hot = [path.with_suffix(".py") for path in SOURCES if path.suffix == ".pxd"]
    found = {
        str(path.relative_to(ROOT)): from_the_end(path.read_text("utf-8")) for path in hot if path.exists()
    }
    assert not {path: lines for path, lines in found.items() if lines}
    assert len(found) > 50


def test_an_index_from_the_end_is_found():
    assert from_the_end("a = b[-1]\nc = d[:-1], d[0]\n") == [1]
