"""The help of all commands and groups: it can be shown, and it leaves no option without a word."""

import click

from mirotwin.commands import main


def commands(command, name):
    """(full name, command) of `command` and of all that are in it."""
    yield name, command
    if isinstance(command, click.Group):
        for inner in command.list_commands(click.Context(command)):
            yield from commands(command.get_command(click.Context(command), inner), f"{name} {inner}")


def test_every_command_shows_how_it_is_used_and_what_for():
    for name, command in commands(main, "mirotwin"):
        usage, about, *_ = command.get_help(click.Context(command, info_name=name)).split("\n\n")
        assert usage.startswith(f"Usage: {name}")
        assert about.strip()


def test_every_option_says_what_it_is_for():
    silent = [
        f"{name} {option.opts[0]}"
        for name, command in commands(main, "mirotwin")
        for option in command.params
        if isinstance(option, click.Option) and not option.hidden and not option.help
    ]
    assert silent == []
