"""The first instructions that two firmwares of the same layout execute differently.

Two instructions are searched. *Changed*: the first executed instruction with different code; found at full speed, by
marks at all changed addresses. *Effect*: the instruction after which the processors' states stay different. The worlds'
states are compared every millisecond, and after the last equal comparison at each step. An effect that vanishes within
a millisecond does not count; then only the first changed instruction is reported.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from miro_exact.clock import CONTROL_PERIOD_TICKS, CYCLE_TICKS
from miro_exact.state import Flat
from miro_robot.image.symbol_files import STACK
from miro_robot.inspect.watcher import Watcher, attach, detach
from miro_robot.mcs51.opcodes import LENGTH
from miro_sim.world.conditions import Reached
from miro_sim.world.waits import WaitExpired
from mirotwin.replay.lockstep.annotated_image import AnnotatedImage, CodeLocation, changed_instructions
from mirotwin.replay.lockstep.fields import Record, Value, item_differences, name_of_byte
from mirotwin.replay.lockstep.pair import LOOK_TICKS, WorldPair

if TYPE_CHECKING:
    from miro_robot.image import Image
    from miro_robot.mcs51.cpu import Cpu
    from miro_sim.world.device import Device
    from miro_sim.world.events import Event
    from miro_sim.world.world import World

STEPPED_TICKS = 4 * CONTROL_PERIOD_TICKS
"""Longest comparison of single steps.

If it finds nothing, the states differ, but not by an instruction of a processor.
"""
LASTING_TICKS = 12_012
"""For how long states must differ so that it is an effect: half a millisecond, no part of one."""
REGISTERS = {
    "pc": "PC", "a": "ACC", "b": "B", "sp": "SP", "dptr": "DPTR", "cy": "CY", "ac": "AC", "ov": "OV",
    "pcon": "PCON", "bank": "register bank", "user_flags": "F0, UD", "cycles": "machine cycles",
    **{f"peripherals.ports.latches[{port}]": f"P{port}" for port in range(4)},
}  # fmt: skip
_RAM_BYTES = 0x100
DERIVED = ("instructions", "idle_cycles", "blocked")
"""Counts that follow from others; not compared."""


class ValueDifference(Record, frozen=True):
    """A register or a variable that differs."""

    name: str
    one: Value
    other: Value


class InstructionDifference(Record, frozen=True):
    """The instruction at which two firmwares differ, and the registers and variables that differ after it.

    `parted`: the first firmware's instruction after which both continue at different addresses.
    """

    network: int
    slot: int
    one: CodeLocation
    other: CodeLocation
    values: tuple[ValueDifference, ...]
    parted: CodeLocation | None = None


class ExecutedInstruction(NamedTuple):
    """An instruction, or an interrupt's call (`code` empty), and the processor's state after it."""

    cycle: int
    pc: int
    code: bytes
    state: bytes
    next_pc: int


class LiveState:
    """The state of a processor without the bytes above its stack pointer, which are written before they are read.

    `stack`: first address of the stack; None: unknown, then all RAM counts.
    """

    def __init__(self, cpu: Cpu, stack: int | None) -> None:
        self.cpu = cpu
        self.flat = Flat(cpu)
        self.stack = stack
        assert self.flat.fields[0].path == "iram"

    def save(self) -> bytes:
        state, top = self.flat.save(), self.cpu.sp + 1
        if self.stack is None or top < self.stack:
            return state
        return state[:top] + bytes(_RAM_BYTES - top) + state[_RAM_BYTES:]


class Processors(WorldPair):
    """Two worlds of which only the processors are compared."""

    def __init__(self, world: World, other: World) -> None:
        super().__init__(world, other)
        # One layout: where one image has no symbols, its stack begins where that of the other does.
        stacks = (image.symbols.names.get(STACK) for image in (world.image, other.image))
        self.stack = next((symbol.address for symbol in stacks if symbol is not None), None)
        both = zip(world.devices, other.devices, strict=True)
        self.live = [
            (LiveState(a.board.cpu, self.stack), LiveState(b.board.cpu, self.stack)) for a, b in both
        ]

    def differ(self) -> bool:
        return any(here.save() != there.save() for here, there in self.live)


class InstructionLog(Watcher):
    """Records the instructions of a device's processor until `detach`."""

    def __init__(self, device: Device, stack: int | None) -> None:
        self.device = device
        self.live = LiveState(device.board.cpu, stack)
        self.steps: list[ExecutedInstruction] = []
        attach(device.board.cpu, self)

    def detach(self) -> None:
        detach(self.device.board.cpu, self)

    def executed(self, cpu: Cpu, pc: int, start: int) -> None:
        code = bytes(cpu.code_at(pc + offset) for offset in range(LENGTH[cpu.code_at(pc)]))
        self.steps.append(ExecutedInstruction(start, pc, code, self.live.save(), cpu.pc))

    def interrupted(self, cpu: Cpu, source: int, pc: int, start: int) -> None:
        self.steps.append(ExecutedInstruction(start, pc, b"", self.live.save(), cpu.pc))


