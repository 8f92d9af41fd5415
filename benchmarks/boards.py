"""What nets and parts of a board cost: ratios of runs that are interleaved in one process.

    python -m benchmarks.boards [--seconds 1] [--rounds 5] [--only NAME..]

A program moves a pin 20 times a millisecond, at 24 MHz. Each case runs it on a board of its own; `us an edge` is what
that took more than its base, and `x` how much faster than real time. The processor time of the process counts: other
programs on the machine disturb it less than the clock on the wall. The median of the rounds is shown.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from statistics import median
from typing import NamedTuple

from miro_exact import engine
from miro_exact.clock import CHARACTER_BITS, CONTROL_PERIOD_TICKS, CYCLE_TICKS
from miro_host.station import Station
from miro_robot.board import Board
from miro_robot.board_spec import BoardSpec, PartSpec
from miro_robot.build import board_of
from miro_robot.empty_board import EmptyBoard
from miro_robot.firmware import image_path
from miro_robot.image import SPACE_BYTES, Image, Symbols, load_hex
from miro_robot.parts.keys import LOW, OPEN_DRAIN, RELEASED, PartKeys, Pin, Place
from miro_robot.parts.led import Led
from miro_robot.parts.netlist import Netlist
from miro_robot.parts.part import Part
from miro_robot.processor_board import ProcessorBoard
from miro_robot.wired_board import WiredBoard
from miro_robot.wiring import load_wiring
from miro_sim.plant.drive import DifferentialDrive
from miro_sim.plant.params import DriveParams
from miro_sim.scenario.board_file import load_board

CRYSTAL_HZ = 24_000_000
EDGE_TICKS = 12 * 100
BIT_TICKS = CRYSTAL_HZ // 9600
WAIT = bytes([0x7F, 47, 0xDF, 0xFE, 0x80])  # MOV R7,#47; DJNZ R7,$; SJMP
IDLE = bytes([0x80, 0xFE])


def toggling(bit: int) -> bytes:
    """CPL bit, then a pause: an edge every 100 cycles."""
    return bytes([0x00, 0xB2, bit, *WAIT, 0xF7])


class PythonLed(PartKeys, frozen=True, kw_only=True, tag="python_led"):
    """A LED as a user would write it."""

    PINS = (Pin("pin"),)

    def make(self, place: Place) -> Part:
        return PythonLedPart(self, place)


class PythonLedPart(Part):
    STATE = {"on": ("i", 0, 1), "flashes": ("q", 0, 1 << 60)}

    def __init__(self, keys: PythonLed, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.on = self.flashes = 0

    def changed(self, pins: int, tick: int) -> None:
        self.on = 1 - self.level(0)
        self.flashes += self.on


class Clock(PartKeys, frozen=True, kw_only=True, tag="clock"):
    """Pulls its pin low and lets go, 1,000 edges a second."""

    PINS = (Pin("pin", OPEN_DRAIN),)

    def make(self, place: Place) -> Part:
        return ClockPart(self, place)


class ClockPart(Part):
    STATE = {"low": ("i", 0, 1)}

    def __init__(self, keys: Clock, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.low = 0

    def start(self, tick: int) -> None:
        self.next_tick = tick + self.ticks(1_000)

    def due(self, tick: int) -> None:
        self.low = 1 - self.low
        self.drive(0, LOW if self.low else RELEASED)
        self.next_tick = tick + self.ticks(1_000)


class Case(NamedTuple):
    """`base`: the case whose time is taken off. `driven`: a robot with the shipped firmware gets commands."""

    name: str
    make: Callable[[], ProcessorBoard]
    base: str = ""
    driven: bool = False


def empty(program: bytes) -> EmptyBoard:
    return EmptyBoard(BoardSpec(crystal_hz=CRYSTAL_HZ), image_of(program), False)


def without_parts(program: bytes) -> EmptyBoard:
    return WiredBoard(BoardSpec(crystal_hz=CRYSTAL_HZ), image_of(program), Netlist(), [], False)


def with_parts(program: bytes, *parts: tuple[str, PartKeys]) -> EmptyBoard:
    specs = {f"part{n}": PartSpec(keys=keys, pins={"pin": pin}) for n, (pin, keys) in enumerate(parts)}
    return board_of(BoardSpec(crystal_hz=CRYSTAL_HZ, parts=specs), image_of(program), 0, False)


def image_of(program: bytes) -> Image:
    digest = sha256(program).hexdigest()
    code = program.ljust(SPACE_BYTES, b"\xff")
    return Image(Path("program"), code, ((0, len(program)),), len(program), digest, Symbols({}))


def compiled_miro() -> ProcessorBoard:
    board = Board(load_wiring(), DifferentialDrive(DriveParams()))
    board.load(load_hex(image_path()))
    return board


def net_list_miro() -> ProcessorBoard:
    return board_of(load_board("miro"), load_hex(image_path()), 0, False)


ELSEWHERE = [(f"P{port}.{bit}", Led()) for port in (0, 3) for bit in (2, 3, 4, 5)] + [("P1.6", Led())]
P1, P2 = toggling(0x97), toggling(0xA7)
CASES = [
    Case("P2, empty board", lambda: empty(P2)),
    Case("P2, no parts", lambda: without_parts(P2), "P2, empty board"),
    Case("P2, led", lambda: with_parts(P2, ("P2.7", Led())), "P2, no parts"),
    Case("P2, led and 9 elsewhere", lambda: with_parts(P2, ("P2.7", Led()), *ELSEWHERE), "P2, no parts"),
    Case("P2, part in Python", lambda: with_parts(P2, ("P2.7", PythonLed())), "P2, no parts"),
    Case("P1, empty board", lambda: empty(P1)),
    Case("P1, led", lambda: with_parts(P1, ("P1.7", Led())), "P1, empty board"),
    Case("P1, part in Python", lambda: with_parts(P1, ("P1.7", PythonLed())), "P1, empty board"),
    Case("idle loop", lambda: empty(IDLE)),
    Case("a part drives P2.7, 1 kHz", lambda: with_parts(IDLE, ("P2.7", Clock())), "idle loop"),
    Case("MIRO drives, compiled board", compiled_miro, driven=True),
    Case("MIRO drives, net list", net_list_miro, driven=True),
]


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=1.0, help="of the board's time, in each round")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--only", nargs="*", default=[], help="cases with one of these texts, and their bases"
    )
    options = parser.parse_args(arguments)
    chosen = [case for case in CASES if not options.only or any(text in case.name for text in options.only)]
    needed = {base for case in chosen for base in (case.name, case.base)}
    boards = {case.name: case.make() for case in CASES if case.name in needed}
    stations = {case.name: Station(3) for case in CASES if case.driven}
    spent: dict[str, list[float]] = {name: [] for name in boards}
    for number in range(1, options.rounds + 2):
        for name, board in boards.items():
            spent[name].append(_time(board, int(number * options.seconds * CRYSTAL_HZ), stations.get(name)))
    medians = {name: median(times[1:]) for name, times in spent.items()}  # the first warms up
    print(f"engine {engine.active()}, {options.seconds:g} s of the board, median of {options.rounds}")
    for case in CASES:
        if case.name in medians:
            print(_line(case, medians, options.seconds))
    return 0


def _time(board: ProcessorBoard, tick: int, station: Station | None) -> float:
    if station is not None:
        first = board.cpu.cycles * CYCLE_TICKS
        return sum(_drive(board, begin, station) for begin in range(first, tick, CONTROL_PERIOD_TICKS))
    board.cpu.rxd.settled_tick = tick + 1_000
    start = time.process_time()
    board.run(tick)
    return time.process_time() - start


def _drive(board: ProcessorBoard, begin: int, station: Station) -> float:
    """The time of a control period in which the host sends a frame: both wheels turn, not alike."""
    level, tick = 1, begin + CONTROL_PERIOD_TICKS // 2
    for value in station.frame([(1500, 2000), (0, 0), (0, 0)]):
        for place, bit in enumerate((0, *(value >> n & 1 for n in range(8)), 1)):
            if bit != level:
                board.cpu.rxd.append(tick + place * BIT_TICKS, bit)
                level = bit
        tick += CHARACTER_BITS * BIT_TICKS
    board.cpu.rxd.settled_tick = begin + CONTROL_PERIOD_TICKS + 1_000
    start = time.process_time()
    board.run(begin + CONTROL_PERIOD_TICKS)
    return time.process_time() - start


def _line(case: Case, medians: dict[str, float], seconds: float) -> str:
    line = f"{case.name:28} {seconds / medians[case.name]:7.1f} x"
    if case.base:
        more = medians[case.name] - medians[case.base]
        edges = 1_000 * seconds if "1 kHz" in case.name else seconds * CRYSTAL_HZ / EDGE_TICKS
        line += f"  {100 * more / medians[case.base]:+6.1f} %  {1e6 * more / edges:6.3f} us an edge"
    return line


if __name__ == "__main__":
    sys.exit(main())
