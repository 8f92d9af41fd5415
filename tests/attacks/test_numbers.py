"""Numbers that are not numbers, too long, or out of every range, in each option of each command that takes one."""

import click
import pytest
from click.testing import CliRunner

from mirotwin.commands import main
from mirotwin.shell.options import FiniteNumber, Whole

WRONG = ("nan", "inf", "-inf", "1e999", "9" * 5000, "-" + "9" * 5000, "0x10", "")
ONLY_NUMBERS = (click.types.FloatParamType, click.types.IntParamType)


def commands(group=main, words=()):
    for name in group.list_commands(click.Context(group)):
        command = group.get_command(click.Context(group), name)
        if isinstance(command, click.Group):
            yield from commands(command, (*words, name))
        else:
            yield (*words, name), command


OPTIONS = [
    (words, option)
    for words, command in commands()
    for option in command.params
    if isinstance(option, click.Option) and not option.is_flag and isinstance(option.type, ONLY_NUMBERS)
]


def test_there_are_options_with_numbers():
    assert len(OPTIONS) > 20


@pytest.mark.parametrize(
    ("words", "option"), OPTIONS, ids=lambda one: getattr(one, "name", None) or " ".join(one)
)
def test_options_take_numbers_by_our_types(words, option):
    """Those of click take NaN for in range, and repeat 5000 digits."""
    assert isinstance(option.type, (FiniteNumber, Whole)) or type(option.type).__module__.startswith(
        "mirotwin"
    )
    for value in WRONG:
        with pytest.raises(click.BadParameter) as caught:
            option.type.convert(value, option, click.Context(main))
        assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    "words",
    [
        ("serve", "fig6", "--duration", "nan"),
        ("serve", "fig6", "--tcp", "9" * 5000),
        ("serve", "fig6", "--tcp", "7000@" + "9" * 5000),
        ("serve", "fig6", "--host", ""),
        ("serve", "fig6", "--host", " "),
        ("serve", "fig6", "--pace", "nan"),
        ("campaign", "show", "x.parquet", "--tolerance", "nan"),
    ],
)
def test_a_port_is_not_opened_before_the_options_are_right(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("socket.socket", lambda *_, **__: pytest.fail("a socket was opened"))
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 2, result.output
    assert len(result.output) < 1500
    assert list(tmp_path.iterdir()) == []
