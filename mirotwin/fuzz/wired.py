"""A board with parts as the fuzzer plays it: brought up once in a World, then put back for each input.

    power-on ──> steps of the scenario, or what `_settled` waits for ──> up: inputs begin ──> characters, puts

Every value that a test may put is encoded in 16 bits (`choice_of`), so that inputs do not depend on the parts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CYCLE_TICKS, NEVER_TICK
from miro_protocol.actions import Put, PutValue, ScriptItem
from miro_robot.empty_board import EmptyBoard
from miro_robot.event_log import RECEIVED, SENT
from miro_robot.faults import FirmwareFault
from miro_robot.harness.recording_bus import BareOracle
from miro_robot.image import Image
from miro_robot.parts.keys import PartKeys
from miro_robot.parts.values import checked_put
from miro_robot.wired_board import WiredBoard
from miro_sim.scenario.board import BoardScenario
from miro_sim.world.wire import BoardAlone
from miro_sim.world.world import World
from mirotwin.fuzz.spec import MAP_SIZE
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.firmware_image import is_up
from mirotwin.verify.steps.keys import Step

BOOT_MS = 20_000
"""Longest time for firmware to settle, in milliseconds."""
SETTLED_MS = 300
"""The firmware has settled when no branch was new for this time."""
SLICE_MS = 10

Choice = tuple[str, Callable[[int], PutValue]]
"""The path of a value, and the function from 16 bits to the value to put there."""


class WiredMachine:
    """A board with booted firmware, the counterpart of `Processor` for boards with parts. `script`: the actions that
    booted it. `choices`: values that an input may put, first `values` values of parts, then pins. `to_pc`: characters
    that the board has sent since the last `begin`, with the tick of their stop bit.

    The first `count` of the `steps` boot it. Without steps it has booted when it sleeps, or when its receiver is on and
    no new branch was executed for 300 ms; or after `boot_ms`, if that is given. Raises BadInput for firmware that fails
    before.
    """

    NOT_STATE = ("*",)

    def __init__(
        self,
        scenario: BoardScenario,
        image: Image,
        steps: Sequence[Step] = (),
        count: int = 0,
        boot_ms: int = 0,
    ) -> None:
        self.steps = steps
        self.scenario = msgspec.structs.replace(scenario, stop_on_fault=True, step=())
        run = Run.traced(RunSpec(scenario=self.scenario, image=image, steps=steps[:count]))
        self.world = run.world
        device = self.world.devices[0]
        assert isinstance(device, BoardAlone)
        self.device = device
        self.board: EmptyBoard = device.board
        self.cpu = device.board.cpu
        self.image = image
        if count:
            self.how = _played(run)
        else:
            self.how = self._settled(boot_ms)
        if isinstance(self.board, WiredBoard) and self.board.drives_rxd:
            reason = "something on the board drives P3.0 (RXD), so nothing can be sent to its serial port"
            raise BadInput(image.path, "", reason, "wire it to another pin")
        if self.board.faults:
            reason = f"comes up with a fault: {self.board.faults[0]}"
            raise BadInput(image.path, "", reason, "mend it, or see `mirotwin run`")
        assert run.trace is not None
        self.script: Sequence[ScriptItem] = run.trace.script()
        self.begin_tick = self.cpu.cycles * CYCLE_TICKS
        values = choices_of(device.parts)[:256]  # an input names one by a byte
        self.values = len(values)
        pins = self.board.nets.netlist.free_pins() if isinstance(self.board, WiredBoard) else []
        self.choices = [*values, *((pin, _level) for pin in pins)]
        self.to_pc: list[tuple[int, int]] = []
        self.resets: list[int] = []
        self.bus = self  # it keeps what the serial port did, as a `RecordingBus` does
        self.oracle = BareOracle(self, self.cpu)
        self.cpu.rxd.settled_tick = NEVER_TICK
        self.board.input_tick = 0  # a character may always wake it
        self.board.sent = self._sent
        self.begin()

    def _settled(self, boot_ms: int) -> str:
        """Runs until the firmware sleeps or settles, or to the limit. Returns which of them it was."""
        cpu, world, clock = self.cpu, self.world, self.world.clock
        edges, seen, new_tick = bytearray(MAP_SIZE), 0, 0
        cpu.watch_edges(memoryview(edges))
        while not world.stopped and world.tick < clock * (boot_ms or BOOT_MS) // 1000:
            world.run_to(world.tick + clock * SLICE_MS // 1000)
            if cpu.idle and not boot_ms:
                return "the firmware sleeps"
            if edges.count(0) != seen:
                seen, new_tick = edges.count(0), world.tick
            elif is_up(cpu) and not boot_ms and world.tick - new_tick >= clock * SETTLED_MS // 1000:
                return f"its receiver is on, and no branch was new for {SETTLED_MS} ms"
        return f"after {boot_ms or BOOT_MS} ms{'' if is_up(cpu) else ', its receiver is off'}"

    def _sent(self, value: int, tick: int, bits: int, bit_ticks: int) -> None:
        self.to_pc.append((value, tick))

    def played(self) -> list[ScriptItem]:
        """Transmissions and actions of the scenario's steps after start-up, up to the first step that fails."""
        run = Run.traced(RunSpec(scenario=self.scenario, image=self.image, steps=self.steps))
        if run.player is None or run.trace is None:
            return []
        with suppress(BadInput):
            run.player.play()
        _let_arrive(run.world)
        return [item for item in run.trace.script() if item.tick >= self.begin_tick]

    # For the harness

    def run(self, tick: int) -> int:
        return self.device.run(tick)

    def set_reset(self, level: int) -> None:
        self.board.set_reset(level)

    def put(self, which: int, value: int, tick: int) -> None:
        path, value_of = self.choices[which]
        self.device.put(path, value_of(value), tick)

    def begin(self) -> None:
        """Resets the records after the state was restored to the start of inputs."""
        board = self.board
        board.faults.clear()
        board.log.cut(0)
        self.to_pc.clear()
        self.resets.clear()
        self.device.put_stopped = 0
        if isinstance(board, WiredBoard):
            board.starved.clear()
        if self.device.changes is not None:
            self.device.changes.restart(self.begin_tick)

    # For the target

    def put_at(self, tick: int, which: int, value: int) -> Put:
        """A put at `tick`, as an action of a stream."""
        path, value_of = self.choices[which]
        return Put(tick, 0, 0, path, value_of(value))

    def bits_of(self, which: int, value: PutValue) -> int:
        """The 16 bits that put `value`, or the nearest number to it."""
        values = [self.choices[which][1](bits) for bits in range(0x10000)]
        if value in values:
            return values.index(value)
        numbers = [bits for bits, each in enumerate(values) if not isinstance(each, str)]
        if isinstance(value, str) or not numbers:
            return 0
        return min(numbers, key=lambda bits: abs(float(values[bits]) - value))

    def fault(self) -> FirmwareFault | None:
        """The first one of the last run."""
        return self.board.faults[0] if self.board.faults else None

    @property
    def fault_kind(self) -> int:
        """Of the first fault, 0 without one."""
        return self.board.faults[0].kind if self.board.faults else 0

    @property
    def fault_tick(self) -> int:
        return self.board.faults[0].tick

    @property
    def received(self) -> list[tuple[int, int, int]]:
        """Characters that the serial port received: value, bit RB8, tick of RI."""
        return [(value, code, tick) for tick, code, value in self._noted(RECEIVED)]

    @property
    def sent(self) -> list[tuple[int, int]]:
        """Characters that the serial port sent: value, tick of TI."""
        return [(value, tick) for tick, _, value in self._noted(SENT)]

    def _noted(self, wanted: int) -> list[tuple[int, int, int]]:
        log = self.board.log
        events = [log.event(serial) for serial in range(log.first, log.end)]
        return [(tick, code, value) for tick, kind, code, value, _ in events if kind == wanted]


