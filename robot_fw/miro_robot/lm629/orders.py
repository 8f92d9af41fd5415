"""Derives the order to an LM629's wheel from its commands.

The control word of LTRJ is that of `buffers.py` (data sheet, table "trajectory control word"): bits 8 to 10 turn the
motor off, stop abruptly, stop smoothly; bits 5, 3, 1 announce acceleration, velocity and position, bits 4, 2, 0 make
them relative to what was loaded before.
"""

from __future__ import annotations

from typing import Literal

from miro_robot.lm629.buffers import (
    ACCELERATION,
    FORWARD,
    MOTOR_OFF,
    STOP_ABRUPTLY,
    STOPS,
    VELOCITY,
    VELOCITY_MODE,
)
from miro_robot.lm629.commands import BY_NAME

_RESET, _STT, _LTRJ = (BY_NAME[name].opcode for name in ("RESET", "STT", "LTRJ"))
_NO_WORD = 1 << 30


class WheelOrder:
    """The order in force, at first "off".

    `velocity` of "drive", else 0, in 1/65536 count per sample. `acceleration`: the one loaded when the order was given,
    in 1/65536 count per sample^2. `abrupt`: a "stop" without a ramp.
    """

    NOT_STATE = ("*",)

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Resets: no command was received."""
        self.what: Literal["off", "stop", "drive"] = "off"
        self.velocity = 0
        self.acceleration = 0
        self.abrupt = False
        self._control = 0  # what LTRJ loaded
        self._velocity = 0
        self._acceleration = 0

    def take(self, opcode: int, data: bytes) -> bool:
        """A command with its data bytes. Returns whether it is an order."""
        if opcode == _STT:
            self._start()
        elif opcode == _RESET:
            self.begin()
        elif opcode == _LTRJ and len(data) > 1:
            self._load(data)
        return opcode in (_STT, _RESET)

    def moves(self) -> bool:
        return self.velocity != 0

    def word(self) -> int:
        """The velocity as the radio carries it, in 1/256 count per sample, or 2^30, which no frame holds."""
        return _NO_WORD if self.velocity & 0xFF else self.velocity >> 8

    def _start(self) -> None:
        control = self._control
        self.velocity = 0
        self.acceleration = self._acceleration
        self.abrupt = control & (MOTOR_OFF | STOP_ABRUPTLY) == STOP_ABRUPTLY
        if control & MOTOR_OFF:
            self.what = "off"
        elif control & STOPS:
            self.what = "stop"
        else:
            self.what = "drive"
            backward = control & VELOCITY_MODE and not control & FORWARD
            self.velocity = -self._velocity if backward else self._velocity

    def _load(self, data: bytes) -> None:
        control = data[0] << 8 | data[1]
        self._control = control
        at = 2
        if control & ACCELERATION and at + 4 <= len(data):
            loaded = int.from_bytes(data[at : at + 4], "big", signed=True)
            self._acceleration = loaded + (self._acceleration if control & ACCELERATION >> 1 else 0)
            at += 4
        if control & VELOCITY and at + 4 <= len(data):
            loaded = int.from_bytes(data[at : at + 4], "big", signed=True)
            self._velocity = loaded + (self._velocity if control & VELOCITY >> 1 else 0)
