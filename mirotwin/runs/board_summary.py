"""The figures of a board's run: its `summary.json`, and the table on the screen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import msgspec

from miro_exact import engine
from miro_protocol.transmission import DOWN
from miro_sim.periods import Period
from mirotwin.runs.summary import FirmwareCounts, LiveFigures, StepResults, Summary
from mirotwin.verify.checks.interface import Expectation

if TYPE_CHECKING:
    from miro_sim.world.world import World  # a hot module: not before the engine was chosen

TAIL_BYTES = 40


class SerialCounts(msgspec.Struct):
    """Characters on the serial port of a board; `tail`: the last that it sent."""

    to_board: int = 0
    from_board: int = 0
    tail: bytes = b""

    def add(self, period: Period) -> None:
        """Takes over the characters of a control period."""
        for sent in period.wire:
            if sent.direction == DOWN:
                self.to_board += len(sent.data)
            else:
                self.from_board += len(sent.data)
                self.tail = (self.tail + sent.data)[-TAIL_BYTES:]


class SerialFigures(msgspec.Struct, frozen=True, omit_defaults=True):
    """Characters to the board and from it. `firmware_baud`: of its receiver, where the board file has another rate."""

    to_board: int
    from_board: int
    firmware_baud: int = 0


class BoardSummary(msgspec.Struct, frozen=True, omit_defaults=True):
    """`summary.json` of a board's run; fields with the same name mean the same as in `Summary`.

    `parts`: the values of the parts at the end of the run, by PART.KEY.
    """

    scenario: str
    board: str
    chip: str
    crystal_hz: int
    seed: int
    engine: str
    digest: str
    simulated_s: float
    wall_s: float
    realtime_factor: float
    serial: SerialFigures
    firmware: FirmwareCounts
    parts: dict[str, float | int | bool | str] = {}
    complete: bool = True
    reason: str = ""
    resumed_s: float | None = None
    set: tuple[str, ...] = ()
    expectations: tuple[Expectation, ...] = ()
    live: LiveFigures | None = None
    steps: StepResults | None = None


AnySummary = Summary | BoardSummary


def _other_baud(world: World) -> int:
    """The receiver's baud rate if it is more than 4 % from the board's, so that a real terminal would read garbage;
    else 0.
    """
    wanted, bit_ticks = world.scenario.board.baud, world.devices[0].board.cpu.peripherals.bit_ticks()
    if not wanted or not bit_ticks:
        return 0
    baud = round(world.clock / bit_ticks)
    return baud if abs(baud - wanted) > 0.04 * wanted else 0


def summarise_board(world: World, serial: SerialCounts, wall_s: float, begin_tick: int = 0) -> BoardSummary:
    """The summary of a run of `world` from `begin_tick`, without the optional fields."""
    scenario, clock = world.scenario, world.clock
    counters: Mapping[str, Mapping[str, Any]] = world.counters()
    values = (
        {}
        if world.last is None
        else {key: value for device in world.last.values for key, value in device.values.items()}
    )
    return BoardSummary(
        scenario=scenario.name,
        board=scenario.board.name,
        chip=scenario.board.chip,
        crystal_hz=clock,
        seed=world.seed,
        engine=engine.active(),
        digest=world.digest,
        simulated_s=world.tick / clock,
        wall_s=wall_s,
        realtime_factor=(world.tick - begin_tick) / clock / wall_s if wall_s > 0.0 else 0.0,
        serial=SerialFigures(serial.to_board, serial.from_board, _other_baud(world)),
        firmware=FirmwareCounts(sha256=world.image.sha256 or "", **counters["firmware"]),
        parts=values,
        resumed_s=begin_tick / clock if begin_tick else None,
    )
