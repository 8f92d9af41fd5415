"""A run of a board alone: what is done around it, and when it is over."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, ClassVar

import msgspec

from miro_exact.bad_input import did_you_mean
from miro_exact.clock import NEVER_TICK
from miro_protocol.actions import PutValue
from miro_robot.board_spec import BoardSpec
from miro_robot.parts.keys import PartKeys
from miro_robot.parts.values import checked_put
from miro_sim.scenario.terminal import TerminalSpec

MOST_PERIODS = 1 << 34
"""Ticks up to then fit into 64 bits, and so do the products that are made of them."""
PERIOD_TICKS = 2_400_000
"""From one digest to the next: 100 ms at 24 MHz. Three times as often costs a tenth of the speed."""
LATEST_BEGIN_TICK = 1 << 50
FASTEST_BIT_TICKS = 32
"""A bit of the fastest receiver there is: mode 2 with SMOD."""


MOST_BOARDS = 15
"""On one line."""


class OtherBoard(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One more board on the line. `image`: its firmware, as Intel HEX."""

    board: BoardSpec
    image: str


def check_board(path: str, boards: Collection[str], key: str = "") -> None:
    """Raises ValueError, which begins with `key`, unless `path` begins with the name of one of several boards."""
    name = path.partition(".")[0]
    if name not in boards:
        remedy = did_you_mean(name, boards) or f"write {next(iter(boards))}.{path}"
        raise ValueError(f"{key}{path}: there is no board {name!r}; {remedy}")


class BoardScenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """`board` on a wire. A tick is a period of its crystal.

    The wire's host is the `terminal`, or who injects, or a script. `bit_ticks`: length of the host's bits, 0 for the
    board's baud, or else those of its receiver. `duration_ticks`: default, without end. `stop_at`: the run stops before
    an instruction at one of these addresses; `stop_at_end`: when the program has ended; `stop_on_fault`: at the first
    firmware fault. `begin_tick`: the firmware has started up, and is judged from then on. `put`: values of parts at
    power-on, by PART.KEY. `step`: what is done during the run, as of a scenario of robots. `others`: more boards on the
    same line, in the order of their names, after `board_name`; then paths and pins have a board's name in front.
    Raises ValueError for values out of range, and for a value that no part takes.
    """

    name: str = "board"
    title: str = ""
    board: BoardSpec = BoardSpec()
    duration_ticks: int | None = None
    stop_on_fault: bool = True
    stop_at: tuple[int, ...] = ()
    stop_at_end: bool = False
    bit_ticks: int = 0
    terminal: TerminalSpec | None = None
    begin_tick: int = 0
    put: dict[str, PutValue] = {}
    expect: dict[str, Any] = {}
    step: tuple[dict[str, Any], ...] = ()
    board_name: str = ""
    others: dict[str, OtherBoard] = {}
    period_ticks: ClassVar[int] = PERIOD_TICKS
    """From one digest to the next."""

    def __post_init__(self) -> None:
        if self.bit_ticks and not FASTEST_BIT_TICKS <= self.bit_ticks <= self.board.crystal_hz:
            limits = f"{FASTEST_BIT_TICKS}..{self.board.crystal_hz}"
            raise ValueError(f"a bit of {self.bit_ticks} ticks is outside {limits}")

        if not 0 <= self.begin_tick <= LATEST_BEGIN_TICK:
            raise ValueError(f"begin_tick {self.begin_tick} is outside 0..{LATEST_BEGIN_TICK}")
        for path, value in self.put.items():
            board, own = self.at(path)
            checked_put({name: part.keys for name, part in board.parts.items()}, own, value)

    @property
    def host_bit_ticks(self) -> int:
        """Length of the host's bits: as given, or at the board's baud; 0 for those of the receiver."""
        board = self.board
        bauds = [keys.line_baud for keys in self.parts.values() if keys.line_baud]
        baud = bauds[0] if bauds else board.baud
        return self.bit_ticks or ((board.crystal_hz + baud // 2) // baud if baud else 0)

    @property
    def parts(self) -> dict[str, PartKeys]:
        """The keys of the parts, by name; of several boards, with the board's name in front."""
        if not self.others:
            return {name: part.keys for name, part in self.board.parts.items()}
        return {
            f"{board}.{name}": part.keys
            for board, spec in self.boards.items()
            for name, part in spec.parts.items()
        }

    @property
    def boards(self) -> dict[str, BoardSpec]:
        """All boards by their names, in the order of these."""
        return {self.board_name: self.board, **{name: on_line.board for name, on_line in self.others.items()}}

    def at(self, path: str) -> tuple[BoardSpec, str]:
        """The board of the name of a pin, and what the pin is called there. Raises ValueError for no board's."""
        if not self.others:
            return self.board, path
        check_board(path, self.boards, "pin: ")
        name, _, rest = path.partition(".")
        return self.boards[name], rest

    @property
    def clock(self) -> int:
        return self.board.crystal_hz

    @property
    def periods(self) -> int:
        """Digest periods of a run; the last one is that in which its duration ends."""
        if self.duration_ticks is None:
            return MOST_PERIODS
        return max(1, -(-self.duration_ticks // PERIOD_TICKS))

    @property
    def end_tick(self) -> int:
        return NEVER_TICK if self.duration_ticks is None else self.duration_ticks
