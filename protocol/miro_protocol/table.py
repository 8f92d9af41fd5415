"""The one table that describes the wire: formats, messages, fields, flags and times."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from operator import index

from miro_exact import clock

# -- Time: ticks of the robot's 24 MHz crystal ---------------------------------------------------------------

TICKS_PER_US = clock.TICKS_PER_SECOND // 1_000_000
TICKS_PER_MS = 1000 * TICKS_PER_US
TICKS_PER_CYCLE = clock.CYCLE_TICKS  # 8051 machine cycle
BITS_PER_CHARACTER = clock.CHARACTER_BITS  # 8N1
HOST_BIT_TICKS = clock.HOST_BIT_TICKS  # 9600 baud
ROBOT_BIT_TICKS = clock.ROBOT_BIT_TICKS  # Timer 2 reload 65536 - 78: 9615.38 baud
TIMER2_RELOAD = 65536 - 78
KEYUP_TICKS = 1 * TICKS_PER_MS  # carrier on before the first start bit

SPACING_TICKS = 1040 * TICKS_PER_US  # start bit to start bit of characters that follow each other
SPACING_TOLERANCE_TICKS = 50 * TICKS_PER_US

FRESH_STEPS = 8  # (seq - last fresh seq) mod 64 of 1..8 is fresh
FRESH_AGAIN_TICKS = 150 * TICKS_PER_MS  # so long after the last fresh frame any step but 0 is
FAILSAFE_STOP_TICKS = 110 * TICKS_PER_MS  # without a fresh frame: smooth stop
FAILSAFE_OFF_TICKS = 500 * TICKS_PER_MS  # ... and motors off
SERVICE_EVERY = 8  # at most every 8th frame may be a service frame

# -- Values --------------------------------------------------------------------------------------------------

ROBOT_COUNTS = (3, 5)
SEQ_MODULUS = 64
VELOCITY_SATURATION = 16633  # 1.46 m/s in 1/256 count per LM629 sample: where the firmware cuts off
DEFAULT_ACCELERATION = 5973  # 6 m/s2 as 16.16 count/sample^2 at 6 MHz
POSITION_ERROR_MAX = (
    512  # counts (3.9 mm) that a wheel may be away from where it should be; beyond, motors off
)


class FrameType(IntEnum):
    """The two high bits of HDR."""

    TEAM = 0
    SERVICE = 1
    TELEMETRY = 2
    TEAM_ASK = 3


class Opcode(IntEnum):
    """Second byte of a service payload."""

    PING = 0
    FILTER = 1
    ACCELERATION = 2


class Flags(IntFlag):
    """The bits above the slot in telemetry's first byte. Bits 6 and 7 are sent as 0.

    A robot answers fresh frames only, and those end the failsafe: hence its flags tell of the time since the
    last answer, and answering clears them.
    """

    STOPPED = 0x08
    MOTORS_OFF = 0x10
    INIT_FAILED = 0x20


SLOT_MASK = 0x07
FLAG_MEANINGS = {
    Flags.STOPPED: "since its last answer: 110 ms without a fresh frame, smooth stop",
    Flags.MOTORS_OFF: "since its last answer: 500 ms without a fresh frame, motors off",
    Flags.INIT_FAILED: "an LM629 did not come out of reset as it should; its motor stays off",
}


@dataclass(frozen=True, slots=True)
class Field:
    """One little-endian number of a payload. `low` and `high`: limits of sent values, often narrower than the field."""

    name: str
    size: int
    low: int
    high: int
    unit: str
    meaning: str

    @property
    def signed(self) -> bool:
        return self.low < 0

    @property
    def c_type(self) -> str:
        return f"{'i' if self.signed else 'u'}{8 * self.size}"


@dataclass(frozen=True, slots=True)
class Format:
    """The layout of one kind of frame. Sizes and offsets are in characters."""

    name: str
    lead: bytes  # preamble for the slicer, then FFh so that the UART finds a true start edge
    sync: bytes
    layout: int  # fed to the CRC before HDR, never sent: another layout is another CRC
    payload_size: int
    bit_ticks: int

    @property
    def size(self) -> int:
        """Characters from the first sync byte to the last CRC byte: the decoder's window."""
        return len(self.sync) + self.body_size + 2

    @property
    def body_size(self) -> int:
        """HDR and payload: what the CRC covers besides the layout byte."""
        return 1 + self.payload_size

    @property
    def wire_size(self) -> int:
        return len(self.lead) + self.size

    @property
    def character_ticks(self) -> int:
        return BITS_PER_CHARACTER * self.bit_ticks

    @property
    def air_ticks(self) -> int:
        """First start bit to last stop bit, without the key-up."""
        return self.wire_size * self.character_ticks


