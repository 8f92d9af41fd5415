"""Names on a board of parts: `eyes.distance_cm`, `lcd.text`, the net `SDA`, all `parts`, all `nets`.

Names of the program come first, then registers, then parts, then nets. `parts.NAME` and `nets.NAME` always name a part
and a net, even if something else has the same name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from miro_exact.clock import CYCLE_TICKS
from miro_exact.plugins import PluginError
from miro_robot.processor_board import ProcessorBoard
from miro_robot.wired_board import WiredBoard
from mirotwin.debug.expression import NoValue, Value

GROUPS = ("parts", "nets")


def names_on(board: ProcessorBoard) -> list[str]:
    """The names that mean something on it."""
    if not isinstance(board, WiredBoard):
        return []
    return [
        *GROUPS,
        *(part.name for part in board.parts),
        *(net.partition(".")[0] for net in board.nets.names),
    ]


def value_on(board: ProcessorBoard, name: str) -> Value | None:
    """The part or the net of this name; None if the board has neither."""
    if not isinstance(board, WiredBoard):
        return None
    if name == "parts":
        return Value(members={part.name: partial(_part, board, part.name) for part in board.parts})
    if name in board.part_index:
        return _part(board, name)
    nets = _tree({net: partial(_level, board, number) for number, net in enumerate(board.nets.names)})
    return Value(members=nets) if name == "nets" else nets[name]() if name in nets else None


def levels_put_on(board: ProcessorBoard, port: int) -> int:
    """The levels that parts drive onto the pins of a port."""
    if not isinstance(board, WiredBoard):
        return 0xFF
    _sync(board)
    return board.nets.external[port]


def _part(board: WiredBoard, name: str) -> Value:
    """All values of a part: those that a test may read, and those that it may put."""
    part = board.parts[board.part_index[name]]
    put = [key for key in part.keys.PUTS if hasattr(part, key)]
    names = dict.fromkeys((*part.keys.READS, *put))
    return Value(members=_tree({key: partial(_read, board, name, key) for key in names}))


def _read(board: WiredBoard, name: str, key: str) -> Value:
    _sync(board)
    try:
        value = board.value(name, key)
    except PluginError as error:
        raise NoValue(f"{error}") from None
    return Value(number=int(value) if isinstance(value, bool) else value)  # a saved state gives it back as 1


def _level(board: WiredBoard, net: int) -> Value:
    _sync(board)
    drivers = board.nets.drivers(net)
    return Value(number=board.nets.levels[net], note=f"driven by {', '.join(drivers)}" if drivers else "")


def _sync(board: WiredBoard) -> None:
    """Parts that cannot reach the processor may be behind it."""
    board.sync(board.cpu.cycles * CYCLE_TICKS - 1)


def _tree(values: Mapping[str, Callable[[], Value]]) -> dict[str, Callable[[], Value]]:
    """Groups names with dots: `a.duty` is the member `duty` of `a`."""
    tree: dict[str, Callable[[], Value]] = {}
    groups: dict[str, dict[str, Callable[[], Value]]] = {}
    for path, get in values.items():
        name, dot, rest = path.partition(".")
        if dot:
            groups.setdefault(name, {})[rest] = get
        tree[name] = get
    return tree | {name: partial(Value, members=_tree(group)) for name, group in groups.items()}
