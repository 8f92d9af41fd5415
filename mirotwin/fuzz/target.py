"""Targets: machines that run one fuzz input after the other, from the same moment each time; the robot is one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.actions import Action, Fault, Put, Reset, ScriptItem
from miro_protocol.table import downlink
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.board import Board
from miro_robot.broken import break_board
from miro_robot.harness.fast_oracle import NAMES, FastOracle
from miro_robot.harness.harness import AHEAD_TICKS, AWAKE, LEAD_TICKS, Harness
from miro_robot.harness.program import INPUTS, RESET_TICKS, Program
from miro_robot.image import Image
from miro_robot.mcs51.cpu import Cpu
from miro_robot.plant import IdealWheels
from miro_robot.wiring import load_wiring
from mirotwin.fuzz.inputs import inputs_of, seeds
from mirotwin.fuzz.spec import MAP_SIZE, TargetSpec
from mirotwin.shell.firmware_image import BOOT_PERIODS, is_up, load_firmware, not_up

NEVER_SLEEPS = "never_sleeps"
"""The check that the firmware goes back to sleep. On the robot's board the effects of that are judged."""
NEVER_SLEEPS_CODE = len(NAMES)


class TargetFailure(msgspec.Struct, frozen=True):
    """The failure of a run. `pc`: address of the instruction that did it, 0 where none is known."""

    check: str
    tick: int
    pc: int
    what: str


class Target(ABC):
    """`image` in `harness`, fed with what `program` reads. Edges are counted in the map of `use_map`, a writable buffer
    of `map_size` bytes. `slot`: of the robot in its network.

    `run(data)` puts it back and plays an input of any length; returns 0, or a number for the kind of `failure`.
    """

    map_size = MAP_SIZE

    def __init__(self, image: Image, harness: Harness, program: Program, slot: int = 0) -> None:
        self.image = image
        self.input = INPUTS[program.how]
        self.harness = harness
        self.program = program
        self.slot = slot
        self.executions = 0
        self.use_map(bytearray(MAP_SIZE))

    @property
    def cpu(self) -> Cpu:
        return self.harness.cpu

    def use_map(self, edges: Any) -> None:
        self.edges = edges
        self.cpu.watch_edges(memoryview(edges))

    @property
    @abstractmethod
    def failure(self) -> TargetFailure | None:
        """The failure of the last run."""

    @abstractmethod
    def run(self, data: Any) -> int:
        """See the class."""

    @abstractmethod
    def seeds(self) -> list[bytes]:
        """Inputs to begin with."""

    @abstractmethod
    def inputs_of(self, happened: Iterable[ScriptItem]) -> list[bytes]:
        """Inputs that send and do what `happened` lists."""

    def play(self, data: Any) -> int:
        """Puts the machine back and plays an input; how that ended, as of `Harness.play`."""
        program = self.program
        program.read(data)
        self.executions += 1
        return self.harness.play(program)

    def end_tick(self) -> int:
        """Last tick of the last run."""
        return self.harness.now_tick

    def script(self, data: bytes) -> list[ScriptItem]:
        """The characters that the processor receives of an input, and its resets, at ticks since power-on."""
        program = self.program
        program.read(data)
        items: list[ScriptItem] = []
        tick = first = self.harness.begin_tick + LEAD_TICKS
        values = bytearray()
        bad: list[int] = []

        def send() -> None:
            if values:
                items.append(Transmission(first, DOWN, bytes(values), bad_stop=tuple(bad)))
                values.clear()
                bad.clear()

        for place in range(program.count):
            value, bad_stop, reset, pause = program.character(place)
            if reset or pause:
                send()
                if reset:
                    items += self._reset(tick)
                items += self._puts(place)
                tick += pause
                first = tick
            if bad_stop:
                bad.append(len(values))
            values.append(value)
            tick += program.character_ticks
        send()
        if program.ends_with_reset():
            items += self._reset(tick)
        return items + self._puts(program.count)

    def _puts(self, place: int) -> list[ScriptItem]:
        """The puts before a character of the program."""
        puts = [self.program.put(number) for number in range(self.program.puts)]
        begin_tick = self.harness.begin_tick + LEAD_TICKS + AHEAD_TICKS
        return [
            self.put_at(begin_tick + ticks, which, value) for at, ticks, which, value in puts if at == place
        ]

    def put_at(self, tick: int, which: int, value: int) -> Put | Fault:
        """A put of the program as an action, of a robot a hardware fault; of a target whose programs have any."""
        raise NotImplementedError

    def note(self) -> str:
        """From when on inputs are played, for people; "" for what needs no words."""
        return ""

    def _reset(self, tick: int) -> list[Action]:
        begin_tick = tick + AHEAD_TICKS
        return [Reset(begin_tick, 0, self.slot, 1), Reset(begin_tick + RESET_TICKS, 0, self.slot, 0)]

    def describe(self, data: bytes) -> str:
        """An input as lines, one for each piece that the processor receives."""
        return "\n".join(described(item) for item in self.script(data))


def described(item: ScriptItem) -> str:
    """A line of text for people."""
    if isinstance(item, Transmission):
        bad = f", bad stop bits at {', '.join(map(str, item.bad_stop))}" if item.bad_stop else ""
        return f"{item.tick}: {item.data.hex(' ')}{bad}"
    if isinstance(item, Reset):
        return f"{item.tick}: reset {item.level}"
    if isinstance(item, Put):
        return f"{item.tick}: {item.text}"
    if isinstance(item, Fault):
        return f"{item.tick}: {item.what}"
    return str(item)


