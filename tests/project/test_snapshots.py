"""Nothing that moves may be forgotten by a snapshot: every attribute is in it or declared as not state."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("protocol", "robot_fw/miro_robot", "host", "sim")


def classes_with_snapshot():
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef) and any(
                    isinstance(part, ast.FunctionDef) and part.name == "snapshot" for part in node.body
                ):
                    yield pytest.param(node, id=f"{path.stem}.{node.name}")


def assigned_attributes(node):
    """Names X of every `self.X = ...` (also augmented, annotated and in tuples) in the class."""
    names = set()
    for part in ast.walk(node):
        targets = []
        if isinstance(part, ast.Assign):
            targets = part.targets
        elif isinstance(part, (ast.AugAssign, ast.AnnAssign)):
            targets = [part.target]
        for target in targets:
            for leaf in ast.walk(target):
                if isinstance(leaf, ast.Attribute) and isinstance(leaf.ctx, ast.Store):
                    if isinstance(leaf.value, ast.Name) and leaf.value.id == "self":
                        names.add(leaf.attr)
    return names


def class_level_strings(node):
    """Strings in class attributes: field tables such as STATE, and NOT_STATE."""
    strings = set()
    for part in node.body:
        if isinstance(part, (ast.Assign, ast.AnnAssign)) and part.value is not None:
            strings |= {leaf.value for leaf in ast.walk(part.value) if isinstance(leaf, ast.Constant)}
    return {string for string in strings if isinstance(string, str)}


def mentioned_in_snapshot(node):
    """Names X of every `self.X` in `snapshot` and in the methods of the class that it calls."""
    methods = {part.name: part for part in node.body if isinstance(part, ast.FunctionDef)}
    names, waiting = set(), ["snapshot"]
    while waiting:
        for part in ast.walk(methods[waiting.pop()]):
            if (
                isinstance(part, ast.Attribute)
                and isinstance(part.value, ast.Name)
                and part.value.id == "self"
            ):
                if part.attr in methods and part.attr not in names:
                    waiting.append(part.attr)
                names.add(part.attr)
            if isinstance(part, ast.Call) and ast.unparse(part) == "vars(self)":
                names |= assigned_attributes(node)
    return names


@pytest.mark.parametrize("node", list(classes_with_snapshot()))
def test_every_attribute_is_in_the_snapshot_or_declared_as_not_state(node):
    forgotten = assigned_attributes(node) - mentioned_in_snapshot(node) - class_level_strings(node)
    assert not forgotten, f"{node.name} forgets {sorted(forgotten)}"


@pytest.mark.parametrize("node", list(classes_with_snapshot()))
def test_what_a_snapshot_gives_can_be_put_back(node):
    methods = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
    assert "restore" in methods
