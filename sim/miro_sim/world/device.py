"""A device on a line of the world: a board with a processor, how it runs, and what a wait looks for on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from miro_exact.clock import CYCLE_TICKS
from miro_protocol.actions import OF_BOARDS, PutValue, fault_text
from miro_robot.broken import break_processor
from miro_robot.event_log import TRUE
from miro_robot.image import Image
from miro_robot.processor_board import ProcessorBoard
from miro_sim.world.conditions import PORT_PINS, unknown_robot_pin
from miro_sim.world.events import BoardLog

COUNTERS = ("frames_accepted", "frames_rejected", "frames_stale")


class Device:
    """`network` and `slot` name it in records: the line, and its place there.

    `marks`, `asked`: addresses and predicates of a wait. `pin_moves`: what the outside will put on port pins, where
    that is known: tick, port, levels.
    """

    STATE: dict[str, Any] = {"board": ProcessorBoard}
    NOT_STATE: tuple[str, ...] = (
        "network",
        "slot",
        "log",
        "marks",
        "asked",
        "image",
        "counter_addresses",
        "pin_moves",
    )

    changes: Any = None  # of a board with nets: what its nets and parts do

    def __init__(self, board: ProcessorBoard, network: int, slot: int, image: Image) -> None:
        self.board = board
        self.network = network
        self.slot = slot
        self.log = BoardLog(board.log, network, slot)
        self.marks: tuple[int, ...] = ()
        self.asked: list[tuple[Callable[[Any], object], str]] = []
        self.image = image
        self.pin_moves: list[tuple[int, int, int]] = []
        self.counter_addresses: list[int | None] | None = None

    def run(self, tick: int) -> int:
        """Runs the board to `tick`, watching for the conditions of a wait; not 0 when it stopped early."""
        if self.asked:
            return self._run_asking(tick)
        if self.marks:
            return self.board.run_to_any(self.marks, tick)
        return self.board.run(tick)

    def _run_asking(self, tick: int) -> int:
        """Runs the board to `tick` in steps, and evaluates the predicates after each, until one is true.

        A wait ends there. More entries would, one an instruction, push that first one out of the log.
        """
        board = self.board
        stopped = 0
        while not stopped and board.cpu.cycles * CYCLE_TICKS < tick:
            now = board.cpu.cycles * CYCLE_TICKS
            sample_tick = self.sample_tick()
            step_tick = now + 1 if any(when == "instruction" for _, when in self.asked) else sample_tick
            step_tick = min(step_tick, tick)
            stopped = board.run_to_any(self.marks, step_tick)
            reached = board.cpu.cycles * CYCLE_TICKS if step_tick == now + 1 else step_tick
            for predicate, when in self.asked:
                if (when == "instruction" or step_tick == sample_tick) and predicate(self):
                    board.log.note(TRUE, reached, 0, 0)
                    return stopped or board.run_to_any(self.marks, tick)
        return stopped

    def notes(self) -> list[str]:
        """Notes for the user on what the processor did, a line each, such as resets by its watchdog."""
        return []

    # Parts of a board

    def source(self, name: str) -> tuple[Any, str]:
        """The recorder of a pin's or value's changes (None if there is none), and its name there."""
        return self.changes, name

    def check_put(self, path: str, value: PutValue) -> None:
        """Raises ValueError for a part or a key that is not there, and for a value that the part does not take."""
        raise ValueError(f"net{self.network}/robot{self.slot} has no parts to put values of")

    def put(self, path: str, value: PutValue, tick: int) -> None:
        """Puts a value of a part at `tick`, between two instructions."""
        raise NotImplementedError

    def value(self, path: str) -> float | int | bool | str:
        """A value of a part (`PART.KEY`) as it is now. Raises ValueError for a part or a key that is not there."""
        raise ValueError(f"net{self.network}/robot{self.slot} has no parts with values")

    def values(self) -> dict[str, float | int | bool | str]:
        """All values of its parts as they are now, by path."""
        return {}

    # Hardware faults

    def check_fault(self, fault: str) -> None:
        """Raises ValueError for what is no fault, and for one that this board cannot have."""
        if fault_text(fault).split()[0] not in OF_BOARDS:
            raise ValueError(
                f'{fault!r} is a fault of a robot; put a value of the part, as eyes.echo = "none"'
            )

    def break_hardware(self, fault: str) -> None:
        """Does the fault, between two instructions, or what of it is not the line's."""
        break_processor(self.board, fault)

    # Pins

    def check_pin(self, name: str) -> None:
        """Raises ValueError for a pin that the board does not have."""
        if reason := unknown_robot_pin(name):
            raise ValueError(reason)

    def port_pin(self, name: str) -> tuple[int, int]:
        """Port and bit of a port pin."""
        return PORT_PINS[name]

    def sample_tick(self) -> int:
        """The next tick for predicates that are not evaluated after each instruction."""
        raise NotImplementedError

    def counter(self, index: int) -> int | None:
        """A frame counter of the firmware (16 bit), or None when the image exports no such symbol."""
        if self.counter_addresses is None:  # not before: it takes time to read symbols
            self.counter_addresses = [_iram_address(self.image, f"_{counter}") for counter in COUNTERS]
        address = self.counter_addresses[index]
        if address is None:
            return None
        cpu = self.board.cpu
        return cpu.peek_iram(address) | cpu.peek_iram(address + 1) << 8

    def records(self) -> list[Any]:
        """Lists that observers take and that no snapshot contains; `put_back` restores them."""
        return [list(self.board.faults), self.board.log.end]

    def put_back(self, records: list[Any]) -> None:
        """Takes back what `records` gave; nothing but more of the same may have happened since."""
        self.board.faults[:] = records[0]
        self.board.log.cut(records[1])


def _iram_address(image: Image, name: str) -> int | None:
    symbol = image.symbols.find(name)
    return symbol.address if symbol is not None and symbol.space == "iram" else None
