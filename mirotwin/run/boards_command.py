"""`mirotwin boards`: the built-in boards, the parts that a board may have, and what each part is."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from inspect import cleandoc
from typing import Annotated, Any

import click
import msgspec
from msgspec import inspect

from miro_exact import installed
from miro_exact.bad_input import did_you_mean
from miro_exact.plugins import PluginError
from miro_robot.parts.keys import IN, OPEN_DRAIN, STRONG, TWO_WAY, PartKeys, Pin
from miro_robot.parts.resolve import BoardError
from miro_sim.scenario.base import is_path
from miro_sim.scenario.board_file import board_text, builtin_boards, check_struct, load_board, table_of
from miro_sim.scenario.errors import unit_name
from miro_sim.scenario.parts import PARTS
from mirotwin.run.scenarios_command import ScenariosGroup
from mirotwin.shell.command import Argument, DeclaredOption, Options, command_of
from mirotwin.shell.console import plain_table
from mirotwin.shell.console import show as print_result
from mirotwin.shell.json_text import print_json
from mirotwin.shell.options import JSON
from mirotwin.shell.part_files import Parts, bring_parts

_SENTENCE = re.compile(r"\.\s")
KINDS = {IN: "input", STRONG: "output", OPEN_DRAIN: "open drain", TWO_WAY: "input and output"}


class Key(msgspec.Struct):
    """A key of a part in the board file, or of its values: what it takes, and without it."""

    key: str
    takes: str
    default: str = ""


class PartPage(msgspec.Struct):
    """What is known of a part. `origin`: of a plug-in, its distribution or file. `text`: the head of its file."""

    name: str
    origin: str
    about: str
    text: str
    pins: list[dict[str, str]]
    keys: list[Key]
    put: list[Key]
    read: dict[str, str]
    sheet: str


class BoardsGroup(ScenariosGroup):
    """Tells what was meant where a board or a part is named instead of a command."""

    def shows(self, name: str) -> bool:
        return name in builtin_boards() or name in PARTS.names() or is_path(name)


@click.group(
    cls=BoardsGroup, invoke_without_command=True, short_help="Lists boards and parts, or shows one of them."
)
@click.option(
    *(*JSON.names, "as_json"), cls=DeclaredOption, declared=JSON, heading="", is_flag=True, help=JSON.help
)
@click.pass_context
def boards(context: click.Context, as_json: bool) -> None:
    """Lists the built-in boards, and the parts that a board may have: our own and installed ones."""
    if context.invoked_subcommand is not None:
        return
    listed = [_board_line(name) for name in builtin_boards()]
    parts = [_part_line(name) for name in PARTS.names()]
    if as_json:
        print_json({"boards": listed, "parts": parts})
        return
    table = plain_table("board", "chip", "crystal", "parts", bold=True)
    for board in listed:
        names = ", ".join(board["parts"])
        table.add_row(board["name"], board["chip"], f"{board['crystal_hz'] / 1e6:g} MHz", names)
    print_result(table)
    table = plain_table("part", "what it is", bold=True)
    for part in parts:
        table.add_row(part["name"], part["about"] + (f" ({part['origin']})" if part["origin"] else ""))
    print_result(
        "", table, "", "pins, keys and values of a part, or a board's file: mirotwin boards show NAME"
    )


def _board_line(name: str) -> dict[str, Any]:
    board = load_board(name)
    kinds = dict.fromkeys(part.keys.name for part in board.parts.values())
    return {"name": name, "chip": board.chip, "crystal_hz": board.crystal_hz, "parts": list(kinds)}


def _part_line(name: str) -> dict[str, str]:
    try:
        page = page_of(name)
    except PluginError as error:
        return {"name": name, "origin": "cannot be used", "about": error.what}
    return {"name": name, "origin": page.origin, "about": page.about}


class ShowOptions(Options, frozen=True, kw_only=True):
    COMMAND = "boards show"
    name: Annotated[str, Argument("NAME")]
    parts: Parts = ()
    as_json: Annotated[bool, JSON] = False


@command_of(ShowOptions)
def show(options: ShowOptions) -> None:
    """Shows the part NAME: pins, keys of a board file, values of tests, the maker's sheet; or prints a board's file.

    NAME may be a board file, too, which is checked.
    """
    bring_parts(options.parts)
    name = options.name
    if name in builtin_boards() or is_path(name):
        board = load_board(name)
        if options.as_json:
            print_json(table_of(board))
        else:
            click.echo(board_text(name), nl=False)
        return
    if name not in PARTS.names():
        known = [*builtin_boards(), *PARTS.names()]
        remedy = did_you_mean(name, known, "`mirotwin boards` lists both")
        raise BoardError(name, "", "no such board and no such part", remedy)
    page = page_of(name)
    if options.as_json:
        print_json(page)
    else:
        _print_page(page)


boards.add_command(show)


def _print_page(page: PartPage) -> None:
    print_result(*page.text.splitlines(), "")
    table = plain_table("pin", "kind", "", bold=True)
    for pin in page.pins:
        table.add_row(pin["name"], pin["kind"], pin["unconnected"])
    print_result(table)
    for heading, keys in (("key", page.keys), ("a test may put", page.put)):
        table = plain_table(heading, "takes", "default" if heading == "key" else "", bold=True)
        for key in keys:
            table.add_row(key.key, key.takes, key.default)
        if keys:
            print_result("", table)
    table = plain_table("a test may read", "what it is", bold=True)
    for value, meaning in page.read.items():
        table.add_row(value, meaning)
    if page.read:
        print_result("", table)
    print_result("", f"sheet: {page.sheet}" if page.sheet else "sheet: none is named")
    if page.origin:
        print_result(f"from: {page.origin}")


def page_of(name: str) -> PartPage:
    """What is known of a part. Raises PluginError for one that cannot be used."""
    struct = PARTS.find(name)
    check_struct(struct)
    text = _text(struct)
    return PartPage(
        name=name,
        origin=installed.described(PARTS.word, name).partition(": ")[2].partition(", sources")[0],
        about=_about(struct, text),
        text=text,
        pins=[
            {"name": pin.name, "kind": KINDS[pin.kind], "unconnected": _unconnected(pin)}
            for pin in struct.PINS
        ],
        keys=list(_keys(struct)),
        put=[Key(key, takes(inspect.type_info(kind), key)) for key, kind in struct.PUTS.items()],
        read={key: str(meaning) for key, meaning in struct.READS.items()},
        sheet=str(struct.SHEET),
    )


def _unconnected(pin: Pin) -> str:
    """What the part finds at a pin that may be left out."""
    if not pin.optional:
        return ""
    return "may be left out" if pin.kind == STRONG else f"may be left out: {'high' if pin.level else 'low'}"


def _text(struct: type[PartKeys]) -> str:
    """The head of the part's file, where its pins are drawn; of a file that has none, what its class says."""
    module = sys.modules.get(struct.__module__)
    head = module.__doc__ if module is not None else getattr(struct.make, "__globals__", {}).get("__doc__")
    return cleandoc(head or struct.__doc__ or "a part").rstrip()


