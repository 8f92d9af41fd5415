"""A target: a booted robot that runs one fuzz input after the other, from the same moment each time."""

from __future__ import annotations

from typing import Any, Protocol

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.actions import ScriptItem
from miro_protocol.table import downlink
from miro_robot.board import Board
from miro_robot.harness.fast_oracle import NAMES, FastOracle
from miro_robot.harness.harness import AWAKE, Harness
from miro_robot.harness.program import INPUTS, Program
from miro_robot.image import Image
from miro_robot.mcs51.cpu import Cpu
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring
from mirotwin.fuzz.harness_target import MAP_SIZE as MAP_SIZE
from mirotwin.fuzz.harness_target import HarnessTarget
from mirotwin.fuzz.seeds import seeds
from mirotwin.verify.bare.exchange import NEVER_SLEEPS
from mirotwin.verify.boot import BOOT_PERIODS, is_up, not_up

NEVER_SLEEPS_CODE = len(NAMES)


class TargetFailure(msgspec.Struct, frozen=True):
    """What was wrong in a run. `pc`: address of the instruction that did it, 0 where none is known."""

    check: str
    tick: int
    pc: int
    what: str


class Target(Protocol):
    """See `RobotTarget`."""

    input: str
    map_size: int
    image: Image
    executions: int

    @property
    def cpu(self) -> Cpu: ...
    @property
    def failure(self) -> TargetFailure | None: ...
    def use_map(self, edges: Any) -> None: ...
    def run(self, data: Any) -> int: ...
    def script(self, data: bytes) -> list[ScriptItem]: ...
    def describe(self, data: bytes) -> str: ...
    def seeds(self) -> list[bytes]:
        """Inputs to begin with."""
        ...


class RobotTarget(HarnessTarget):
    """The MIRO's board with `image`, as robot `slot` of `robots`, motors unplugged, up and in silence.

    `run(data)` puts it back and plays an input of any length; returns 0, or the kind of `failure`, by the place of its
    name in `fast_oracle.NAMES`. Edges are counted in the map of `use_map`, a writable buffer of `map_size` bytes.
    `accepted`: fresh frames of the last run; `highest_sp`: how high its stack grew.
    """

    def __init__(self, image: Image, input: str = "session", robots: int = 3, slot: int = 0) -> None:
        if input not in INPUTS:
            raise BadInput("", "", f"input {input!r}", f"use {', '.join(INPUTS)}")
        self.robots = robots
        self.board = _booted(image, slot, robots)
        self.oracle = FastOracle(self.board, slot, robots)
        cpu, bit_ticks = self.board.cpu, downlink(robots).bit_ticks
        harness = Harness(self.board, cpu, self.oracle, bit_ticks, self.board)
        super().__init__(image, harness, Program(INPUTS.index(input), slot, robots), slot)
        self.code = 0

    @property
    def accepted(self) -> int:
        return self.oracle.accepted

    def run(self, data: Any) -> int:
        ended = self.play(data)
        self.code = self.oracle.code
        if ended == AWAKE and not self.code:
            self.code = NEVER_SLEEPS_CODE
        return self.code

    @property
    def failure(self) -> TargetFailure | None:
        """Of the last run."""
        if not self.code:
            return None
        if self.code == NEVER_SLEEPS_CODE:
            what = "the firmware is awake 30 ms after the last character"
            return TargetFailure(NEVER_SLEEPS, self.harness.now_tick, 0, what)
        check, tick = NAMES[self.code], self.oracle.tick
        if self.board.faults:
            return TargetFailure(check, tick, self.oracle.pc, str(self.board.faults[0]))
        return TargetFailure(check, tick, 0, f"{check} at tick {tick}")

    def seeds(self) -> list[bytes]:
        return seeds(self.input, self.robots, self.slot)

    def __repr__(self) -> str:
        return f"RobotTarget({self.image.path}, input={self.input!r}, robot {self.slot} of {self.robots})"


def target_for(image: Image, input: str = "session", robots: int = 3, slot: int = 0) -> RobotTarget:
    """The MIRO's board as a target. Raises BadInput where the firmware does not come up."""
    return RobotTarget(image, input, robots, slot)


def _booted(image: Image, slot: int, robots: int) -> Board:
    board = Board(load_wiring(), Plant(), slot, robots)
    board.load(image)
    board.cpu.rxd.settled_tick = (BOOT_PERIODS + 1) * CONTROL_PERIOD_TICKS
    board.cpu.txd.unread = True
    for period in range(1, BOOT_PERIODS + 1):
        board.run(period * CONTROL_PERIOD_TICKS)
        if board.faults:
            raise BadInput(
                image.path, "", f"the firmware comes up with a fault: {board.faults[0]}", "mend it"
            )
        if is_up(board.cpu):
            return board
    raise not_up(image, "only firmware that listens can be fuzzed through its serial port")
