"""Scenario files of boards, and of either kind: `board = ".."` at the top of a file makes it one of a board.

    board = "car.board.toml"                   a board file in this folder or below, a built-in board, or a whole table
    firmware = "car.hex"                       in this folder or below; --firmware stands instead of it
    duration_s = 20
    straps = { mode = 0 }                      jumpers that are set otherwise than the board file says
    put = { eyes.distance_cm = 60 }            values of parts at power-on
    [expect]
    [[step]]

Several boards on one line have a table each instead of `board`; paths and pins then have the board's name in front:

    [board.panel]
    file = "panel.board.toml"
    firmware = "panel.ihx"
    straps = { .. }

`scenario = ".."` with `set` (`base`) and settings work as for robots. What is read is a whole scenario: its board is a
table, and it depends on no other file.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta
from msgspec.structs import replace

from miro_exact.bad_input import BadInput, amount, did_you_mean
from miro_exact.clock import ticks
from miro_exact.inputs import path_beside
from miro_protocol.toml_text import TomlError, check_numbers, struct_of
from miro_robot.board_spec import BoardSpec
from miro_robot.image import load_hex
from miro_robot.parts.resolve import NAME, resolve
from miro_robot.parts.values import checked_put, leaves
from miro_sim.scenario import file as robots_file
from miro_sim.scenario.base import SCENARIO, is_path, with_base
from miro_sim.scenario.board import MOST_BOARDS, BoardScenario, OtherBoard
from miro_sim.scenario.board_file import ENDING, KEYS, board_of_table, builtin_boards, load_board, table_of
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import ReadText, ScenarioText, builtin_names, source_text, tables_of
from miro_sim.scenario.keys import Duration, Name
from miro_sim.scenario.settings import Setting, blamed, make

BOARD, FIRMWARE = "board", "firmware"
Table = dict[str, Any]


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The keys of a scenario file of a board; see `BoardScenario`."""

    board: Table
    name: Name = "board"
    title: Annotated[str, Meta(max_length=200)] = ""
    firmware: str = ""
    duration_s: Duration
    stop_on_fault: bool = True
    straps: dict[str, Annotated[int, Meta(ge=0, le=1)]] = {}
    put: Table = {}
    expect: Table = {}
    step: tuple[Table, ...] = ()
    bit_ticks: int = 0
    begin_tick: int = 0