SYNC = b"\x2d\xd4"
LAYOUT_TEAM = 0x10  # | N
DOWNLINK = {
    n: Format(f"host to robot, N={n}", b"\x55" * 5 + b"\xff", SYNC, LAYOUT_TEAM | n, 4 * n, HOST_BIT_TICKS)
    for n in ROBOT_COUNTS
}

# -- Payloads ------------------------------------------------------------------------------------------------

_SPEED = "1/256 count per LM629 sample"
_ACCELERATION = "1/65536 count per sample^2"
VELOCITY = (
    Field("left", 2, -32767, 32767, _SPEED, "left wheel"),
    Field("right", 2, -32767, 32767, _SPEED, "right wheel"),
)
SERVICE = (
    Field("slot", 1, 0, max(ROBOT_COUNTS) - 1, "", "addressed robot, below N"),
    Field("opcode", 1, min(Opcode), max(Opcode), "", "what follows; the rest of the payload is zero"),
)
SERVICE_DATA: dict[int, tuple[Field, ...]] = {
    Opcode.PING: (),
    Opcode.FILTER: tuple(
        Field(name, 2, 0, 0x7FFF, "", f"LM629 filter word {name}, both wheels")
        for name in ("kp", "ki", "kd", "il")
    ),
    # 0 would take the failsafe's smooth stop away.
    Opcode.ACCELERATION: (
        Field("acceleration", 4, 1, 0x3FFF_FFFF, _ACCELERATION, "in motion it waits for standstill"),
    ),
}
TELEMETRY_FIELDS = (
    Field("slot_flags", 1, 0, 0xFF, "", "bits 0-2 slot, bits 3-5 flags"),
    Field("status_left", 1, 0, 0xFF, "", "LM629 status byte"),
    Field("status_right", 1, 0, 0xFF, "", "LM629 status byte"),
    Field("position_left", 2, 0, 0xFFFF, "count", "low 16 bits of the real position"),
    Field("position_right", 2, 0, 0xFFFF, "count", "low 16 bits of the real position"),
    Field("accepted", 1, 0, 0xFF, "", "fresh frames, wraps"),
    Field("rejected", 1, 0, 0xFF, "", "frames with bad CRC, wraps"),
)
_TELEMETRY_SIZE = sum(field.size for field in TELEMETRY_FIELDS)
TELEMETRY = Format("robot to host", b"\x55" * 4 + b"\xff", SYNC, 0x1E, _TELEMETRY_SIZE, ROBOT_BIT_TICKS)
SEQ = Field(
    "seq", 1, 0, SEQ_MODULUS - 1, "", "one counter for all types; telemetry repeats the frame it answers"
)

FRAME_MEANINGS = {
    FrameType.TEAM: "velocities of all N robots",
    FrameType.SERVICE: "setting of one robot; all wheels keep their velocities",
    FrameType.TELEMETRY: "answer of one robot (robot to host only)",
    FrameType.TEAM_ASK: "velocities, and robot (seq mod N) answers",
}


def downlink(n: int) -> Format:
    """The host-to-robot format of a network of `n` robots; ValueError unless n is 3 or 5."""
    try:
        return DOWNLINK[index(n)]
    except (KeyError, TypeError):
        limits = " or ".join(str(count) for count in ROBOT_COUNTS)
        raise ValueError(f"robot count n = {n!r}: a network has {limits} robots") from None
