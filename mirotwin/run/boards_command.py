"""`mirotwin boards`: the built-in boards, and a description of each part."""

from __future__ import annotations

import sys
from inspect import cleandoc
from typing import Annotated, Any

import click
import msgspec
from msgspec import inspect

from miro_exact import installed
from miro_exact.bad_input import did_you_mean
from miro_robot.parts.keys import IN, OPEN_DRAIN, STRONG, TWO_WAY, PartKeys, Pin
from miro_robot.parts.resolve import BoardError
from miro_sim.scenario.base import is_path
from miro_sim.scenario.board_file import board_text, builtin_boards, check_struct, load_board, table_of
from miro_sim.scenario.parts import PARTS
from mirotwin.run.plugins_command import Key, about, keys_of, takes
from mirotwin.run.scenarios_command import ScenariosGroup
from mirotwin.shell.command import Argument, DeclaredOption, Options, command_of
from mirotwin.shell.console import plain_table
from mirotwin.shell.console import show as print_result
from mirotwin.shell.json_text import print_json
from mirotwin.shell.options import JSON
from mirotwin.shell.plugin_files import Parts, PluginFiles

KINDS = {IN: "input", STRONG: "output", OPEN_DRAIN: "open drain", TWO_WAY: "input and output"}


class PartPage(msgspec.Struct):
    """Facts about a part. `origin`: of a plug-in, its distribution or file. `text`: the head of its file."""

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
    """Names the right command if the first argument is a board or a part instead of a command."""

    def shows(self, name: str) -> bool:
        return name in builtin_boards() or name in PARTS.names() or is_path(name)


@click.group(
    cls=BoardsGroup,
    invoke_without_command=True,
    short_help="Lists the built-in boards, or shows a board or a part.",
)
@click.option(
    *(*JSON.names, "as_json"), cls=DeclaredOption, declared=JSON, heading="", is_flag=True, help=JSON.help
)
@click.pass_context
def boards(context: click.Context, as_json: bool) -> None:
    """Lists the built-in boards."""
    if context.invoked_subcommand is not None:
        return
    listed = [_board_line(name) for name in builtin_boards()]
    if as_json:
        print_json({"boards": listed})
        return
    table = plain_table("board", "chip", "crystal", "parts", bold=True)
    for board in listed:
        names = ", ".join(board["parts"])
        table.add_row(board["name"], board["chip"], f"{board['crystal_hz'] / 1e6:g} MHz", names)
    print_result(table, "", "a board's file, or the page of a part: mirotwin boards show NAME")
    print_result("the parts: mirotwin plugins parts")


def _board_line(name: str) -> dict[str, Any]:
    board = load_board(name)
    kinds = dict.fromkeys(part.keys.name for part in board.parts.values())
    return {"name": name, "chip": board.chip, "crystal_hz": board.crystal_hz, "parts": list(kinds)}


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
    PluginFiles(parts=options.parts).bring()
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
        remedy = did_you_mean(name, known, "`mirotwin boards` and `mirotwin plugins parts` list them")
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
    """Facts about a part. Raises PluginError for an unusable one."""
    struct = PARTS.find(name)
    check_struct(struct)
    text = _text(struct)
    return PartPage(
        name=name,
        origin=installed.described(PARTS.word, name).partition(": ")[2].partition(", sources")[0],
        about=about(struct),
        text=text,
        pins=[
            {"name": pin.name, "kind": KINDS[pin.kind], "unconnected": _unconnected(pin)}
            for pin in struct.PINS
        ],
        keys=list(keys_of(struct)),
        put=[Key(key, takes(inspect.type_info(kind), key)) for key, kind in struct.PUTS.items()],
        read={key: str(meaning) for key, meaning in struct.READS.items()},
        sheet=str(struct.SHEET),
    )


def _unconnected(pin: Pin) -> str:
    """The level that the part sees at an unconnected optional pin, in words."""
    if not pin.optional:
        return ""
    return "may be left out" if pin.kind == STRONG else f"may be left out: {'high' if pin.level else 'low'}"


def _text(struct: type[PartKeys]) -> str:
    """The head of the part's file, with a drawing of its pins; if the file has none, the class's docstring."""
    module = sys.modules.get(struct.__module__)
    head = module.__doc__ if module is not None else getattr(struct.make, "__globals__", {}).get("__doc__")
    return cleandoc(head or struct.__doc__ or "a part").rstrip()
