"""Who imports what: the modules of the six packages and the imports between them, read from their source.

Imports for the type checker alone are left out. What `mirotwin/commands.py` names as `Lazy("room.module")` counts as
imported.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "mirotwin": ROOT / "mirotwin",
    "miro_sim": ROOT / "sim/miro_sim",
    "miro_host": ROOT / "host/miro_host",
    "miro_robot": ROOT / "robot_fw/miro_robot",
    "miro_protocol": ROOT / "protocol/miro_protocol",
    "miro_exact": ROOT / "exact/miro_exact",
}


@cache
def modules() -> dict[str, Path]:
    """Dotted name -> file; a package has its `__init__.py`."""
    named = {}
    for package, folder in PACKAGES.items():
        for path in sorted(folder.rglob("*.py")):
            parts = path.relative_to(folder).with_suffix("").parts
            named[".".join((package, *parts)).removesuffix(".__init__")] = path
    return named


@cache
def imports() -> dict[str, set[str]]:
    """Module -> modules that it imports."""
    return {name: imported(path.read_text("utf-8")) - {name} for name, path in modules().items()}


def imported(source: str) -> set[str]:
    """The modules that a source imports; of `from a.b import c`, `a.b.c` if that is a module, else `a.b`."""
    named = (_module_of(name) for node in _at_run_time(ast.parse(source)) for name in _names(node))
    return {name for name in named if name}


def is_below(name: str, package: str) -> bool:
    return name == package or name.startswith(f"{package}.")


def child_of(package: str, name: str) -> str:
    """The module or package directly in `package` that holds the module `name`, or an empty text."""
    if not name.startswith(f"{package}."):
        return ""
    return f"{package}.{name.removeprefix(f'{package}.').partition('.')[0]}"


def children(package: str) -> dict[str, set[str]]:
    """The modules and packages directly in `package` -> those of them that each imports."""
    inside: dict[str, set[str]] = {child: set() for name in modules() if (child := child_of(package, name))}
    for name, others in imports().items():
        if child := child_of(package, name):
            inside[child] |= {child_of(package, other) for other in others} - {"", child}
    return inside


def entrances(package: str) -> set[str]:
    """The modules and packages directly in `package` that a module outside of it imports from."""
    outside = (others for name, others in imports().items() if not is_below(name, package))
    return {child_of(package, other) for others in outside for other in others} - {""}


def users(package: str) -> set[str]:
    return {name for name, others in imports().items() if any(is_below(one, package) for one in others)}


def used(package: str) -> set[str]:
    return {other for name, others in imports().items() if is_below(name, package) for other in others}


def _module_of(name: str) -> str:
    while name and name not in modules():
        name = name.rpartition(".")[0]
    return name


def _at_run_time(tree: ast.AST) -> Iterator[ast.AST]:
    for_types = isinstance(tree, ast.If) and ast.unparse(tree.test).endswith("TYPE_CHECKING")
    below: Iterable[ast.AST] = (
        tree.orelse if isinstance(tree, ast.If) and for_types else ast.iter_child_nodes(tree)
    )
    yield tree
    for node in below:
        yield from _at_run_time(node)


def _names(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and node.module:
        return [f"{node.module}.{alias.name}" for alias in node.names]
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Lazy":
        return [f"mirotwin.{node.args[0].value}"] if isinstance(node.args[0], ast.Constant) else []
    return []