def _about(struct: type[PartKeys], text: str) -> str:
    """In one line; a part that another one of its file is based on says itself what it is."""
    doc = struct.__doc__ if struct.__base__ is not PartKeys else None
    return f"{_SENTENCE.split(doc)[0].rstrip('.')}." if doc else text.partition("\n")[0]


def _keys(struct: type[msgspec.Struct], above: str = "", whole: Any = None) -> Iterator[Key]:
    """The keys of a table, those of tables in it by their paths. `whole`: the table that is the default."""
    for field in inspect.type_info(struct).fields:  # type: ignore[attr-defined]
        key = f"{above}{field.encode_name}"
        default = field.default if whole is None else getattr(whole, field.name)
        if isinstance(field.type, inspect.StructType):
            yield from _keys(field.type.cls, f"{key}.", None if default is msgspec.NODEFAULT else default)
            continue
        if default is msgspec.NODEFAULT and field.default_factory is not msgspec.NODEFAULT:
            default = field.default_factory()
        shown = "" if default in (msgspec.NODEFAULT, None) else msgspec.json.encode(default).decode()
        yield Key(key, takes(field.type, key), shown)


def takes(kind: inspect.Type, key: str = "") -> str:
    """What a key takes, in words of the file: `a number in milliseconds, 0 to 100`."""
    if isinstance(kind, inspect.Metadata):
        return takes(kind.type, key)
    if isinstance(kind, inspect.LiteralType):
        return " or ".join(msgspec.json.encode(value).decode() for value in kind.values)
    if isinstance(kind, inspect.UnionType):
        return " or ".join(dict.fromkeys(takes(one, key) for one in kind.types))
    if isinstance(kind, inspect.IntType | inspect.FloatType):
        what = "a whole number" if isinstance(kind, inspect.IntType) else "a number"
        unit = unit_name(key)
        return f"{what}{' in ' * bool(unit)}{unit}{_range(kind)}"
    words = {inspect.BoolType: "true or false", inspect.StrType: "a string", inspect.NoneType: "nothing"}
    return words.get(type(kind), "a list" if "Tuple" in type(kind).__name__ else "a table")


def _range(kind: inspect.IntType | inspect.FloatType) -> str:
    least = kind.gt if kind.ge is None else kind.ge
    most = kind.lt if kind.le is None else kind.le
    above, below = "above " * (kind.gt is not None), "below " * (kind.lt is not None)
    if least is not None and most is not None:
        return f", {above}{least:.12g} to {below}{most:.12g}"
    if least is not None:
        return f", {above or 'at least '}{least:.12g}"
    return f", {below or 'at most '}{most:.12g}" if most is not None else ""
