"""The address of Mirotwin's repository: `python -m docs.site.address https://HOST/PATH` sets it.

The setting is `[project.urls] Repository` in `pyproject.toml`; it is `PLACEHOLDER` until the address is known. The site
and `mirotwin init` read it. The other `FILES` hold a copy, which the command writes, too.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

from mirotwin.testing.origin import PLACEHOLDER

ROOT = Path(__file__).parents[2]
FILES = ("pyproject.toml", "README.md", "docs/index.md", "CITATION.cff")
ADDRESS = re.compile(r"https://[\w.-]+(/[\w.~-]+)+")


def setting(root: Path = ROOT) -> str:
    """The address, or `PLACEHOLDER`."""
    with (root / "pyproject.toml").open("rb") as file:
        return str(tomllib.load(file)["project"]["urls"]["Repository"])


def known(root: Path = ROOT) -> str:
    """The address; "" until it is set."""
    return "" if setting(root) == PLACEHOLDER else setting(root)


def write(address: str, root: Path = ROOT) -> None:
    """Replaces the address that is set now, in all of `FILES`."""
    if not ADDRESS.fullmatch(address):
        raise ValueError(f"{address}: is no address of a repository, such as {PLACEHOLDER}")
    old = setting(root)
    for name in FILES:
        text = (root / name).read_text("utf-8")
        (root / name).write_text(text.replace(old, address), "utf-8")


if __name__ == "__main__":
    (new,) = sys.argv[1:]
    write(new)
