"""Every code block of every document runs, and shows what it shows.

A document is one test, because its blocks build on each other and the tests of a file may run in several processes.
"""

import os
import sys
from collections import Counter

import pytest
from sybil import Sybil
from sybil.example import SybilFailure

from tests.docs import blocks, running, sandbox
from tests.docs.shell import Shell, commands_of, fits, plain
from tests.mutants import build

pytestmark = pytest.mark.slow

DOCUMENTS = sandbox.documents()
GIVEN = {
    "protocol/README.md": """\
def my_receiver(n, symbols):
    return [event.body for event in Decoder(n).feed_symbols(symbols) if isinstance(event, Received)]


"""
}
"""What a block of tests uses that is the reader's own."""


@pytest.mark.parametrize("document", DOCUMENTS)
def test_the_blocks_of(document, tmp_path, monkeypatch):
    if document in sandbox.COMPILED and not build.compiler() and not os.environ.get("CI"):
        pytest.skip("needs make and SDCC 4.2.0")
    folder = tmp_path / "here"
    folder.mkdir()
    parsed = Sybil([blocks.parser]).parse(sandbox.ROOT / document)
    if not any(example.region.evaluator is not blocks.nothing for example in parsed):
        return
    monkeypatch.chdir(folder)
    programs, installed = sandbox.prepare(folder, document)
    monkeypatch.syspath_prepend(str(installed))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    shell = Shell(programs)
    parsed.namespace.update(__name__="__main__", __shell__=shell, __given__=GIVEN.get(document, ""))
    newcomer = document in sandbox.FIRST_USE
    if not newcomer:
        blocks.write_files(parsed, folder)
    wrong = []
    for command in sandbox.COMMANDS.get(document, ()):
        printed = shell.run(command)
        assert shell.code == 0, f"{command}: {printed}"
    for example in parsed:
        if newcomer and example.parsed.file:
            (folder / example.parsed.file).write_text(example.parsed.text, "utf-8")
        try:
            example.evaluate()
        except SybilFailure as failure:
            wrong.append(str(failure))
        except Exception as error:
            wrong.append(f"{document}, line {example.line}: {type(error).__name__}: {error}")
    assert not wrong, "\n\n".join(wrong)


def blocks_in(document):
    return list(blocks.blocks_of((sandbox.ROOT / document).read_text("utf-8"), document))


def test_so_many_blocks_are_not_run():
    """Each has its reason in a comment in front of it, or in `blocks.ELSEWHERE`, as all of README.md have."""
    found = Counter(name for name in DOCUMENTS for block in blocks_in(name) if block.not_run)
    assert found.total() - found["README.md"] == 38, found


def test_documents_are_found_and_have_blocks():
    kinds = Counter(block.language for document in DOCUMENTS for block in blocks_in(document))
    assert set(DOCUMENTS) >= {"README.md", "docs/start.md", "host/README.md", "mirotwin/testing/README.md"}
    assert kinds["python"] > 20
    assert kinds["sh"] + kinds["console"] + kinds["indented"] > 60


def test_a_comment_in_front_of_a_block_is_about_that_block_alone():
    text = (
        "<!-- not run: no network -->\n```sh\npip\n```\n\nText\n\n"
        "    mirotwin\n\n<!-- file: a.toml -->\n```toml\n```\n"
    )
    one, two, three = blocks.blocks_of(text)
    assert (one.language, one.not_run, one.line) == ("sh", "no network", 2)
    assert (two.language, two.not_run, two.text) == ("indented", "", "mirotwin\n")
    assert (three.not_run, three.file) == ("", "a.toml")


def test_a_slow_block_is_left_to_the_command_for_the_first_pages():
    slow, quick = blocks.blocks_of("<!-- slow: 30 s -->\n```sh\nmirotwin\n```\n\n```sh\nmirotwin\n```\n")
    assert (slow.slow, slow.not_run) == ("30 s", "")
    assert blocks.evaluator_of(slow) is blocks.nothing
    assert blocks.evaluator_of(quick) is running.shell


def test_a_newcomer_finds_an_empty_folder(tmp_path):
    for document in sandbox.FIRST_USE:
        folder = tmp_path / document / "here"
        folder.mkdir(parents=True)
        sandbox.prepare(folder, document)
        assert not list(folder.iterdir())
        assert document not in sandbox.COMMANDS


def test_the_first_page_stays_short():
    text = (sandbox.ROOT / "README.md").read_text("utf-8")
    assert len(text.splitlines()) < 120
    assert len(text.split()) <= 900


def test_a_comment_that_text_parts_from_a_block_is_not_about_it():
    (block,) = blocks.blocks_of("<!-- not run: why -->\n\nText\n\n```sh\npip\n```\n")
    assert not block.not_run


@pytest.mark.parametrize(
    ("wanted", "printed", "same"),
    [
        ("a\nb", "a\nb\n", True),
        ("a ..", "a b c", True),
        ("a\n..\nd", "a\nb\nc\nd", True),
        ("a\nb", "a\nc", False),
        ("a.b", "axb", False),
        ("wanted ..", "found x", False),
    ],
)
def test_output_is_compared_line_by_line(wanted, printed, same):
    assert fits(wanted, printed) == same


def test_commands_of_a_console_have_their_output():
    one, two = commands_of("$ mirotwin a\nx\ny\n$ echo $?\n1\n")
    assert (one.line, one.output, one.asked) == ("mirotwin a", "x\ny", True)
    assert (two.line, two.output) == ("echo $?", "1")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("mirotwin run fig6 # runs", ["mirotwin", "run", "fig6"]),
        ("mirotwin run fig6 --set a='{b = \"c\"}'", ["mirotwin", "run", "fig6", "--set", 'a={b = "c"}']),
        ("mirotwin info | head", None),
        ("mirotwin info > out", None),
        ("mirotwin test *.toml", None),
    ],
)
def test_what_needs_a_shell(line, words):
    assert plain(line) == words


def test_a_command_has_its_own_process_and_exit_code(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    programs = sandbox.programs(tmp_path / "programs", tmp_path / "none")
    shell = Shell(programs)
    assert "fig6" in shell.run("mirotwin scenarios")
    assert shell.code == 0
    assert "no such command" in shell.run("mirotwin nonsense").lower()
    assert shell.code == 2
    assert shell.run("mirotwin scenarios | grep -c fig6") == "1\n"
    assert os.getcwd() == str(tmp_path)
