"""The code blocks of a document: what each is, and how it is run.

    ```python          is executed; the blocks of a document share their names. One that defines tests goes to pytest
    ```sh, ```console  each line is run, with `$ ` in front of commands where output is shown
    indented           the same: GitHub and the site show it like the two above
    ```toml            is read by what reads such files: scenario, campaign, board, entry points
    ```c               a whole program: is compiled
    ```text            is no code

A comment in front of a block says what a reader need not know:

    <!-- not run: REASON -->     it is not run; `test_blocks` counts these
    <!-- slow: REASON -->        only `python -m tests.docs.first_use` runs it
    <!-- file: NAME -->          its text is written to that file: before anything runs, and on the pages that a
                                 newcomer follows (`sandbox.FIRST_USE`) when the reader comes to it
"""

import re
import textwrap
from pathlib import Path
from typing import NamedTuple

from markdown_it import MarkdownIt
from sybil import Region

from tests.docs import running

ROOT = Path(__file__).parents[2]
NOT_RUN = re.compile(r"<!-- not run: (.+?) -->", re.DOTALL)
SLOW = re.compile(r"<!-- slow: (.+?) -->", re.DOTALL)
FILE = re.compile(r"<!-- file: (\S+) -->")
SHELL = ("sh", "console", "indented")
LANGUAGES = ("python", "toml", "c", "text", *SHELL)
COMMAND = re.compile(r"(\$ )?(mirotwin|python3?|pip|pytest) ")
ELSEWHERE = {
    ("README.md", "python3 -m venv"): "it compiles for minutes; `tests.docs.first_use` installs so",
    ("README.md", ".venv/bin/pip"): ".ci/run does it",
    ("examples/hil/README.md", "python3 -m venv"): "needs the package index; tests/project/sample.py does it",
    ("examples/hil/README.md", "mirotwin replay"): "needs a firmware that fails",
    ("examples/fuzz-slip/README.md", "pip install"): "needs the package index, and fuzzes for 30 seconds",
}
"""Why a block is not run, by document and the start of its text, where a comment would be in the way of a reader."""
SLOW_ELSEWHERE = {
    ("README.md", "mirotwin reproduce"): "440 runs",
}
"""The same for blocks that only `tests.docs.first_use` runs."""


class Block(NamedTuple):
    """One block. `line`: from 1. `not_run`, `slow`: the reason, or empty. `file`: where its text is written."""

    language: str
    text: str
    line: int
    not_run: str = ""
    file: str = ""
    slow: str = ""


def blocks_of(text, document=""):
    """All blocks of a document, those that are no code too."""
    for block in _blocks(text):
        not_run = block.not_run or _reason(ELSEWHERE, document, block.text)
        yield block._replace(
            not_run=not_run, slow=block.slow or _reason(SLOW_ELSEWHERE, document, block.text)
        )


def _reason(table, document, text):
    found = (why for (where, start), why in table.items() if where == document and text.startswith(start))
    return next(found, "")


def _blocks(text):
    not_run, file, slow = "", "", ""
    for token in MarkdownIt().parse(text):
        if token.type == "html_block":
            not_run = " ".join(found[1].split()) if (found := NOT_RUN.search(token.content)) else not_run
            slow = " ".join(found[1].split()) if (found := SLOW.search(token.content)) else slow
            file = found[1] if (found := FILE.search(token.content)) else file
        elif token.type in ("fence", "code_block"):
            language = (
                token.info.split()[0] if token.info else "text" if token.type == "fence" else "indented"
            )
            if language == "text" and not token.info and COMMAND.match(token.content):
                language = "a fence without a language"
            assert token.map is not None
            yield Block(language, textwrap.dedent(token.content), token.map[0] + 1, not_run, file, slow)
            not_run, file, slow = "", "", ""
        elif token.type.endswith("_open"):
            not_run, file, slow = "", "", ""


def parser(document):
    """Sybil's regions: one a block."""
    starts = [0]
    for line in document.text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for block in blocks_of(document.text, Path(document.path).relative_to(ROOT).as_posix()):
        start = starts[block.line - 1]
        yield Region(start, start + 1, block, evaluator_of(block))


def evaluator_of(block):
    """Who runs it."""
    if block.not_run or block.slow or block.language == "text":
        return nothing
    if block.language in SHELL:
        return running.shell
    return {"python": running.python, "toml": running.toml, "c": running.c}.get(block.language, unknown)


def nothing(example):
    """For what is not run."""


def unknown(example):
    return f"a block of {example.parsed.language!r}; say what it is: {', '.join(filter(None, LANGUAGES))}"


def write_files(document, folder):
    """Writes the blocks that have a file's name."""
    for example in document.examples():
        if example.parsed.file:
            (folder / example.parsed.file).write_text(example.parsed.text, "utf-8")