class Stepper:
    """Two worlds at one tick with firmwares of the same layout."""

    def __init__(self, world: World, other: World, annotated: tuple[AnnotatedImage, AnnotatedImage]) -> None:
        self.pair = Processors(world, other)
        self.annotated = annotated

    def changed(self, until_tick: int) -> InstructionDifference | None:
        """The first changed instruction that is executed, with its effect in both worlds."""
        world, other = self.pair.one, self.pair.other
        event = first_reached(world, changed_instructions(world.image, other.image), until_tick)
        if event is None:
            return None
        other.run_to(world.tick)
        device = world.device(event.network, event.slot)
        tick = device.board.cpu.cycles * CYCLE_TICKS
        for here, there in self._pieces(tick + 1, tick + 1):
            if here.device is device and here.steps and there.steps:
                return self._difference(here, there, 0, -1)
        place, other_place = (image.place(event.address, tick) for image in self.annotated)
        return InstructionDifference(device.network, device.slot, place, other_place, ())

    def effect(self, until_tick: int) -> InstructionDifference | None:
        """The instruction after which the processors are not in the same state again, from now to `until_tick`."""
        while True:
            found_tick = self.pair.narrow(LOOK_TICKS, until_tick)
            if found_tick is None:
                return None
            differences = [
                self._difference(here, there, *lasting)
                for here, there in self._pieces(found_tick + LASTING_TICKS, found_tick + STEPPED_TICKS)
                if (lasting := _lasting(here.steps, there.steps)) is not None
            ]
            if differences:
                return min(differences, key=lambda difference: difference.one.tick)

    def _pieces(self, tick: int, end_tick: int) -> Iterator[tuple[InstructionLog, InstructionLog]]:
        """Runs both to `tick` and in pieces on to `end_tick`; all devices of the first piece that is not the same."""
        world, other, stack = self.pair.one, self.pair.other, self.pair.stack
        both = zip(world.devices, other.devices, strict=True)
        pairs = [(InstructionLog(a, stack), InstructionLog(b, stack)) for a, b in both]
        try:
            while True:
                self.pair.run_to(tick)
                unlike = [(here, there) for here, there in pairs if here.steps != there.steps]
                if unlike or tick >= end_tick or self.pair.over:
                    yield from unlike or pairs
                    return
                for log in (each for pair in pairs for each in pair):
                    log.steps.clear()
                tick = min(end_tick, tick + LOOK_TICKS)
        finally:
            for log in (each for pair in pairs for each in pair):
                log.detach()

    def _difference(
        self, here: InstructionLog, there: InstructionLog, index: int, parted: int
    ) -> InstructionDifference:
        device = here.device
        values = _values(device, self.pair.one.image, here.steps[index].state, there.steps[index].state)
        places = [
            image.place(step.pc, step.cycle * CYCLE_TICKS)
            for at in (index, *([parted] if parted >= 0 else []))
            for image, step in zip(self.annotated, (here.steps[at], there.steps[at]), strict=True)
        ]
        return InstructionDifference(
            device.network, device.slot, places[0], places[1], tuple(values), *places[2:3]
        )


def first_reached(
    world: World, addresses: Iterable[int], until_tick: int, devices: Sequence[Device] | None = None
) -> Event | None:
    """Runs to the moment at which one of these devices (None: any) is about to execute one of the addresses."""
    conditions = [
        Reached(address=address, network=device.network, slot=device.slot)
        for device in (devices or world.devices)
        for address in addresses
    ]
    try:
        return world.run_until(conditions, until_tick - world.tick) if conditions else None
    except WaitExpired:
        return None


def _lasting(
    log: Sequence[ExecutedInstruction], other_log: Sequence[ExecutedInstruction]
) -> tuple[int, int] | None:
    """From which step on the states are not the same again, and at which they go different ways (-1: at none)."""
    steps = list(zip(log, other_log, strict=False))
    first = len(steps)
    while first and steps[first - 1][0][1:] != steps[first - 1][1][1:]:
        first -= 1
    if first == len(steps):
        return None
    parted = (at for at in range(first, len(steps)) if steps[at][0].next_pc != steps[at][1].next_pc)
    return first, next(parted, -1)


def _values(device: Device, image: Image, state: bytes, other_state: bytes) -> Iterator[ValueDifference]:
    """Registers and variables that differ, by the names that people have for them; of the first firmware."""
    flat = Flat(device.board.cpu)
    values, others = flat.decode(state), flat.decode(other_state)
    for path, value in values.items():
        if path in DERIVED:
            continue
        for item, here, there in item_differences(value, others[path]):
            name = path + item
            if path == "iram":
                name = _byte_name(image, int(item[1:-1]), values["bank"])
            yield ValueDifference(REGISTERS.get(name, name), here, there)


def _byte_name(image: Image, address: int, bank: int) -> str:
    if bank <= address < bank + 8:
        return f"R{address - bank}"
    name = name_of_byte(image, address)
    return f"{name} ({address:02X}h)" if name else f"RAM {address:02X}h"
