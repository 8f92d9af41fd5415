"""Commands in running text and in tables have options and modules that exist."""

import re

import click
import pytest

from mirotwin.commands import main
from tests.docs import sandbox

COMMAND = re.compile(r"`(?:\.\. \\?\| )?mirotwin ([a-z][^`\n]*)`")
MODULE = re.compile(r"python -m ((?:benchmarks|docs|tests)(?:\.\w+)+)")
OPTION = re.compile(r"(?<![\w-])--?[a-z][a-z0-9-]*")


def commands(document):
    text = (sandbox.ROOT / document).read_text("utf-8")
    return COMMAND.findall(re.sub(r"```.*?```", "", text, flags=re.DOTALL))


def command_of(line):
    """The command that a line begins with, and the options that it takes."""
    context = click.Context(main)
    command = main
    options = {"--help", "-h", "--version"}
    for word in line.split():
        found = command.get_command(context, word) if isinstance(command, click.Group) else None
        if found is None:
            break
        command = found
    if isinstance(command, click.Group) and command.name == "campaign":
        command = command.get_command(context, "run") or command
    options |= {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    return command, options


@pytest.mark.parametrize("document", [name for name in sandbox.documents() if commands(name)])
def test_options_in_the_text_exist(document):
    wrong = []
    for line in commands(document):
        command, options = command_of(line)
        if command is main:
            wrong.append(line)
        said = re.sub(r"'[^']*'|\"[^\"]*\"", "", line.partition(" | ")[0].partition("&&")[0])
        wrong += [f"{line}: {option}" for option in OPTION.findall(said) if option not in options]
    assert not wrong


@pytest.mark.parametrize("document", sandbox.documents())
def test_modules_of_the_tree_that_a_document_runs_exist(document):
    named = set(MODULE.findall((sandbox.ROOT / document).read_text("utf-8")))
    paths = {name: sandbox.ROOT / name.replace(".", "/") for name in named}
    wrong = [
        name
        for name, path in paths.items()
        if not path.with_suffix(".py").exists() and not (path / "__main__.py").exists()
    ]
    assert not wrong


def test_a_wrong_option_would_be_seen():
    command, options = command_of("fw trace fig6 --from 30ms")
    assert command.name == "trace"
    assert "--from" in options
    assert "--form" not in options