class _OnLine(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One of several boards: its `file` or its whole table, and its `firmware`, which is read into `image`.

    That of the first board is the scenario's own.
    """

    file: str = ""
    board: Table = {}
    firmware: str = ""
    image: str = ""
    straps: dict[str, Annotated[int, Meta(ge=0, le=1)]] = {}


class BoardText(ReadText, frozen=True, kw_only=True):
    """A scenario of a board together with its text. `firmware`: the path of the image that it names, or ""."""

    scenario: BoardScenario
    firmware: str = ""


AnyText = ScenarioText | BoardText


def load_any(source: str, settings: Sequence[str] = ()) -> AnyText:
    """The scenario that `source` names, of robots or of a board. A board itself is a scenario without a duration.

    Raises BadInput: ScenarioError, or BoardError for what is wrong with the board's file.
    """
    if is_board(source):
        return _checked({BOARD: table_of(load_board(source)), "name": _name_of(source)}, source, settings)
    return any_of_text(source_text(source), source, settings)


def is_board(source: str) -> bool:
    """True if it names a board, and no scenario."""
    return source.endswith(ENDING) or (source in builtin_boards() and source not in builtin_names())


def any_of_text(text: str, origin: str, settings: Sequence[str] = ()) -> AnyText:
    """Like `load_any`, for a text that `origin` names, or that is in no file ("")."""
    raw = tables_of(text, origin)
    if BOARD not in raw and SCENARIO not in raw:
        return robots_file.of_text(text, origin, settings)
    whole, own = with_base(_complete(raw, origin), origin, lambda source: _complete(_read(source), source))
    if BOARD not in whole:
        return robots_file.of_text(text, origin, settings)
    return _checked(whole, origin, settings, own)


def board_of_tables(raw: Table, origin: str, settings: Sequence[str] = (), beside: str = "") -> BoardText:
    """Like `load_any`, for tables in another file. `beside`: path of that file, "" if they may name none."""
    return _checked(_complete(raw, beside), origin, settings)


def tables_of_board(scenario: BoardScenario) -> Table:
    """The tables of a file with this scenario, without what is expected of it. It has a duration."""
    assert scenario.duration_ticks is not None
    every = {
        "name": scenario.name,
        "title": scenario.title,
        "duration_s": scenario.duration_ticks / scenario.clock,
        "stop_on_fault": scenario.stop_on_fault,
        "bit_ticks": scenario.bit_ticks,
        "begin_tick": scenario.begin_tick,
        "put": dict(scenario.put),
        BOARD: table_of(scenario.board),
    }
    if scenario.others:
        others = {
            name: {BOARD: table_of(on_line.board), "image": on_line.image}
            for name, on_line in scenario.others.items()
        }
        every[BOARD] = {scenario.board_name: {BOARD: table_of(scenario.board)}, **others}
    return {key: value for key, value in every.items() if value not in ("", 0, {}) or value is False}


def _read(source: str) -> Table:
    return tables_of(source_text(source), source)


def _complete(raw: Table, origin: str) -> Table:
    """The tables with the board as a table, and the image's path relative to here."""
    complete = dict(raw)
    if origin and isinstance(raw.get(FIRMWARE), str):
        complete[FIRMWARE] = _beside(origin, FIRMWARE, raw[FIRMWARE])
    if BOARD not in raw:
        return complete
    board = raw[BOARD]
    if isinstance(board, str) and board:
        complete[BOARD] = _board_table(origin, board)
    elif not isinstance(board, dict):
        problem = f"expected a path, a name or a table, got {board!r}"
        raise ScenarioError(origin, BOARD, problem, 'write board = "NAME.board.toml"')
    elif _is_line(board):
        complete[BOARD] = {name: _on_line(origin, name, board[name], complete) for name in sorted(board)}
    if origin:
        complete.setdefault("name", _name_of(origin))
    return complete


def _is_line(board: Table) -> bool:
    """True if these are several boards on one line, each in a table of its name: one at least says which it is."""
    tables = [value for name, value in board.items() if name not in KEYS]
    return all(isinstance(value, dict) for value in board.values()) and any(
        "file" in table or BOARD in table for table in tables
    )


def _on_line(origin: str, name: str, table: Table, scenario: Table) -> Table:
    """One of several boards without other files; the image of the first is the scenario's."""
    place = f"{BOARD}.{name}"
    with ScenarioError.at(origin, place):
        keys = struct_of(table, _OnLine)
    board = _board_table(origin, keys.file) if keys.file else keys.board
    complete: Table = {BOARD: board, "image": keys.image}
    if keys.straps:
        complete["straps"] = keys.straps
    if keys.firmware:
        path = _beside(origin, f"{place}.{FIRMWARE}", keys.firmware)
        if name == min(scenario[BOARD]):
            if FIRMWARE in scenario:
                problem = "is that of the whole scenario, which names one, too"
                raise ScenarioError(origin, f"{place}.{FIRMWARE}", problem, "leave one of them out")
            scenario[FIRMWARE] = path
        else:
            complete["image"] = load_hex(path).content.decode("latin-1")
    return {key: value for key, value in complete.items() if value != ""}


def _board_table(origin: str, board: str) -> Table:
    if is_path(board):  # an error names that file
        return table_of(load_board(_beside(origin, BOARD, board)))
    with ScenarioError.at(origin, BOARD):
        return table_of(load_board(board))


def _beside(origin: str, key: str, path: str) -> str:
    """Path of a file named in another, relative to here. Raises ScenarioError for one outside of that file's folder."""
    if not origin:
        problem = "names a file, and stands in none itself"
        raise ScenarioError(origin, key, problem, "write the whole table instead")
    with ScenarioError.at(origin, key):
        return path_beside(origin, path)


def _name_of(source: str) -> str:
    """A name made of that of a file."""
    stem = Path(source).name.removesuffix(".toml").removesuffix(".scenario").removesuffix(".board")
    return re.sub(r"[^a-z0-9_-]+", "-", stem.lower()).strip("-_")[:64] or "board"


def _checked(raw: Table, origin: str, settings: Sequence[str] = (), own: Sequence[Setting] = ()) -> BoardText:
    """The scenario of these complete tables; makes the settings in them."""
    made = [*own, *make(raw, settings, origin)]
    try:
        scenario = _scenario(raw, origin)
    except ScenarioError as error:
        raise blamed(error, made, raw) from error.__cause__
    except RecursionError:
        raise ScenarioError(origin, "", "nested too deeply", "tables have at most 5 levels") from None
    firmware = raw.pop(FIRMWARE, "")
    return BoardText(origin, "", tuple(settings), (), raw, tuple(made), scenario=scenario, firmware=firmware)


def _scenario(raw: Table, origin: str) -> BoardScenario:
    with ScenarioError.at(origin):
        check_numbers(raw)
        try:
            file = struct_of(raw, _File)
        except TomlError as error:
            raise _explained(error, origin) from None
        others: dict[str, OtherBoard] = {}
        name = ""
        if _is_line(file.board):
            name, board, others = _line(file.board)
            if file.straps:
                raise BadInput("", "straps", "there are several boards", f"write board.{name}.straps")
        else:
            with ScenarioError.at("", BOARD):
                board = board_of_table(file.board, "")
        board = _strapped(board, file.straps)
        put = _puts(board, file.put) if not others else _puts_on_line(name, board, others, file.put)
        duration_ticks = max(1, ticks(file.duration_s, board.crystal_hz))
        try:
            return BoardScenario(
                name=file.name,
                title=file.title,
                board=board,
                duration_ticks=duration_ticks,
                stop_on_fault=file.stop_on_fault,
                bit_ticks=file.bit_ticks,
                begin_tick=file.begin_tick,
                put=put,
                expect=file.expect,
                step=file.step,
                board_name=name,
                others=others,
            )
        except ValueError as error:
            raise BadInput("", "", f"{error}") from None


def _line(tables: Table) -> tuple[str, BoardSpec, dict[str, OtherBoard]]:
    """The first board, by its name, and the others. Raises BadInput."""
    boards: dict[str, BoardSpec] = {}
    images: dict[str, str] = {}
    for name in sorted(tables):
        place = f"{BOARD}.{name}"
        with ScenarioError.at("", place):
            if not NAME.fullmatch(name):
                raise BadInput(
                    "", "", "cannot be the name of a board", "use letters, digits and _, not a digit first"
                )
            entry = struct_of(tables[name], _OnLine)
            for key in ("file", FIRMWARE):  # what is in the file has been read
                if getattr(entry, key):
                    raise BadInput("", key, "cannot be set", "change it in the scenario's file")
            if not entry.board:
                raise BadInput("", "file", "this key is missing", 'add file = "NAME.board.toml"')
            with ScenarioError.at("", BOARD):
                spec = board_of_table(entry.board, "", name)
            boards[name], images[name] = _strapped(spec, entry.straps), entry.image
            if not images[name] and name != min(tables):
                raise BadInput("", FIRMWARE, "no firmware is named", 'write firmware = "IMAGE.hex"')
    first = min(boards)
    for name, board in boards.items():
        if board.crystal_hz != boards[first].crystal_hz:
            problem = f"{board.crystal_hz} Hz, and {first} has {boards[first].crystal_hz} Hz"
            remedy = (
                "boards on one line need one crystal: give both the same, and each its baud rate for that"
            )
            raise BadInput("", f"{BOARD}.{name}.crystal_hz", problem, remedy)
    if not 2 <= len(boards) <= MOST_BOARDS:
        problem = f"{amount(len(boards), 'board')} on one line"
        raise BadInput("", BOARD, problem, f'give 2 to {MOST_BOARDS}, or board = ".." for one')
    others = {
        name: OtherBoard(board=board, image=images[name]) for name, board in boards.items() if name != first
    }
    return first, boards[first], others


def _puts_on_line(name: str, board: BoardSpec, others: dict[str, OtherBoard], table: Table) -> Table:
    """Like `_puts`, for several boards, whose names come first."""
    puts: Table = {}
    boards = {name: board, **{other: on_line.board for other, on_line in others.items()}}
    for path, value in leaves(table):
        device, _, rest = path.partition(".")
        if device not in boards:
            remedy = did_you_mean(device, boards, f"the boards are {', '.join(boards)}")
            raise BadInput("", f"put.{path}", f"there is no board {device!r}", remedy)
        taken = _puts(boards[device], {rest: value}, f"put.{device}")
        puts.update({f"{device}.{own}": value for own, value in taken.items()})
    return puts


def _explained(error: TomlError, origin: str) -> BadInput:
    if error.place == "duration_s" and is_board(origin):
        return BadInput("", error.place, "how long to run is missing", "give --for TIME, such as --for 2s")
    if error.place in ("network", "camera", "host", "lm629"):
        return BadInput("", error.place, "is for robots, and this scenario is for a board", "remove it")
    return error


def _strapped(board: BoardSpec, levels: dict[str, int]) -> BoardSpec:
    """The board with these straps at other levels."""
    straps = dict(board.straps)
    for name, level in levels.items():
        if name not in straps:
            remedy = f"its straps are {', '.join(straps)}" if straps else "its file has no [straps]"
            raise BadInput(
                "", f"straps.{name}", "the board has no such strap", did_you_mean(name, straps, remedy)
            )
        straps[name] = replace(straps[name], level=level)
    return replace(board, straps=straps)


def _puts(board: BoardSpec, table: Table, place: str = "put") -> dict[str, Any]:
    """The values in `put`, by PART.KEY, as the parts take them."""
    parts = {name: part.keys for name, part in board.parts.items()}
    pins = resolve(board).free_pins()
    puts = {}
    for path, value in leaves(table):
        try:
            name, _, puts[path] = checked_put(parts, path, value)
            if name not in parts and path not in pins:
                raise ValueError("something is wired to it; put a value of that")
        except ValueError as error:
            reason, _, remedy = f"{error}".removeprefix(f"{path}: ").partition("; ")
            raise BadInput("", f"{place}.{path}", reason, remedy) from None
    return puts


def check_single(scenario: BoardScenario, origin: str, command: str) -> None:
    """Raises BadInput for several boards on one line, for a command that takes one."""
    if scenario.others:
        problem = f"it has {amount(len(scenario.boards), 'board')} on one line, and {command} takes one"
        raise BadInput(origin, BOARD, problem, "`mirotwin run`, `test`, `replay`, `diff`, `serve` take them")


def firmware_beside(text: BoardText) -> str:
    """The image that a scenario of a board names. Raises BadInput where it names none that is there."""
    if not text.firmware:
        remedy = "give --firmware IMAGE.hex" + ("" if is_board(text.origin) else ', or firmware = ".." in it')
        raise BadInput(text.origin, "", "no firmware is named", remedy)
    if not os.path.exists(text.firmware):
        raise BadInput(
            text.origin, FIRMWARE, f"{text.firmware}: no such file", "build it, or give --firmware IMAGE"
        )
    return text.firmware
