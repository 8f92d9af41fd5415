"""How hard the house is to know, in figures: `python -m tests.project.house [CHECKOUT ..]`, a column for each.

Counted are the product's Python files; rooms, arrows and floors are those of `mirotwin`: what stands directly in it,
who imports whom, and the longest way down. A code line holds more than a comment and is no part of a docstring.
"""

import argparse
import ast
import io
import sys
import tokenize
from collections import Counter
from functools import cached_property
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[2]
PRODUCT = ("exact", "protocol", "robot_fw", "host", "sim", "mirotwin")
OURS = "mirotwin"
MOST_PARAMETERS = 7
SHORT = 60
VERDICT_WORDS = frozenset({"error", "differs", "fault", "failed", "not judged", "not observable", "limit"})
VERDICT_CODES = frozenset(
    {"BAD_INPUT", "DIVERGENCE", "FIRMWARE_FAULT", "EXPECTATION_FAILED", "NOTHING_JUDGED", "LIMIT_REACHED"}
)
"""What exit codes were called before they stood in the table of verdicts."""
PRINTERS = frozenset({"complain", "show", "tell_notes", "show_traceback", "print", "echo"})


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

    def sites(self, *names):
        """How many calls of a function or class of one of these names there are, outside of the class itself."""
        return sum(
            _called(node) in names
            for tree in self.trees.values()
            for top in tree.body
            if not (isinstance(top, ast.ClassDef) and top.name in names)
            for node in ast.walk(top)
        )

    @property
    def printing(self):
        """Modules of `mirotwin` that print, outside of `shell` and of the modules that define a command."""
        return [
            path
            for path, tree in self.trees.items()
            if path.is_relative_to(self.ours)
            and path.relative_to(self.ours).parts[0] != "shell"
            and "@command_of(" not in self.files[path]
            and any(_called(node) in PRINTERS for node in ast.walk(tree))
        ]

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
            "code lines": sum(map(code_lines, self.files.values())),
            "median file": median(lines),
            f"files under {SHORT} lines": sum(number < SHORT for number in lines),
            "top-level classes": len(classes),
            "classes whose name is in more than one file": sum(n > 1 for n in Counter(classes).values()),
            f"functions with more than {MOST_PARAMETERS} parameters": sum(
                _parameters(node) > MOST_PARAMETERS for node in functions
            ),
            "`World(` sites": self.sites("World"),
            "`Checks(` sites": self.sites("Checks"),
            "`Recorder(` sites": self.sites("Recorder"),
            "functions that say a verdict": sum(map(_says_verdict, functions)),
            "types that hold a verdict": sum(
                _holds_verdict(node)
                for tree in self.trees.values()
                for node in tree.body
                if isinstance(node, ast.ClassDef)
            ),
            "casts": self.sites("cast"),
            "modules that print and are no command": len(self.printing),
            "lines of tests": sum(len(text.splitlines()) for text in self.test_files.values()),
        }


def code_lines(text):
    """Lines with a token that is neither a comment nor a part of a docstring."""
    docstrings = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
        for line in range(node.lineno, node.end_lineno + 1)
    }
    lines = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _NO_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines - docstrings)


_NO_CODE = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
}


def _called(node):
    """The name that a call calls, without what stands before the last dot."""
    if not isinstance(node, ast.Call):
        return None
    return getattr(node.func, "id", getattr(node.func, "attr", None))


def _says_verdict(function):
    """Whether a verdict other than `passed` is a value that the function gives; comparing with one is not saying it."""
    compared = {
        id(value)
        for node in ast.walk(function)
        if isinstance(node, ast.Compare)
        for part in (node.left, *node.comparators)
        for value in ast.walk(part)
    }
    nodes = [node for node in ast.walk(function) if id(node) not in compared]
    words = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    return bool(words & VERDICT_WORDS or names & VERDICT_CODES)


def _holds_verdict(node):
    """Whether a class has a field, or a property, that is a verdict."""
    return any(
        (isinstance(part, ast.AnnAssign) and getattr(part.target, "id", "") == "verdict")
        or (isinstance(part, ast.FunctionDef) and part.name == "verdict")
        for part in node.body
    )


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
