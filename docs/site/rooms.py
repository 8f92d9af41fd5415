"""Writes the map of each folder of `mirotwin/` into its README: `python -m docs.site.rooms`.

The map stands between two marks: who uses the folder and what it uses, by the imports, and its files by the first
sentence of their docstrings. What comes in and goes out is written by hand above it.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROOMS = ROOT / "mirotwin"
BEGIN, END = "<!-- map: python -m docs.site.rooms -->", "<!-- end of map -->"
_MAP = re.compile(f"{re.escape(BEGIN)}\n.*?{re.escape(END)}\n", re.DOTALL)


def folders() -> list[Path]:
    """The packages below `mirotwin/`."""
    return sorted(path.parent for path in ROOMS.rglob("__init__.py") if path.parent != ROOMS)


def with_map(folder: Path) -> str:
    """The README of a folder with the map as it has to be. Raises ValueError where it has no marks."""
    text = (folder / "README.md").read_text("utf-8")
    if not _MAP.search(text):
        raise ValueError(f"{folder.relative_to(ROOT)}/README.md lacks {BEGIN} and {END}")
    return _MAP.sub(lambda _: f"{BEGIN}\n{_map(folder)}{END}\n", text)


def _map(folder: Path) -> str:
    users, used = neighbours(folder)
    lines = [
        f"Used by {_names(users)}. Uses {_names(used)}.",
        "",
        "| file | |",
        "|---|---|",
        *(f"| `{path.name}` | {_sentence(path)} |" for path in _files(folder)),
        *(
            f"| [`{path.name}/`]({path.name}/README.md) | {_sentence(path / '__init__.py')} |"
            for path in _below(folder)
        ),
    ]
    return "".join(f"{line}\n" for line in lines)


def neighbours(folder: Path) -> tuple[list[str], list[str]]:
    """Names of the folders that import from this one, and of those that it imports from; a room as a whole."""
    room = _name(folder)
    users, used = set(), set()
    for path in ROOMS.rglob("*.py"):
        here = _name(path.parent)
        inside = here == room or here.startswith(f"{room}.")
        for imported in _imported(path):
            there = imported == room or imported.startswith(f"{room}.")
            if inside and not there:
                used.add(imported)
            elif there and not inside:
                users.add(here)
    tops = ({_seen_from(room, name) for name in names} - {""} for names in (users, used))
    above, below = (sorted(names) for names in tops)
    return above, below


def _seen_from(room: str, name: str) -> str:
    """A folder as one names it from `room`: its room, or within the same room its path."""
    same_room = name.split(".")[0] == room.split(".")[0] and "." in room
    return name if same_room else name.split(".")[0]


def _name(folder: Path) -> str:
    return ".".join(folder.relative_to(ROOMS).parts)


def _imported(path: Path) -> set[str]:
    """The folders that a module imports from, `commands` for a module that stands in none."""
    packages = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        for name in names:
            parts = name.split(".")
            if parts[0] == "mirotwin" and len(parts) > 1:
                inner = [*parts[1:]]
                while inner and not (ROOMS.joinpath(*inner) / "__init__.py").is_file():
                    inner.pop()
                if inner:
                    packages.add(".".join(inner))
    return packages


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.glob("*.py") if path.name != "__init__.py")


def _below(folder: Path) -> list[Path]:
    return sorted(path.parent for path in folder.glob("*/__init__.py"))


def _sentence(path: Path) -> str:
    text = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
    sentence = re.split(r"(?<=\.)\s", text.replace("\n", " "), maxsplit=1)[0]
    return sentence.replace("|", "\\|")


def _names(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names) or "nothing else of it"


def main() -> None:
    for folder in folders():
        (folder / "README.md").write_text(with_map(folder), "utf-8")


if __name__ == "__main__":
    main()
