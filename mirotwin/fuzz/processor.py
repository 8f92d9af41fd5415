"""A processor with 64 KB of RAM and a serial port, powered up with any firmware."""

from __future__ import annotations

from collections.abc import Sequence

from miro_exact.bad_input import BadInput
from miro_exact.clock import CYCLE_TICKS, NEVER_TICK
from miro_protocol.actions import ScriptItem
from miro_robot.board_spec import BoardSpec
from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.harness.recording_bus import BareOracle, RecordingBus
from miro_robot.image import Image
from miro_robot.mcs51.cpu import ASLEEP, Cpu
from miro_sim.scenario.board import FASTEST_BIT_TICKS, BoardScenario
from mirotwin.fuzz.wired import WiredMachine
from mirotwin.shell.firmware_image import not_up

BOOT_MS = 200
_SLICE = 20_000  # cycles
_CLOCK_CYCLES = 65_536  # after which every timer has overflowed
BAUD = "--baud"


class Processor:
    """Powered on. `scenario`: the board on its wire. The fuzzer plays it as it does a `WiredMachine`."""

    STATE = {"bus": RecordingBus, "cpu": Cpu}
    NOT_STATE = ("image", "network", "slot", "scenario", "oracle")

    def __init__(self, image: Image, scenario: BoardScenario) -> None:
        self.image = image
        self.scenario = scenario
        self.bus = RecordingBus()
        self.cpu = Cpu(self.bus)
        self.bus.cpu = self.cpu
        self.cpu.load(image.code, image.used)
        self.cpu.txd.unread = True
        self.cpu.rxd.settled_tick = NEVER_TICK
        self.network = self.slot = 0
        self.oracle = BareOracle(self.bus, self.cpu)

    @property
    def board(self) -> Processor:
        """The board that checks look at: the processor itself."""
        return self

    device = board
    script: Sequence[ScriptItem] = ()
    """The script that started it."""

    def run(self, tick: int) -> int:
        return self.cpu.run(-(-tick // CYCLE_TICKS))

    def start_up(self, crystal_hz: int, boot_ms: int) -> None:
        """Runs until the firmware sleeps, at most `boot_ms`. Raises BadInput for a firmware fault."""
        end = crystal_hz * boot_ms // 12_000
        self.cpu.stop_asleep = 1
        while self.cpu.cycles < end and not self.bus.fault_kind:
            if self.cpu.run(min(end, self.cpu.cycles + _SLICE)) == ASLEEP:
                break
        self.cpu.stop_asleep = 0
        if not self.cpu.peripherals.bit_ticks():  # the timer that clocks the serial port has to overflow once
            self.cpu.run(self.cpu.cycles + _CLOCK_CYCLES)
        if self.bus.fault_kind:
            reason = f"comes up with a fault: {self.fault()}"
            raise BadInput(self.image.path, "", reason, "mend it, or see `mirotwin fw run`")

    def fault(self) -> FirmwareFault | None:
        """The first firmware fault since `RecordingBus.begin`."""
        bus = self.bus
        if not bus.fault_kind:
            return None
        symbol = self.image.symbols.name_at(bus.fault_pc)
        return FirmwareFault(FaultKind(bus.fault_kind), bus.fault_tick, bus.fault_pc, symbol)


def powered(image: Image, crystal_hz: int, boot_ms: int) -> Processor:
    """A processor with its firmware up. Raises BadInput."""
    try:
        board = BoardSpec(crystal_hz=crystal_hz, bound_stack=False)
    except ValueError as error:
        raise BadInput("", "--crystal", str(error)) from None
    processor = Processor(image, BoardScenario(board=board))
    processor.start_up(crystal_hz, boot_ms)
    return processor


def bit_ticks_of(processor: Processor | WiredMachine, crystal_hz: int, baud: int, boot_ms: int) -> int:
    """Length of a bit in ticks, from `baud` or from the receiver's setting. Raises BadInput if neither is known."""
    if baud:
        ticks = (2 * crystal_hz + baud) // (2 * baud)
        if not baud >= 50 or ticks < FASTEST_BIT_TICKS:
            reason = f"{baud} is outside 50..{crystal_hz // FASTEST_BIT_TICKS} at {crystal_hz} Hz"
            raise BadInput("", BAUD, reason, "give the rate of the firmware")
        return ticks
    ticks = processor.cpu.peripherals.bit_ticks()
    if not ticks:
        remedy = f"give {BAUD} if it listens all the same, or a longer --boot-ms"
        raise not_up(processor.image, remedy, boot_ms)
    return ticks
