"""The first pages as a newcomer follows them: `python -m tests.docs.first_use`.

    python -m tests.docs.first_use                     installs a wheel of this tree, which compiles for minutes
    python -m tests.docs.first_use --smoke             takes the compiled modules of this tree
    python -m tests.docs.first_use docs/howto/ci.md    these pages only

Blocks that are slow (`<!-- slow: .. -->`) are run here; blocks that are not run are counted.
"""

import argparse
import os
import re
import sys
import tempfile
import time
from pathlib import Path

from tests.docs import blocks, running, sandbox
from tests.docs.shell import Literal, commands_of
from tests.project.clean import Clean
from tests.project.sample import built

EXTRAS = re.compile(r"pip install '\.(\[[\w,]+\])'")
"""What `docs/start.md` tells to install."""


class Count:
    """Lines of one way through the pages. `refused`: page and line, with what was printed."""

    def __init__(self):
        self.run = 0
        self.left_out = 0
        self.refused = []

    def __str__(self):
        return f"{self.run} lines run, {self.left_out} not run, {len(self.refused)} refused"


def install(folder, smoke):
    """A new environment, with the extras that the page for beginners names."""
    page = (sandbox.ROOT / "docs/start.md").read_text("utf-8")
    extras = found[1] if (found := EXTRAS.search(page)) else ""
    clean = Clean(folder)
    clean.make()
    clean.must("pip", "install", "-q", f"{built(folder, smoke)}{extras}")
    if smoke:
        clean.copy_engines()
    return clean


def follow(document, shell, count):
    """One page, in the folder that the process stands in."""
    python = ""
    for block in blocks.blocks_of((sandbox.ROOT / document).read_text("utf-8"), document):
        if block.file:
            Path(block.file).write_text(block.text, "utf-8")
        if block.language in blocks.SHELL:
            lines = len([*commands_of(block.text)])
            count.run += 0 if block.not_run else lines
            count.left_out += lines if block.not_run else 0
        if block.not_run:
            continue
        if block.language in blocks.SHELL:
            found = [*running.refused(shell, block.text)]
        elif block.language == "python":
            python += block.text
            found = [*said(shell, python)]
        else:
            continue
        count.refused += [f"{document}, line {block.line}: {what}" for what in found]


def said(shell, source):
    """What is wrong with the Python of a page so far."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "page.py"
        path.write_text(source, "utf-8")
        printed = shell.run(f"python {path}")
    if shell.code:
        yield printed


def each_alone(documents, clean, folder):
    """Every page in an empty folder of its own."""
    count = Count()
    for document in documents:
        here = folder / document.replace("/", "-")
        here.mkdir()
        os.chdir(here)
        begun = time.perf_counter()
        follow(document, Literal(clean.environment), count)
        print(f"{document}: {time.perf_counter() - begun:.0f} s", flush=True)
    return count


def one_after_the_other(documents, clean, folder):
    """All pages in one folder."""
    count = Count()
    folder.mkdir()
    os.chdir(folder)
    for document in documents:
        follow(document, Literal(clean.environment), count)
    return count


def main(arguments=None):
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="take the compiled modules of this tree")
    parser.add_argument("documents", nargs="*", metavar="PAGE", help="instead of all")
    given = parser.parse_args(arguments)
    documents = given.documents or sandbox.FIRST_USE
    with tempfile.TemporaryDirectory(prefix="mirotwin-first-use-") as name:
        folder = Path(name)
        clean = install(folder, given.smoke)
        alone = folder / "alone"
        alone.mkdir()
        ways = {
            "each in an empty folder": each_alone(documents, clean, alone),
            "all in one folder": one_after_the_other(documents, clean, folder / "together"),
        }
        os.chdir(sandbox.ROOT)
    for way, count in ways.items():
        print("\n".join(count.refused), file=sys.stderr)
        print(f"{way}: {count}")
    return int(any(count.refused for count in ways.values()))


if __name__ == "__main__":
    sys.exit(main())
