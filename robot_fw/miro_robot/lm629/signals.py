"""The signals register, the interrupt mask and what drives the HI pin.

Bits 7..1 are those of the status byte; bit 0 is not the busy bit but "a SIP is pending". When a bit is set is
decided in `chip.py`.
"""

from __future__ import annotations

from miro_robot.lm629.options import DEFAULT_OPTIONS, Lm629Options

INTERRUPT = 0x8000
ACCELERATION_LOADED = 0x4000
UPDATE_PENDING = 0x2000
FORWARD = 0x1000
VELOCITY_MODE = 0x0800
ON_TARGET = 0x0400
STOP_ON_ERROR = 0x0200
OUTPUT_8_BIT = 0x0100
MOTOR_OFF = 0x0080
BREAKPOINT = 0x0040
EXCESSIVE_ERROR = 0x0020
WRAP_AROUND = 0x0010
INDEX_ACQUIRED = 0x0008
TRAJECTORY_COMPLETE = 0x0004
COMMAND_ERROR = 0x0002
ACQUIRE_INDEX = 0x0001

_INTERRUPTS = 0x7E


class Signals:
    """`word`: the 16 bits as RDSIGS answers them. `mask`: 1 = the flag of that bit may raise HI. `outlives`: flags that
    the next RSTI leaves.
    """

    STATE = {"word": ("i", 0, 0xFFFF), "mask": ("i", 0, 0xFF), "outlives": ("i", 0, 0x7E)}
    NOT_STATE = ("level", "reset_raises", "reset_leaves")

    def __init__(self, options: Lm629Options = DEFAULT_OPTIONS) -> None:
        self.level = 1 if options.interrupt == "level" else 0
        self.reset_raises = 1 if options.reset_interrupts else 0
        self.reset_leaves = BREAKPOINT if options.reset_breakpoint == "stays" else 0
        self.clear(0)

    def clear(self, kept: int) -> None:
        """A reset begins; these bits stay."""
        self.word = kept
        self.mask = 0
        self.outlives = 0

    def after_reset(self) -> None:
        """All but the breakpoint may interrupt. Motor off counts as a trajectory that is complete."""
        self.mask = 0x3E
        self.word |= 0x0180 | self.reset_leaves
        self.outlives = self.reset_leaves
        if self.reset_raises:
            self.raise_flags(0x04)
        else:
            self.word |= 0x04
            self._follow()

    def raise_flags(self, flags: int) -> None:
        """Set flags of bits 6..1. As an event HI follows where one was 0 and is not masked."""
        if flags & ~self.word & self.mask:
            self.word |= 0x8000
        self.word |= flags
        self._follow()

    def reset_interrupts(self, keep: int) -> None:
        """RSTI: flags whose bit in `keep` is 0 are reset; as an event so is HI, whatever flags remain."""
        self.word &= (keep | self.outlives) & _INTERRUPTS | ~(_INTERRUPTS | 0x8000)
        self.outlives = 0
        self._follow()

    def mask_interrupts(self, mask: int) -> None:
        """MSKI."""
        self.mask = mask & _INTERRUPTS
        self._follow()

    def _follow(self) -> None:
        """HI as a level, where it is one."""
        if self.level:
            self.word &= 0x7FFF
            if self.word & self.mask:
                self.word |= 0x8000
