"""Nothing that moves may be forgotten by a snapshot: every attribute is in it or declared as not state."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("exact", "protocol", "robot_fw/miro_robot", "host", "sim")


def all_classes():
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef):
                    yield path, node


CLASSES = {node.name: node for _, node in all_classes()}


def method(node, name):
    """The class's own method of that name, or its nearest base class's."""
    for part in node.body:
        if isinstance(part, ast.FunctionDef) and part.name == name:
            return part
    bases = [CLASSES[base.id] for base in node.bases if isinstance(base, ast.Name) and base.id in CLASSES]
    return next((found for base in bases if (found := method(base, name)) is not None), None)


def classes_with_snapshot():
    for path, node in all_classes():
        if any(isinstance(part, ast.FunctionDef) and part.name == "snapshot" for part in node.body):
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


def lineage(node):
    """The class and those of our classes that it derives from."""
    yield node
    for base in node.bases:
        if isinstance(base, ast.Name) and base.id in CLASSES:
            yield from lineage(CLASSES[base.id])


def class_level_strings(node):
    """Strings in class attributes, inherited ones too: field tables such as STATE, and NOT_STATE."""
    strings = set()
    for part in (part for cls in lineage(node) for part in cls.body):
        if isinstance(part, (ast.Assign, ast.AnnAssign)) and part.value is not None:
            strings |= {leaf.value for leaf in ast.walk(part.value) if isinstance(leaf, ast.Constant)}
    return {string for string in strings if isinstance(string, str)}


def mentioned_in_snapshot(node):
    """Names X of every `self.X` in `snapshot` and in the methods that it calls, inherited ones too."""
    names, waiting = set(), ["snapshot"]
    while waiting:
        body = method(node, waiting.pop())
        for part in ast.walk(body):
            if (
                isinstance(part, ast.Attribute)
                and isinstance(part.value, ast.Name)
                and part.value.id == "self"
            ):
                if method(node, part.attr) is not None and part.attr not in names:
                    waiting.append(part.attr)
                names.add(part.attr)
            if isinstance(part, ast.Call) and ast.unparse(part) == "vars(self)":
                names |= assigned_attributes(node)
            if isinstance(part, ast.Call) and ast.unparse(part).endswith(".snapshot(self)"):
                names |= mentioned_in_snapshot(CLASSES[ast.unparse(part).split(".")[0]])
    return names


@pytest.mark.parametrize("node", list(classes_with_snapshot()))
def test_every_attribute_is_in_the_snapshot_or_declared_as_not_state(node):
    forgotten = assigned_attributes(node) - mentioned_in_snapshot(node) - class_level_strings(node)
    assert not forgotten, f"{node.name} forgets {sorted(forgotten)}"


@pytest.mark.parametrize("node", list(classes_with_snapshot()))
def test_what_a_snapshot_gives_can_be_put_back(node):
    methods = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
    assert "restore" in methods
