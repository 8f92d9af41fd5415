"""Draws a map of each package into `docs/maps/`: `python -m docs.site.rooms`.

A map has the package's files on floors by their imports, who uses the package and what it uses. `floors.py` draws it,
`imports.py` reads the imports.
"""

from __future__ import annotations

from pathlib import Path

from docs.site import floors, imports
from docs.site.imports import PACKAGES, ROOT

MAPS = ROOT / "docs/maps"


def packages() -> list[str]:
    """The packages that have a map: the six, and the rooms of `mirotwin`."""
    rooms = (name for name, path in imports.modules().items() if path.name == "__init__.py")
    return [*PACKAGES, *sorted(name for name in rooms if name.startswith("mirotwin."))]


def file_of(package: str) -> Path:
    """The map: `protocol.svg` for a package by its folder, `verify.checks.svg` for a room."""
    return MAPS / f"{_called(package)}.svg"


def picture(package: str) -> str:
    """The SVG of a package's map."""
    modules = imports.modules()

    def shown(name: str) -> str:
        return name.rpartition(".")[2] + ("/" if modules[name].name == "__init__.py" else "")

    uses = {
        shown(name): {shown(other) for other in others} for name, others in imports.children(package).items()
    }
    doors = {shown(name) for name in imports.entrances(package)}
    above, below = (_seen_from(package, names) for names in (imports.users(package), imports.used(package)))
    return floors.drawing(uses, doors, above, below)


def _seen_from(package: str, names: set[str]) -> list[str]:
    """The packages of modules outside of `package`: `sim`; of its own room's package what stands beside it."""
    seen = set()
    for name in names:
        if imports.is_below(name, package):
            continue
        parts, own = name.split("."), package.split(".")
        depth = next((i for i, (a, b) in enumerate(zip(parts, own, strict=False)) if a != b), len(own)) + 1
        seen.add("mirotwin/__init__" if name == "mirotwin" else _called(".".join(parts[:depth])))
    return sorted(seen)


def _called(name: str) -> str:
    """A package as people call it: by its folder in the tree, a room by its path below `mirotwin/`."""
    if name in PACKAGES and name != "mirotwin":
        return PACKAGES[name].parent.name
    return name.removeprefix("mirotwin.")


def main() -> None:
    MAPS.mkdir(exist_ok=True)
    for package in packages():
        file_of(package).write_text(picture(package), "utf-8")


if __name__ == "__main__":
    main()
