"""Writes the pages of results again: `python -m benchmarks.pages [PAGE..]`; hours for all on two cores.

    reproduction.md  the paper's claims, and which law is better        minutes
    theory.md        the numbers and tables of the theory's page        minutes
    benchmark.md     Mirotwin-Bench 2                                   half an hour
    gains.md         the same searches for the gains of both laws       half an hour

Each is written by a command of its own, whose tests run its parts. The same tree gives the same bytes.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
MODULES = {
    "theory.md": ("tests.sim.theory_page", "--write"),
    "benchmark.md": ("benchmarks.bench2", "--run", "--write", "docs/benchmark.md"),
    "gains.md": ("benchmarks.gains", "--write", "docs/background/gains.md"),
}
REPRODUCTION = "reproduction.md"
PAGES = (REPRODUCTION, *MODULES)


def write(page: str) -> None:
    """Raises CalledProcessError where the page's command fails."""
    if page == REPRODUCTION:
        _reproduce()
    else:
        _run(*MODULES[page])


def _run(module: str, *arguments: str) -> None:
    subprocess.run([sys.executable, "-m", module, *arguments], check=True, cwd=ROOT)


def _reproduce() -> None:
    """The page, its tables and its pictures; rows and recordings stay out of the tree."""
    with TemporaryDirectory() as folder:
        _run("mirotwin", "reproduce", "--out", folder)
        made = Path(folder)
        names = "reproduction/tables.json", "reproduction/*.svg"
        for path in (made / REPRODUCTION, *(path for name in names for path in made.glob(name))):
            copyfile(path, DOCS / path.relative_to(made))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("page", nargs="*", default=PAGES, metavar="PAGE", help="default: all")
    pages = parser.parse_args().page
    if unknown := set(pages).difference(PAGES):
        parser.error(f"no page of results: {', '.join(sorted(unknown))}; there are {', '.join(PAGES)}")
    for page in pages:
        print(f"docs/{page}", file=sys.stderr, flush=True)
        try:
            write(page)
        except subprocess.CalledProcessError as error:
            return error.returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
