"""`import mirotwin`: the public names, loaded when they are asked for."""

import ast
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import mirotwin
from tests import children


@pytest.mark.parametrize("name", mirotwin.__all__)
def test_every_public_name_is_there(name):
    assert getattr(mirotwin, name) is not None


def typed():
    """The names that type checkers see, with where they come from, as the table writes it."""
    tree = ast.parse(Path(mirotwin.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    found = {}
    for node in block.body:
        if isinstance(node, ast.ImportFrom):
            for one in node.names:
                module = f"{node.module}.{one.name}"
                found[one.asname] = module if find_spec_or_none(module) else f"{node.module}:{one.name}"
        else:
            found[node.targets[0].id] = f"{found[node.value.value.id]}:{node.value.attr}"
    return {name: where for name, where in found.items() if not name.startswith("_")}


def find_spec_or_none(module):
    try:
        return find_spec(module)
    except ModuleNotFoundError:  # its parent is a module, no package
        return None


def test_type_checkers_see_the_names_that_are_looked_up():
    assert typed() == mirotwin._MODULES


def test_a_name_that_is_not_public_is_refused_with_those_that_are():
    with pytest.raises(AttributeError, match="'mirotwin' has no attribute 'Wrold'; it has Checks, Decoder"):
        _ = mirotwin.Wrold


def test_importing_the_package_imports_nothing_else_of_ours():
    script = (
        "import sys, mirotwin; print(sorted(n for n in sys.modules if n.split('.')[0].startswith('miro')))"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "['mirotwin']\n"


def test_the_example_in_its_documentation_runs():
    lines = [line.strip() for line in mirotwin.__doc__.splitlines() if line.startswith("    ")]
    names = {}
    exec("\n".join(lines), names)
    assert names["answer"].what == "answer"
