"""A processor with 64 KB of RAM and a serial port, powered up with any firmware."""

from __future__ import annotations

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import NEVER_TICK
from miro_robot.board_spec import CRYSTAL_HZ, CRYSTAL_RANGE_HZ
from miro_robot.faults import FaultKind, FirmwareFault
from miro_robot.harness.recording_bus import RecordingBus
from miro_robot.image import Image
from miro_robot.mcs51.cpu import ASLEEP, Cpu
from mirotwin.shell.firmware_image import not_up
from mirotwin.verify.bare.exchange import Character, Exchange, MemoryView

BOOT_MS = 200
_SLICE = 20_000  # cycles
_CLOCK_CYCLES = 65_536  # after which every timer has overflowed
_LATEST = 1 << 50
_FASTEST = 32  # ticks a bit, of the fastest receiver there is
CHARACTER_BITS = 10
"""Start bit, eight data bits, stop bit."""
BAUD = "--baud"


class BareLine(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a firmware is clocked and spoken to with; a tick is a period of the crystal.

    `begin_tick`: it has started up, and is listened to. Raises ValueError for what no processor can do.
    """

    crystal_hz: int = CRYSTAL_HZ
    bit_ticks: int = 0
    begin_tick: int = 0

    def __post_init__(self) -> None:
        if not CRYSTAL_RANGE_HZ[0] <= self.crystal_hz <= CRYSTAL_RANGE_HZ[1]:
            limits = f"{CRYSTAL_RANGE_HZ[0]}..{CRYSTAL_RANGE_HZ[1]}"
            raise ValueError(f"crystal {self.crystal_hz} Hz is outside {limits}")
        if self.bit_ticks and not _FASTEST <= self.bit_ticks <= self.crystal_hz:
            raise ValueError(f"a bit of {self.bit_ticks} ticks is outside {_FASTEST}..{self.crystal_hz}")
        if not 0 <= self.begin_tick <= _LATEST:
            raise ValueError(f"begin_tick {self.begin_tick} is outside 0..{_LATEST}")

    def ticks(self, characters: int) -> int:
        """So many characters last without a pause between them."""
        return characters * CHARACTER_BITS * self.bit_ticks


class BareProcessor:
    """Powered on; `begin_tick` is when the first character could come."""

    STATE = {"bus": RecordingBus, "cpu": Cpu}
    NOT_STATE = ("image", "memory", "begin_tick")

    def __init__(self, image: Image) -> None:
        self.image = image
        self.bus = RecordingBus()
        self.cpu = Cpu(self.bus)
        self.bus.cpu = self.cpu
        self.cpu.load(image.code, image.used)
        self.cpu.txd.unread = True
        self.cpu.rxd.settled_tick = NEVER_TICK
        self.memory = MemoryView(self.cpu, self.bus, image)
        self.begin_tick = 0

    def start_up(self, crystal_hz: int, boot_ms: int) -> None:
        """Until the firmware sleeps, or so long. Raises BadInput where it does what it must not."""
        end = crystal_hz * boot_ms // 12_000
        self.cpu.stop_asleep = 1
        while self.cpu.cycles < end and not self.bus.fault_kind:
            if self.cpu.run(min(end, self.cpu.cycles + _SLICE)) == ASLEEP:
                break
        self.cpu.stop_asleep = 0
        if not self.cpu.peripherals.bit_ticks():  # the timer that clocks the serial port has to overflow once
            self.cpu.run(self.cpu.cycles + _CLOCK_CYCLES)
        self.begin_tick = 12 * self.cpu.cycles
        if self.bus.fault_kind:
            what = f"comes up with a fault: {self.fault()}"
            raise BadInput(self.image.path, "", what, "mend it, or see `mirotwin fw run`")

    def fault(self) -> FirmwareFault | None:
        """The first one since `RecordingBus.begin`."""
        bus = self.bus
        if not bus.fault_kind:
            return None
        symbol = self.image.symbols.name_at(bus.fault_pc)
        return FirmwareFault(FaultKind(bus.fault_kind), bus.fault_tick, bus.fault_pc, symbol)

    @property
    def faults(self) -> list[FirmwareFault]:
        found = self.fault()
        return [] if found is None else [found]

    def exchange(self) -> Exchange:
        """What went in and out since `RecordingBus.begin`, and the memories as they are now."""
        return Exchange(
            received=tuple(Character(value, tick, bool(stop)) for value, stop, tick in self.bus.heard),
            sent=tuple(Character(value, tick) for value, tick in self.bus.said),
            fault=self.fault(),
            begin_tick=self.begin_tick,
            reset_tick=None if self.bus.reset_tick < 0 else self.bus.reset_tick,
            end_tick=12 * self.cpu.cycles,
            memory=self.memory,
        )


def bit_ticks_of(processor: BareProcessor, crystal_hz: int, baud: int, boot_ms: int) -> int:
    """Length of a bit: by `baud`, or as the receiver is set. Raises BadInput where neither says it."""
    if baud:
        ticks = (2 * crystal_hz + baud) // (2 * baud)
        if not baud >= 50 or ticks < _FASTEST:
            what = f"{baud} is outside 50..{crystal_hz // _FASTEST} at {crystal_hz} Hz"
            raise BadInput("", BAUD, what, "give the rate of the firmware")
        return ticks
    ticks = processor.cpu.peripherals.bit_ticks()
    if not ticks:
        remedy = f"give {BAUD} if it listens all the same, or a longer --boot-ms"
        raise not_up(processor.image, remedy, boot_ms)
    return ticks
