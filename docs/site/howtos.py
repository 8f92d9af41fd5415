"""The index of how-tos: each row gets the first sentence of the page that it leads to.

In the tree the table has two columns, so that it can be read there; a sentence stands once, in its own page.
"""

from __future__ import annotations

import re
from pathlib import Path

INDEX = "howto/index.md"
HEAD = "| to | page |\n|---|---|\n"
ROW = re.compile(r"^(\| .+ \| \[[^\]]*\]\(([^)#\s]+)\) \|)$", re.MULTILINE)
SENTENCE = re.compile(r".+?[.!?](?=\s|$)", re.S)


def with_first_sentences(markdown: str, index: Path) -> str:
    """The table of the index with its third column. `index`: its file."""
    markdown = markdown.replace(HEAD, "| to | page | in short |\n|---|---|---|\n")
    return ROW.sub(lambda row: f"{row[1]} {first_sentence(index.parent / row[2])} |", markdown)


def first_sentence(page: Path) -> str:
    """Of the first paragraph that is no heading, code, picture, list or table; its links become their words."""
    for paragraph in _without_fences(page.read_text("utf-8")).split("\n\n"):
        text = paragraph.strip("\n")
        if text.startswith("#"):
            text = text.partition("\n")[2]
        if not text or text.startswith(("#", "<!--", "    ", "\t", "![", "|", "*", ">")):
            continue
        found = SENTENCE.match(text)
        words = " ".join((found[0] if found else text).split())
        return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", words)
    raise ValueError(f"{page}: has no sentence")


def _without_fences(text: str) -> str:
    return re.sub(r"^(```+|~~~+).*?^\1\n", "\n", text, flags=re.M | re.S)
