"""Commands with their options as one record: parser, defaults and the repeated command line are derived from its
fields.

    class LookOptions(Options, frozen=True, kw_only=True):
        COMMAND = "camera look"
        scenario: Annotated[str, Argument("SCENARIO")]
        network: Annotated[int, Option(type=Whole(0), help="Whose camera.")] = 0
        compare: CompareOptions = CompareOptions()

    @command_of(LookOptions)
    def look(options: LookOptions) -> int: ...

A field that is itself such a record includes all of its options. A field with the default False is a flag; one with the
default () is an option that may be repeated.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator
from copy import copy
from functools import cache
from inspect import cleandoc
from os import PathLike
from typing import Any, ClassVar, NamedTuple, TypeVar, get_args

import click
import msgspec

from miro_exact.bad_input import encodable


def operand(path: str | PathLike[str]) -> str:
    """The path as a word of a command: one that begins with a hyphen is prefixed, else it would be an option."""
    word = f"{path}"
    return f"./{word}" if word.startswith("-") else word


def command_line(*words: str) -> str:
    """`mirotwin` with these words, quoted for a shell."""
    return shell_line("mirotwin", *words)


def shell_line(*words: str) -> str:
    """A command, quoted for a shell."""
    return " ".join(map(_quoted, words))


def _quoted(word: str) -> str:
    """The word for a shell. One that is not UTF-8, which no screen shows, has its bytes as $'..' takes them."""
    if encodable(word) == word:
        return shlex.quote(word)
    plain = set(range(0x20, 0x7F)) - {*b"'\\"}
    shown = (chr(byte) if byte in plain else f"\\{byte:03o}" for byte in os.fsencode(word))
    return f"$'{''.join(shown)}'"


class Word(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """A word of the command line. `read` makes a value of it, or raises ValueError; `written` is its inverse."""

    def __init__(self, name: str, read: Callable[[str], Any], written: Callable[[Any], str] = str) -> None:
        self.name = name
        self.read = read
        self.written = written

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):  # a default
            return value
        try:
            return self.read(value)
        except ValueError as error:
            self.fail(f"{error}", param, ctx)


class Argument(NamedTuple):
    """The declaration of an argument; the field's name is the function's parameter."""

    metavar: str
    type: Any = None
    several: bool = False


class Option:
    """The declaration of an option. Without names it has the name of its field.

    `heading`: its group in the help. `needs`: a field that must be given, too; `apart`: a field that must not be given.
    `alone`: the value of an option given without a value. An option of several commands is declared once, and may have
    a different help text in each (`saying`).
    """

    def __init__(
        self,
        *names: str,
        help: str,
        type: Any = None,
        metavar: str | None = None,
        heading: str = "",
        needs: str = "",
        apart: str = "",
        alone: str | None = None,
    ) -> None:
        self.names = names
        self.help = help
        self.type = type
        self.metavar = metavar
        self.heading = heading
        self.needs = needs
        self.apart = apart
        self.alone = alone
        self.origin = self

    def saying(self, help: str, **others: Any) -> Option:
        """A copy of the option with this help, and perhaps other attributes."""
        other = copy(self)
        vars(other).update(help=help, **others)
        return other


class Options(msgspec.Struct, frozen=True, kw_only=True):
    """The options of a command."""

    COMMAND: ClassVar[str] = ""
    """Its words after `mirotwin`."""
    HEADING: ClassVar[str] = ""
    """The group of the help for options that have no heading of their own."""

    def command_line(self) -> str:
        """The command line with all values that differ from the defaults, quoted for a shell."""
        return command_line(*self.COMMAND.split(), *self._words())

    def _words(self) -> Iterator[str]:
        for field in _fields(type(self)):
            value = getattr(self, field.name)
            if field.record is not None:
                yield from value._words()
            elif value != field.default:
                for item in value if field.several else (value,):
                    yield from field.words(item)

    def given(self, *names: str) -> list[str]:
        """The options among the fields of these names (without names: among all) that differ from their defaults."""
        labels = []
        for field in _fields(type(self)):
            value = getattr(self, field.name)
            if field.record is not None:
                labels += value.given(*names)
            elif (not names or field.name in names) and value != field.default:
                labels.append(field.label)
        return labels

    def refuse(self) -> None:
        """Raises UsageError for options that do not go together."""
        fields = {field.name: field for field in _fields(type(self))}
        for field in fields.values():
            value = getattr(self, field.name)
            if field.record is not None:
                value.refuse()
            elif isinstance(field.declared, Option) and value != field.default:
                needs, apart = field.declared.needs, field.declared.apart
                if needs and getattr(self, needs) == fields[needs].default:
                    raise click.UsageError(f"{field.label} needs {fields[needs].label}.")
                if apart and getattr(self, apart) != fields[apart].default:
                    raise click.UsageError(f"{field.label} does not go with {fields[apart].label}.")


class _Field(NamedTuple):
    """A field of a record: its declaration, or the nested record."""

    name: str
    declared: Argument | Option | None
    record: type[Options] | None
    default: Any
    required: bool
    heading: str = ""

    @property
    def several(self) -> bool:
        """True if the value is a tuple because the option may be repeated."""
        return self.declared.several if isinstance(self.declared, Argument) else self.default == ()

    @property
    def label(self) -> str:
        """The name in messages."""
        if isinstance(self.declared, Argument):
            return self.declared.metavar.strip("[]")
        assert self.declared is not None
        names = self.declared.names or (f"--{self.name.replace('_', '-')}",)
        return max(names, key=len)

    def words(self, value: Any) -> list[str]:
        """The value as words of the command line."""
        assert self.declared is not None
        text = getattr(self.declared.type, "written", str)(value)
        if isinstance(self.declared, Argument):
            return [operand(text)]
        if self.default is False:
            return [self.label]
        if self.declared.alone is not None:
            return [f"{self.label}={text}"]
        return [self.label, operand(text) if isinstance(self.declared.type, click.Path) else text]

    def parameter(self) -> click.Parameter:
        declared = self.declared
        assert declared is not None
        bare = self.required or self.default is None or self.default is False or self.default == ()
        given: dict[str, Any] = {"required": self.required, **({} if bare else {"default": self.default})}
        if isinstance(declared, Argument):
            nargs = -1 if declared.several else 1
            return click.Argument(
                [self.name], metavar=declared.metavar, type=declared.type, nargs=nargs, **given
            )
        if declared.alone is not None:
            given |= {"is_flag": False, "flag_value": declared.alone}
        return DeclaredOption(
            [self.name, *(declared.names or (self.label,))],
            declared=declared,
            heading=declared.heading or self.heading,
            help=declared.help,
            type=declared.type,
            metavar=declared.metavar,
            multiple=self.default == (),
            show_default=not bare and self.default != "",
            **({"is_flag": True} if self.default is False else {}),
            **given,
        )


@cache
def _fields(record: type[Options]) -> tuple[_Field, ...]:
    fields = []
    for field in msgspec.structs.fields(record):
        declared = next(
            (argument for argument in get_args(field.type) if isinstance(argument, Argument | Option)), None
        )
        nested = field.type if declared is None else None
        fields.append(_Field(field.name, declared, nested, field.default, field.required, record.HEADING))
    return tuple(fields)


def _parameters(record: type[Options]) -> Iterator[click.Parameter]:
    for field in _fields(record):
        if field.record is not None:
            yield from _parameters(field.record)
        else:
            yield field.parameter()


Record = TypeVar("Record", bound=Options)


def _read(record: type[Record], given: dict[str, Any]) -> Record:
    """The record with the values from the command line."""
    return record(
        **{
            field.name: given[field.name] if field.record is None else _read(field.record, given)
            for field in _fields(record)
        }
    )


class DeclaredOption(click.Option):
    """A click option with its declaration."""

    def __init__(self, *args: Any, declared: Option, heading: str, **named: Any) -> None:
        super().__init__(*args, **named)
        self.declared = declared
        self.heading = heading

    def get_help_extra(self, ctx: click.Context) -> Any:
        extra = super().get_help_extra(ctx)
        if "default" in extra and hasattr(self.type, "written"):
            extra["default"] = self.type.written(self.default)
        return extra


class RecordCommand(click.Command):
    """A command of a record; its help shows options that have a heading below that."""

    def __init__(self, *args: Any, record: type[Options], **named: Any) -> None:
        super().__init__(*args, **named)
        self.record = record

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        groups: dict[str, list[tuple[str, str]]] = {"": []}
        for param in self.get_params(ctx):
            line = param.get_help_record(ctx)
            if line is not None and isinstance(param, click.Option):
                heading = param.heading if isinstance(param, DeclaredOption) else ""
                groups.setdefault(heading, []).append(line)
        for heading, lines in groups.items():
            with formatter.section(heading or "Options"):
                formatter.write_dl(lines)


def command_of(record: type[Record]) -> Callable[[Callable[[Record], int | None]], click.Command]:
    """Makes a command of a function that takes the record; the command is called as the function."""

    def made(function: Callable[[Record], int | None]) -> click.Command:
        def called(**given: Any) -> int | None:
            options = _read(record, given)
            options.refuse()
            return function(options)

        return RecordCommand(
            function.__name__,
            record=record,
            callback=called,
            params=list(_parameters(record)),
            help=cleandoc(function.__doc__ or ""),
        )

    return made
