"""One parameter, walked from the outside in: `python -m tests.project.walks [CHECKOUT ..]`, a column for each.

A walk begins in a function that takes the parameter and follows it into every function of the product that it is given
to, first into the first one called, each function once. A name that is assigned from it is it, too; what a function
makes of it (an image of a file's name) is where WALKS says so, an object that is made with it never. A scenario's key,
which is no parameter of anything, is followed as it runs (`key_walk`). Counted are stays (stretches of the walk in one
file), rooms (files), and returns (stays in a file where the walk has been before).
"""

import argparse
import ast
import sys
from itertools import groupby
from pathlib import Path

from tests import children

ROOT = Path(__file__).parents[2]
PACKAGES = {"exact": "miro_exact", "protocol": "miro_protocol", "robot_fw": "miro_robot", "host": "miro_host"}
PACKAGES |= {"sim": "miro_sim", "": "mirotwin"}
WALKS = {  # where it begins: module, function, name, its field; and whether what is made of it is followed
    "--firmware of run, to the board": ("mirotwin.run.run_command", "run", "options", "firmware", True),
    "the file of replay": ("mirotwin.replay.replay_command", "replay", "file", None, False),
}


class Code:
    """The product of one checkout, by the dotted names of modules and what they define."""

    def __init__(self, root):
        self.trees = {}
        for folder, package in PACKAGES.items():
            for path in sorted((root / folder / package).rglob("*.py")):
                parts = path.relative_to(root / folder).with_suffix("").parts
                self.trees[".".join(parts).removesuffix(".__init__")] = ast.parse(path.read_text("utf-8"))
        self.functions = {}
        for module, tree in self.trees.items():
            for node in tree.body:
                if isinstance(node, ast.FunctionDef):
                    self.functions[module, node.name] = node
                elif isinstance(node, ast.ClassDef):
                    for one in node.body:
                        if isinstance(one, ast.FunctionDef) and one.name == "__init__":
                            self.functions[module, node.name] = one
        self.imports = {
            module: {
                alias.asname or alias.name: (node.module, alias.name)
                for node in ast.walk(tree)
                if isinstance(node, ast.ImportFrom) and node.module
                for alias in node.names
            }
            for module, tree in self.trees.items()
        }

    def called(self, module, call):
        """Where the function that is called is defined; None for what is no name, or not the product's."""
        name = call.func
        if isinstance(name, ast.Attribute) and isinstance(name.value, ast.Name):
            there = self.imports[module].get(name.value.id)
            key = (".".join(there), name.attr) if there else None
        else:
            key = None
            if isinstance(name, ast.Name):
                key = self.imports[module].get(name.id, (module, name.id))
        return key if key in self.functions else None


def walk(code, module, function, record, first, made_too):
    """The modules that the walk passes, in order. `first`: the attribute of `record` that is followed."""
    passed, seen = [], set()

    def go(key, given, attribute):
        if (key, given) in seen:
            return
        seen.add((key, given))
        passed.append(key[0])
        known = set(given)

        def is_it(node):
            if attribute and isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                if node.value.id in given:
                    return node.attr == attribute
            return isinstance(node, ast.Name) and node.id in known and not (attribute and node.id in given)

        def holds(node):
            return any(map(is_it, ast.walk(node)))

        def made(node):
            """Whether it is another thing, that was made with it."""
            calls = [one for one in ast.walk(node) if isinstance(one, ast.Call)]
            made_by = [
                getattr(one.func, "value", one.func) for one in calls
            ]  # `Run(..)`, or `RunSpec.of(..)`
            named = [one.id for one in made_by if isinstance(one, ast.Name)]
            return any(name[:1].isupper() for name in named) or (calls and not made_too)

        for node in sorted(
            (one for one in ast.walk(code.functions[key]) if isinstance(one, ast.Assign | ast.Call)),
            key=lambda one: (one.lineno, one.col_offset),
        ):
            if isinstance(node, ast.Assign):
                if holds(node.value) and not isinstance(node.value, ast.Compare) and not made(node.value):
                    known |= {
                        one.id
                        for target in node.targets
                        for one in ast.walk(target)
                        if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)
                    }
                continue
            there = code.called(key[0], node)
            if there is None:
                continue
            parameters = [one.arg for one in code.functions[there].args.args if one.arg != "self"]
            parameters += [one.arg for one in code.functions[there].args.kwonlyargs]
            into = [name for name, value in zip(parameters, node.args, strict=False) if holds(value)]
            into += [one.arg for one in node.keywords if one.arg in parameters and holds(one.value)]
            if into:
                go(there, tuple(into), None)
                passed.append(key[0])

    go((module, function), (record,), first)
    return [one for one, _ in groupby(passed)]


def figures(root):
    """Name of a walk -> stays, rooms, returns."""
    code = Code(root)
    walks = {name: walk(code, *begin) for name, begin in WALKS.items() if begin[:2] in code.functions}
    follow = [sys.executable, "-P", str(Path(__file__).with_name("key_walk.py")), str(root)]
    passed = children.run(follow, capture_output=True, text=True, check=True).stdout.splitlines()
    walks["a scenario's key, to the plant"] = [one for one, _ in groupby(passed)]
    return {
        name: (len(found), len(set(found)), len(found) - len(set(found))) for name, found in walks.items()
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkouts", nargs="*", type=Path, default=[ROOT])
    columns = [figures(path.resolve()) for path in parser.parse_args().checkouts]
    for name in columns[0]:
        found = (one.get(name) for one in columns)
        print(
            f"{name:36}", *("{:4} stays {:3} rooms {:3} returns   ".format(*(one or "---")) for one in found)
        )