def _played(run: Run) -> str:
    """Plays the steps that bring the board up. Raises BadInput for one that fails."""
    player = run.player
    assert player is not None
    player.play()
    _let_arrive(run.world)
    if player.failure is not None:
        remedy = "mend it, or bring the board up by fewer --steps"
        raise BadInput(run.spec.image.path, "", f"does not come up: {player.failure}", remedy)
    return f"after {run.spec.steps[-1]}"


def _let_arrive(world: World) -> None:
    """Runs on until all that the steps sent and did has arrived."""
    line = world.lines[0]
    while not world.stopped and (
        line.outbox.waiting or line.actions.waiting or line.free_tick() > world.tick
    ):
        world.run_to(max(world.tick, line.free_tick()) + 1)


# What is put


def choices_of(parts: dict[str, PartKeys]) -> list[Choice]:
    """All values that a test may put, in the order of parts and keys, without types unknown to `choice_of`."""
    choices = []
    for name, keys in parts.items():
        for key, kind in keys.PUTS.items():
            path = f"{name}.{key}"
            value_of = choice_of(msgspec.inspect.type_info(kind))
            if value_of is not None and _takes(parts, path, value_of):
                choices.append((path, value_of))
    return choices


def _takes(parts: dict[str, PartKeys], path: str, value_of: Callable[[int], PutValue]) -> bool:
    try:
        for value in (0, 0x7FFF, 0xFFFF):
            checked_put(parts, path, value_of(value))
    except ValueError:
        return False
    return True


def choice_of(info: Any) -> Callable[[int], PutValue] | None:
    """From 16 bits to a value of this type; None for a type without a rule.

    A word or a boolean is chosen by the remainder, so that each bit of the low byte changes it. A number runs from its
    lowest to its highest value; one without a limit goes through decades by the high byte. Texts are bytes in hex.
    """
    kind = msgspec.inspect
    if isinstance(info, kind.BoolType):
        return lambda bits: bool(bits & 1)
    if isinstance(info, kind.LiteralType):
        words: Sequence[PutValue] = [word for word in info.values if word is not None]
        return lambda bits: words[bits % len(words)]
    if isinstance(info, kind.UnionType):
        rules = [rule for rule in map(choice_of, info.types) if rule is not None]
        return (lambda bits: rules[bits % len(rules)](bits // len(rules))) if rules else None
    if isinstance(info, kind.IntType | kind.FloatType):
        return _number(info)
    if isinstance(info, kind.StrType):
        return lambda bits: bits.to_bytes(2, "little").hex()
    return None


def _level(bits: int) -> PutValue:
    return bits & 1


def _number(info: Any) -> Callable[[int], PutValue]:
    whole = isinstance(info, msgspec.inspect.IntType)
    step = 1 if whole else 1e-9
    low = info.ge if info.ge is not None else None if info.gt is None else info.gt + step
    high = info.le if info.le is not None else None if info.lt is None else info.lt - step
    if low is not None and high is not None:
        span = high - low
        if whole:
            return lambda bits: int(low) + (bits * (int(span) + 1) >> 16)
        return lambda bits: float(min(high, max(low, float(f"{low + span * bits / 0xFFFF:.6g}"))))
    base, sign = (low, 1) if low is not None else (high, -1) if high is not None else (0, 1)

    def far(bits: int) -> PutValue:
        value = base + sign * (bits & 0xFF) * float(f"1e{(bits >> 8) % 8 - 4}")
        return int(value) if whole else float(value)

    return far
