"""How much there is to read, and that names in the product's code say what they hold."""

import ast
from collections import Counter

import pytest

from tests.docs import sandbox

ROOT = sandbox.ROOT
PRODUCT = ("exact", "protocol", "robot_fw", "host", "sim", "mirotwin")
WORDS, FRONT_PAGE_WORDS = 50_000, 900
# At most a tenth of what stood in the product at 46d27414.
BINDINGS = {"one": 44, "found": 41, "what": 27}
OPENINGS = {"The same": 5, "That of": 0}


def words_of(document):
    return len((ROOT / document).read_text("utf-8").split())


def sources():
    for folder in PRODUCT:
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield path, ast.parse(path.read_text("utf-8"))


def test_the_documents_have_at_most_50_000_words():
    documents = [name for name in sandbox.documents() if name != "CHANGELOG.md"]
    assert "README.md" in documents
    assert sum(map(words_of, documents)) <= WORDS


def test_the_front_page_has_at_most_900_words():
    assert words_of("README.md") <= FRONT_PAGE_WORDS


def bindings_in(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg


def test_names_say_what_they_hold():
    counts = Counter(name for _, tree in sources() for name in bindings_in(tree) if name in BINDINGS)
    assert {name: counts[name] for name in BINDINGS if counts[name] > BINDINGS[name]} == {}


@pytest.mark.parametrize("opening", OPENINGS)
def test_a_docstring_says_in_full_what_it_is_about(opening):
    begins = [
        (path.relative_to(ROOT).as_posix(), node.lineno if hasattr(node, "lineno") else 1)
        for path, tree in sources()
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and (ast.get_docstring(node) or "").startswith(opening)
    ]
    assert len(begins) <= OPENINGS[opening], begins


def test_no_message_says_none_of():
    """ "200 is none of 160 bits" says less than "bit 200 is out of range 0..159"."""
    messages = [
        (path.relative_to(ROOT).as_posix(), node.lineno)
        for path, tree in sources()
        for node in strings_in(tree)
        if "none of" in node.value
    ]
    assert messages == []


def strings_in(tree):
    """String constants that are no docstrings."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    alone = {
        id(inner.value)
        for node in ast.walk(tree)
        if isinstance(node, documented)
        for inner in node.body
        if isinstance(inner, ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in alone:
            yield node
