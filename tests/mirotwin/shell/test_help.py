"""The help of all commands and groups, which leaves no option without a word, and what a shell offers to complete."""

import os
import shlex
import sys
from collections import defaultdict
from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete

from mirotwin.commands import main
from mirotwin.run.run_options import RunOptions
from mirotwin.shell.command import DeclaredOption, RecordCommand
from mirotwin.testing.test_options import TestOptions
from mirotwin.verify.cases.artifacts import report_line
from mirotwin.verify.cases.replay_line import replay_line
from tests import children


def commands(command, name):
    """(full name, command) of `command` and of all that are in it."""
    yield name, command
    if isinstance(command, click.Group):
        for inner in command.list_commands(click.Context(command)):
            yield from commands(command.get_command(click.Context(command), inner), f"{name} {inner}")


ALL = list(commands(main, "mirotwin"))
COMPLETE = ShellComplete(main, {}, "mirotwin", "_MIROTWIN_COMPLETE")
DECLARED = [(name, one) for name, command in ALL for one in command.params if isinstance(one, DeclaredOption)]
"""(command, option) of every option but --help."""


def test_every_command_shows_how_it_is_used_and_what_for():
    for name, command in ALL:
        usage, about, *_ = command.get_help(click.Context(command, info_name=name)).split("\n\n")
        assert usage.startswith(f"Usage: {name}")
        assert about.strip()


def test_every_option_says_what_it_is_for():
    silent = [
        f"{name} {option.opts[0]}"
        for name, command in ALL
        for option in command.params
        if isinstance(option, click.Option) and not option.hidden and not option.help
    ]
    assert silent == []


MEANS_TWO_THINGS = {"--from"}
"""A time; in `init`, where the project's CI gets Mirotwin."""


def test_an_option_of_several_commands_is_declared_once_so_that_its_name_means_one_thing():
    users = defaultdict(lambda: defaultdict(list))
    for command, option in DECLARED:
        for name in option.opts:
            users[name][id(option.declared.origin)].append(command)
    assert {name for name, each in users.items() if len(each) > 1} == MEANS_TWO_THINGS


def test_an_option_has_the_same_short_name_in_every_command():
    names = defaultdict(set)
    for _, option in DECLARED:
        for short in (one for one in option.opts if not one.startswith("--")):
            names[short].add(max(option.opts, key=len))
    assert {short: each for short, each in names.items() if len(each) > 1} == {}


def test_every_command_with_options_takes_them_as_one_record():
    loose = [
        f"{name} {one.opts[0]}"
        for name, command in ALL
        for one in command.params
        if not isinstance(one, click.Argument | DeclaredOption) and one.name not in ("help", "version")
    ]
    assert loose == []


def test_the_list_of_commands_fits_a_screen():
    lines = main.get_help(click.Context(main, info_name="mirotwin")).splitlines()
    assert len(lines) <= 40
    assert max(map(len, lines)) <= 80


def test_every_record_knows_the_words_of_its_command():
    wrong = {
        name: command.record.COMMAND
        for name, command in ALL
        if isinstance(command, RecordCommand) and name != f"mirotwin {command.record.COMMAND}"
    }
    assert wrong == {}


@pytest.mark.parametrize(
    "line",
    [
        replay_line("-a b.stream", "late.ihx", "mine.py:never"),
        report_line("-folder").removeprefix("page: "),
        TestOptions(paths=("a", "b"), seed=3, settings=("x=1",), expected=("no_fault",)).command_line(),
        RunOptions(scenario="fig6", settings=("duration_s=1",), no_figure=True).command_line(),
    ],
)
def test_a_line_that_is_printed_is_one_that_the_program_takes(line):
    _, name, *words = shlex.split(line)
    command = main.get_command(click.Context(main), name)
    assert command.make_context(name, words).params


@pytest.mark.parametrize(
    ("words", "begun", "offered"),
    [
        ([], "ca", ["campaign", "camera"]),
        (["fw"], "di", ["disasm"]),
        (["run"], "fig1", ["fig10"]),
        (["run", "fig6"], "--se", ["--seed", "--set"]),
        (["camera", "calibrate", "--scenario"], "fig1", ["fig10"]),
        (["serve"], "curv", ["curve"]),
        (["run", "fig6", "--engine"], "", ["compiled", "python"]),
    ],
)
def test_commands_options_scenarios_and_choices_are_completed(words, begun, offered):
    found = [one.value for one in COMPLETE.get_completions(words, begun) if one.type == "plain"]
    assert found == offered


def test_a_scenario_may_be_a_file_too():
    assert "file" in [one.type for one in COMPLETE.get_completions(["run"], "mine")]


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_the_program_writes_what_a_shell_has_to_read(shell):
    asking = {**os.environ, "_MIROTWIN_COMPLETE": f"{shell}_source"}
    done = children.run([Path(sys.executable).with_name("mirotwin")], env=asking, capture_output=True)
    assert (done.returncode, b"_MIROTWIN_COMPLETE" in done.stdout) == (0, True)
