"""What two LM629s have been told to do, read from their commands: the order to each wheel.

The control word of LTRJ (data sheet, table "trajectory control word"): bits 8 to 10 turn the motor off, stop abruptly,
stop smoothly; bit 11 is velocity mode, bit 12 forward; bits 5, 3, 1 announce acceleration, velocity and position, bits
4, 2, 0 make them relative to what was loaded before.
"""

from __future__ import annotations

from miro_robot.lm629.commands import BY_NAME

OFF, STOP, DRIVE = range(3)
_OFF, _STOP, _DRIVE = OFF, STOP, DRIVE
_RESET, _STT, _LTRJ = (BY_NAME[name].opcode for name in ("RESET", "STT", "LTRJ"))
_WORD_OFF, _WORD_STOPS, _WORD_ABRUPT = 0x0100, 0x0600, 0x0200
_VELOCITY_MODE, _FORWARD = 0x0800, 0x1000
_ACCELERATION, _ACCELERATION_RELATIVE, _VELOCITY, _VELOCITY_RELATIVE = 0x20, 0x10, 0x08, 0x04
_NO_WORD = 1 << 30


class WheelOrders:
    """The orders in force by side, 0 left and 1 right; at first both are OFF."""

    NOT_STATE = ("_control", "_velocity", "_acceleration", "_what", "_speed", "_started", "_abrupt")

    def __init__(self) -> None:
        self._control = [0] * 2  # what LTRJ loaded
        self._velocity = [0] * 2
        self._acceleration = [0] * 2
        self._what = [0] * 2  # what is in force
        self._speed = [0] * 2
        self._started = [0] * 2
        self._abrupt = [0] * 2
        self.begin()

    def begin(self) -> None:
        """Nothing was told."""
        for side in range(2):
            self._reset(side)

    def take(self, side: int, opcode: int, size: int, high: int, low: int) -> bool:
        """A command with `size` bytes of data, the last seven of which are in `low`. Returns whether it is an order."""
        if opcode == _STT:
            self._start(side)
            return True
        if opcode == _RESET:
            self._reset(side)
            return True
        if opcode == _LTRJ:
            self._load(side, size, high, low)
        return False

    def what(self, side: int) -> int:
        """OFF, STOP or DRIVE."""
        return self._what[side]

    def velocity(self, side: int) -> int:
        """Of DRIVE, in 1/65536 count per sample; else 0."""
        return self._speed[side]

    def acceleration(self, side: int) -> int:
        """That which was loaded when the order was given, in 1/65536 count per sample^2."""
        return self._started[side]

    def abrupt(self, side: int) -> bool:
        """Whether it is a STOP without a ramp."""
        return self._abrupt[side] != 0

    def moves(self, side: int) -> bool:
        return self._what[side] == _DRIVE and self._speed[side] != 0

    def word(self, side: int) -> int:
        """The velocity as the radio carries it, in 1/256 count per sample: 0 unless the wheel is driven.

        2^30, which no frame holds, where it is no such number.
        """
        if self._what[side] != _DRIVE:
            return 0
        return _NO_WORD if self._speed[side] & 0xFF else self._speed[side] >> 8

    def _reset(self, side: int) -> None:
        self._control[side] = 0
        self._velocity[side] = 0
        self._acceleration[side] = 0
        self._what[side] = _OFF
        self._speed[side] = 0
        self._started[side] = 0
        self._abrupt[side] = 0

    def _start(self, side: int) -> None:
        control = self._control[side]
        self._speed[side] = 0
        self._abrupt[side] = 0
        self._started[side] = self._acceleration[side]
        if control & _WORD_OFF:
            self._what[side] = _OFF
        elif control & _WORD_STOPS:
            self._what[side] = _STOP
            self._abrupt[side] = 1 if control & _WORD_ABRUPT else 0
        else:
            self._what[side] = _DRIVE
            backward = control & _VELOCITY_MODE and not control & _FORWARD
            self._speed[side] = -self._velocity[side] if backward else self._velocity[side]

    def _load(self, side: int, size: int, high: int, low: int) -> None:
        control = _byte(size, high, low, 0) << 8 | _byte(size, high, low, 1)
        self._control[side] = control
        at = 2
        if control & _ACCELERATION and at + 4 <= size:
            value = _number(size, high, low, at)
            relative = control & _ACCELERATION_RELATIVE
            self._acceleration[side] = self._acceleration[side] + value if relative else value
            at += 4
        if control & _VELOCITY and at + 4 <= size:
            value = _number(size, high, low, at)
            self._velocity[side] = self._velocity[side] + value if control & _VELOCITY_RELATIVE else value


def _number(size: int, high: int, low: int, at: int) -> int:
    """Four bytes with sign, the first of which is byte `at`."""
    value = 0
    for place in range(4):
        value = value << 8 | _byte(size, high, low, at + place)
    return value - 0x100000000 if value >= 0x80000000 else value


def _byte(size: int, high: int, low: int, at: int) -> int:
    """Byte `at` of `size` ones."""
    behind = size - 1 - at
    if behind < 0:
        return 0
    if behind < 7:
        return low >> (8 * behind) & 0xFF
    return high >> (8 * (behind - 7)) & 0xFF
