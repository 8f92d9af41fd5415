"""How hard the house is to know, in figures: `python -m tests.project.house [CHECKOUT ..]`, a column for each.

Counted are the product's Python files; rooms, arrows and floors are those of `mirotwin`: what stands directly in it,
who imports whom, and the longest way down.
"""

import argparse
import ast
import sys
from collections import Counter
from functools import cached_property
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[2]
PRODUCT = ("exact", "protocol", "robot_fw", "host", "sim", "mirotwin")
OURS = "mirotwin"
MOST_PARAMETERS = 7
SHORT = 60


class House:
    """One checkout."""

    def __init__(self, root):
        self.root = root
        self.files = {path: path.read_text("utf-8") for path in self._sources(PRODUCT)}
        self.test_files = {path: path.read_text("utf-8") for path in self._sources(("tests",))}
        self.trees = {path: ast.parse(text) for path, text in self.files.items()}
        self.ours = next(path for path in (root / OURS, root / "sim" / OURS) if path.is_dir())

    def _sources(self, folders):
        for folder in folders:
            yield from sorted((self.root / folder).rglob("*.py"))

    @cached_property
    def arrows(self):
        """(room, room that it imports)."""
        found = set()
        for path, tree in self.trees.items():
            if path.is_relative_to(self.ours) and path != self.ours / "__init__.py":
                room = path.relative_to(self.ours).parts[0].removesuffix(".py")
                found |= {(room, other) for other in _imported(tree) if other != room}
        return {(one, other) for one, other in found if other in self.rooms}

    @cached_property
    def rooms(self):
        inside = (
            path.relative_to(self.ours).parts[0] for path in self.files if path.is_relative_to(self.ours)
        )
        return {part.removesuffix(".py") for part in inside} - {"__init__"}

    @property
    def floors(self):
        """Rooms on the longest way down; a circle counts as one way through it."""

        def depth(room, above):
            below = [other for one, other in self.arrows if one == room and other not in above]
            return 1 + max((depth(other, (*above, room)) for other in below), default=0)

        return max(depth(room, ()) for room in self.rooms)

    def defined(self, *kinds):
        return [node.name for tree in self.trees.values() for node in tree.body if isinstance(node, kinds)]

    @property
    def figures(self):
        lines = [len(text.splitlines()) for text in self.files.values()]
        classes = self.defined(ast.ClassDef)
        functions = [
            node
            for tree in self.trees.values()
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef)
        ]
        return {
            "rooms": len(self.rooms),
            "arrows": len(self.arrows),
            "floors": self.floors,
            "files": len(lines),
            "lines": sum(lines),
            "median file": median(lines),
            f"files under {SHORT} lines": sum(number < SHORT for number in lines),
            "top-level classes": len(classes),
            "classes whose name is in more than one file": sum(n > 1 for n in Counter(classes).values()),
            f"functions with more than {MOST_PARAMETERS} parameters": sum(
                _parameters(node) > MOST_PARAMETERS for node in functions
            ),
            "lines of tests": sum(len(text.splitlines()) for text in self.test_files.values()),
        }


def _imported(tree):
    for node in ast.walk(tree):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        for name in names:
            if name.startswith(f"{OURS}."):
                yield name.split(".")[1]


def _parameters(node):
    given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return len([one for one in given if one.arg not in ("self", "cls")])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkouts", nargs="*", type=Path, default=[ROOT])
    columns = [House(path.resolve()).figures for path in parser.parse_args().checkouts]
    for name in columns[0]:
        print(f"{name:50}", *(f"{figures[name]:9g}" for figures in columns))
    return 0


if __name__ == "__main__":
    sys.exit(main())