FAULT_WAYS = (
    *("flip", "lm629 left", "lm629 right", "power"),
    *("motor left", "motor right", "wheel left", "wheel right", "pin"),
)
OF_BROKEN = ("no_fault", "moves_only_when_fresh", "motors_off_ms", "answers_only_in_turn")
"""Checks that a robot with broken hardware must pass; it need not act. With a stuck pin only the first: another one of
P1 makes it another robot, and one of the LM629's bus brings other commands there.
"""
_LM629_WAYS = ("busy", "dead", "ok")
_PINS = [f"P{port}.{bit}" for port in range(4) for bit in range(8) if (port, bit) not in ((3, 0), (3, 1))]


def fault_of(which: int, value: int) -> str:
    """The fault that a put of a program means."""
    way = FAULT_WAYS[which]
    if way == "flip":
        return f"flip {value >> 3 & 0xFF:02X}h.{value & 7}"
    if way == "pin":
        return f"pin {_PINS[value // 3 % len(_PINS)]} {('0', '1', 'ok')[value % 3]}"
    if way.startswith("lm629"):
        return f"{way} {_LM629_WAYS[value % 3]}"
    broken = {"power": "dip", "motor": "open", "wheel": "blocked"}[way.split()[0]]
    return f"{way} {'ok' if value & 1 and way != 'power' else broken}"


class Breaker:
    """Breaks the hardware of `board` where a program puts something."""

    def __init__(self, board: Board, oracle: FastOracle) -> None:
        self.board, self.oracle = board, oracle

    def put(self, which: int, value: int, tick: int) -> None:
        fault = fault_of(which, value)
        break_board(self.board, fault)
        word, *values = fault.split()
        if word in ("motor", "wheel"):
            plant: Any = self.board.plant
            bit = 1 << 2 * (word == "wheel") + (values[0] == "right")
            plant.stopped = plant.stopped & ~bit if values[1] == "ok" else plant.stopped | bit
        if fault == "power dip":
            self.oracle.restarted(tick)


class RobotTarget(Target):
    """The MIRO's board with `image`, as robot `slot` of `robots`, motors unplugged, up and in silence. Raises BadInput
    where the firmware does not come up.

    A kind of failure is the place of its name in `fast_oracle.NAMES`. `accepted`: fresh frames of the last run.
    """

    def __init__(
        self,
        image: Image,
        input: str = "session",
        robots: int = 3,
        slot: int = 0,
        after_ticks: int | None = None,
        faults: bool = False,
    ) -> None:
        if input not in INPUTS:
            raise BadInput("", "", f"input {input!r}", f"use {', '.join(INPUTS)}")
        self.robots = robots
        self.board = _booted(image, slot, robots)
        self.oracle = FastOracle(self.board, slot, robots)
        cpu, bit_ticks = self.board.cpu, downlink(robots).bit_ticks
        after = -1 if after_ticks is None else after_ticks
        breaker = Breaker(self.board, self.oracle) if faults else None
        harness = Harness(self.board, cpu, self.oracle, bit_ticks, self.board, after, breaker)
        program = Program(INPUTS.index(input), slot, robots, choices=len(FAULT_WAYS) if faults else 0)
        super().__init__(image, harness, program, slot)
        self.code = 0

    @property
    def accepted(self) -> int:
        return self.oracle.accepted

    def run(self, data: Any) -> int:
        ended = self.play(data)
        self.code = self.oracle.code
        ways = [FAULT_WAYS[self.program.put(number)[2]] for number in range(self.program.puts)]
        if ways and NAMES[self.code] not in (OF_BROKEN[:1] if "pin" in ways else OF_BROKEN):
            self.code = 0
            return 0
        if ended == AWAKE and not self.code:
            self.code = NEVER_SLEEPS_CODE
        return self.code

    @property
    def failure(self) -> TargetFailure | None:
        if not self.code:
            return None
        if self.code == NEVER_SLEEPS_CODE:
            reason = "the firmware is awake 30 ms after the last character"
            return TargetFailure(NEVER_SLEEPS, self.harness.now_tick, 0, reason)
        check, tick = NAMES[self.code], self.oracle.tick
        if self.board.faults:
            return TargetFailure(check, tick, self.oracle.pc, str(self.board.faults[0]))
        return TargetFailure(check, tick, 0, f"{check} at tick {tick}")

    def seeds(self) -> list[bytes]:
        return seeds(self.input, self.robots, self.slot)

    def put_at(self, tick: int, which: int, value: int) -> Fault:
        return Fault(tick, 0, self.slot, fault_of(which, value))

    def inputs_of(self, happened: Iterable[ScriptItem]) -> list[bytes]:
        return inputs_of(self.input, happened, self.robots)

    def __repr__(self) -> str:
        return f"RobotTarget({self.image.path}, input={self.input!r}, robot {self.slot} of {self.robots})"


def robot_target(spec: TargetSpec) -> RobotTarget:
    """The target of a specification. Raises BadInput."""
    image = load_firmware(spec.image, named=False)
    return RobotTarget(image, spec.input, spec.robots, spec.slot, spec.after_ticks, spec.faults)


def _booted(image: Image, slot: int, robots: int) -> Board:
    board = Board(load_wiring(), IdealWheels(), slot, robots)
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
