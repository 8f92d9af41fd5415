"""Nothing that moves may be forgotten: every attribute is in its class's table of state or declared as not state."""

import ast
import re
from pathlib import Path

import pytest

from miro_exact import places

ROOT = Path(__file__).parents[2]
FOLDERS = ("exact", "protocol", "robot_fw/miro_robot", "host", "sim")
OBSERVERS = {"inspect", "engine.py", "fields.py", "state.py", "settings.py", "stream.py", "pcapng_reader.py"}
OBSERVERS |= {"waits.py", "watch.py", "pin_watch.py", "followers.py", "changes.py"}
"""Files and rooms whose objects look at a run and are no part of it."""


TREES = {
    path: ast.parse(path.read_text()) for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))
}
CLASSES = {
    (path, node.name): node
    for path, tree in TREES.items()
    for node in tree.body
    if isinstance(node, ast.ClassDef)
}


def where(path, name):
    """The file in which a name that a file uses is a class of ours, None if it is not."""
    if (path, name) in CLASSES:
        return path
    for part in ast.walk(TREES[path]):
        if isinstance(part, ast.ImportFrom) and any(alias.name == name for alias in part.names):
            ending = Path(*part.module.split(".")).with_suffix(".py").as_posix()
            return next((file for file in TREES if file.as_posix().endswith(f"/{ending}")), None)
    return None


def lineage(path, name):
    """The class and those of our classes that it derives from."""
    node = CLASSES[path, name]
    yield path, node
    for base in node.bases:
        base = base.value if isinstance(base, ast.Subscript) else base  # of a generic one
        if isinstance(base, ast.Name) and (path_of_base := where(path, base.id)) is not None:
            if (path_of_base, base.id) in CLASSES:
                yield from lineage(path_of_base, base.id)


def class_attribute(cls, attribute):
    """The expressions assigned to a class attribute, inherited ones too."""
    for _, node in lineage(*cls):
        for part in node.body:
            targets = part.targets if isinstance(part, ast.Assign) else [getattr(part, "target", None)]
            if any(isinstance(target, ast.Name) and target.id == attribute for target in targets):
                yield part.value


def in_table(cls):
    return {key.value for table in class_attribute(cls, "STATE") for key in table.keys}


def declared_as_not_state(cls):
    leaves = (leaf for value in class_attribute(cls, "NOT_STATE") for leaf in ast.walk(value))
    return {leaf.value for leaf in leaves if isinstance(leaf, ast.Constant) and isinstance(leaf.value, str)}


def assigned(node):
    """Names X of every `self.X = ...` (also augmented, annotated and in tuples) below a node."""
    names = set()
    for part in ast.walk(node):
        targets = part.targets if isinstance(part, ast.Assign) else []
        if isinstance(part, (ast.AugAssign, ast.AnnAssign)):
            targets = [part.target]
        for target in targets:
            for leaf in ast.walk(target):
                if isinstance(leaf, ast.Attribute) and isinstance(leaf.ctx, ast.Store):
                    if isinstance(leaf.value, ast.Name) and leaf.value.id == "self":
                        names.add(leaf.attr)
    return names


def properties(node):
    """Names of the class's properties: a table may name one with a setter; what it keeps is assigned elsewhere."""
    return {
        part.name
        for part in node.body
        if isinstance(part, ast.FunctionDef)
        and any(isinstance(mark, ast.Name) and mark.id == "property" for mark in part.decorator_list)
    }


def in_layout(path, node):
    """The fields that the class's `.pxd` declares, plain C data and Python objects."""
    layout = path.with_suffix(".pxd")
    if not layout.exists():
        return set()
    body = re.search(
        rf"^cdef class {node.name}\b[^\n]*:\n((?:(?:[ \t]+[^\n]*)?\n)*)", layout.read_text(), re.M
    )
    if body is None:
        return set()
    lines = re.findall(
        r"^    cdef (?:public |readonly )?(?:long long|unsigned \w+(?: long)?|\w+) ([\w\[\], ]+)$",
        body[1],
        re.M,
    )
    return {re.sub(r"\[.*", "", field.strip()) for line in lines for field in line.split(",")}


WITH_TABLES = [cls for cls in CLASSES if in_table(cls)]
each_with_a_table = pytest.mark.parametrize("cls", WITH_TABLES, ids=lambda cls: f"{cls[0].stem}.{cls[1]}")
DECLARING = [cls for cls in CLASSES if in_table(cls) or declared_as_not_state(cls)]
each_that_declares = pytest.mark.parametrize("cls", DECLARING, ids=lambda cls: f"{cls[0].stem}.{cls[1]}")


def test_there_are_tables_for_the_whole_robot_and_the_world():
    names = {"World", "Network", "Robot", "Board", "Cpu", "Line", "Lm629", "Encoder", "Body", "Uplink"}
    assert names <= {name for _, name in WITH_TABLES}
    assert len(WITH_TABLES) > 40


@each_that_declares
def test_every_attribute_is_in_the_table_or_declared_as_not_state(cls):
    known = in_table(cls) | declared_as_not_state(cls)
    if "*" in known:
        assert not in_table(cls), f"{cls[1]} has a table, so it names what is not state"
        return
    there = set().union(
        *(assigned(node) | in_layout(path, node) | properties(node) for path, node in lineage(*cls))
    )
    places_in_queues = {  # are saved with the queue
        argument.value
        for declared in class_attribute(cls, "STATE")
        for value in ast.walk(declared)
        if isinstance(value, ast.Call) and ast.unparse(value.func) == "Queue"
        for argument in value.args[2:4]
        if isinstance(argument, ast.Constant)
    }
    forgotten = (
        there - known - places_in_queues - set().union(*(properties(node) for _, node in lineage(*cls)))
    )
    assert not forgotten, f"{cls[1]} forgets {sorted(forgotten)}"
    gone = known - there
    assert not gone, f"{cls[1]} has no {sorted(gone)}"


@each_with_a_table
def test_nothing_is_state_and_not_state(cls):
    both = in_table(cls) & declared_as_not_state(cls)
    assert not both, f"{cls[1]}: {sorted(both)}"


def test_every_class_that_changes_says_what_of_it_is_state():
    """Objects of the robot, the PC and the world: what is assigned outside `__init__` is memory."""
    forgotten = []
    for cls, node in CLASSES.items():
        if OBSERVERS & set(cls[0].relative_to(ROOT).parts) or in_table(cls) or declared_as_not_state(cls):
            continue
        methods = [
            part for part in node.body if isinstance(part, ast.FunctionDef) and part.name != "__init__"
        ]
        if any(assigned(method) for method in methods):
            forgotten.append(f"{cls[0].relative_to(ROOT)}: {cls[1]}")
    assert forgotten == []


def test_the_build_finds_every_plain_field_of_the_layouts():
    """A C type that `places.py` does not know would make a field unknown to the tables."""
    words = ("unsigned", "long", "int", "short", "char", "double", "bint", "float", "u64_t")
    for path in sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.pxd")):
        layout = path.read_text()
        found = [name for fields in places.fields_of(layout).values() for name, _, _ in fields]
        lines = re.findall(r"^    cdef (?:public |readonly )?([^(\n]+)$", layout, re.M)
        data = [line.partition("#")[0] for line in lines if "[::" not in line and "*" not in line]
        plain = [line for line in data if line.split()[0] in words]
        assert len(found) == sum(line.count(",") + 1 for line in plain), path.name
