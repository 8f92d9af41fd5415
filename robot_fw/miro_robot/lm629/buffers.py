"""Double buffering: what LTRJ and LFIL load, and what STT and UDF take from it.

A parameter is held three times: in the primary registers (written word by word; STT and UDF leave them as they are), in
the copy that an accepted STT or UDF takes of them, and, outside this file, in the working registers, which get that
copy at the next sample.
"""

from __future__ import annotations

from miro_exact.state import FLAG

MOTOR_OFF, STOP_ABRUPTLY, STOP_SMOOTHLY = 0x0100, 0x0200, 0x0400
STOPS = MOTOR_OFF | STOP_ABRUPTLY | STOP_SMOOTHLY
VELOCITY_MODE, FORWARD = 0x0800, 0x1000
ACCELERATION, VELOCITY, POSITION = 0x0020, 0x0008, 0x0002
_MASK_30 = 0x3FFFFFFF
_PLACE = ("q", -(1 << 30), (1 << 30) - 1)
_FIT_30 = ("q", 0, _MASK_30)
_FIT_15 = ("i", 0, 0x7FFF)


COMPLETED, OUT_OF_RANGE = 1, 2
"""Result of a word: it completed an acceleration; its parameter was out of range."""

_STOPS, _MODES = STOPS, VELOCITY_MODE | FORWARD
_ACCELERATION, _VELOCITY, _POSITION = ACCELERATION, VELOCITY, POSITION
_COMPLETED, _OUT_OF_RANGE = COMPLETED, OUT_OF_RANGE


def clamped(value: int, low: int, high: int) -> int:
    return max(low, min(value, high))


def signed_32(value: int) -> int:
    return ((value + 0x80000000) & 0xFFFFFFFF) - 0x80000000


def signed_31(value: int) -> int:
    """Sign-extended from bit 30: the chip's position space."""
    return ((value + 0x40000000) & 0x7FFFFFFF) - 0x40000000


def fit_15(word: int, clamp: int) -> int:
    """A coefficient or a threshold: 15 bits."""
    return clamped(word, 0, 0x7FFF) if clamp else word & 0x7FFF


class TrajectoryBuffer:
    """LTRJ's primary registers and the copy an STT has taken.

    `due` holds the parameter bits of the control word that are still to come, `half` the high word of the
    next one (-1: none yet).
    """

    STATE = {
        "due": ("i", 0, 0xFFFF),
        "half": ("i", -1, 0xFFFF),
        "control": ("i", 0, 0xFFFF),
        "relative_bits": ("i", 0, 0xFFFF),
        "acceleration": _FIT_30,
        "velocity": _FIT_30,
        "position": _PLACE,
        "relative": FLAG,
        "newer_position": FLAG,
        "taken_control": ("i", 0, 0xFFFF),
        "taken_acceleration": _FIT_30,
        "taken_velocity": _FIT_30,
        "taken_position": _PLACE,
        "taken_relative": FLAG,
    }

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.due = 0
        self.half = -1
        self.control = 0
        self.relative_bits = 0
        self.acceleration = 0
        self.velocity = 0
        self.position = 0
        self.relative = False
        self.take()

    def begin(self, control: int) -> int:
        """The control word arrived. Returns how many words follow."""
        self.control = control & (_STOPS | _MODES)
        self.relative_bits = control
        self.due = control & (_ACCELERATION | _VELOCITY | _POSITION)
        self.half = -1
        return self.words_due()

    def words_due(self) -> int:
        """Number of words still expected: two per parameter."""
        parameters = (self.due >> 5 & 1) + (self.due >> 3 & 1) + (self.due >> 1 & 1)
        return 2 * parameters - (1 if self.half >= 0 else 0)

    def refresh(self, acceleration: int, velocity: int, target: int) -> None:
        """Parameters that the control word does not announce become these."""
        if not self.due & _ACCELERATION:
            self.acceleration = acceleration
        if not self.due & _VELOCITY:
            self.velocity = velocity
        if not self.due & _POSITION:
            self.position = target
            self.relative = False

    def word(self, word: int, acceleration: int, velocity: int, clamp: int = 0) -> int:
        """The next parameter word; relative ones add to the values given. Returns COMPLETED and OUT_OF_RANGE bits."""
        if self.half < 0:
            self.half = word
            return 0
        high = self.half
        value = high << 16 | word
        self.half = -1
        bit = self._next_parameter()
        self.due &= ~bit
        relative = self.relative_bits & bit >> 1 != 0
        if bit == _POSITION:
            fits = signed_31(value) == signed_32(value)
            if clamp and not fits and not relative:
                value = clamped(signed_32(value), -0x40000000, 0x3FFFFFFF)
        else:
            fits = relative or value <= _MASK_30
            value = _MASK_30 if clamp and not fits else value
        if bit == _ACCELERATION:
            self.acceleration = (value + (acceleration if relative else 0)) & _MASK_30
        elif bit == _VELOCITY:
            self.velocity = (value + (velocity if relative else 0)) & _MASK_30
        else:
            self.position = signed_31(value)
            self.relative = relative
            self.newer_position = True
        return (_COMPLETED if bit == _ACCELERATION else 0) | (0 if fits else _OUT_OF_RANGE)

    def _next_parameter(self) -> int:
        """Bit of the parameter whose words come next: acceleration, velocity, position."""
        if self.due & _ACCELERATION:
            return _ACCELERATION
        return _VELOCITY if self.due & _VELOCITY else _POSITION

    def abandon(self) -> None:
        """Another command came first: a parameter that is not complete is dropped."""
        self.due = 0
        self.half = -1

    def shift(self, real_position: int) -> None:
        """DFH moves the axis under a target that is loaded."""
        if not self.relative:
            self.position = signed_31(self.position - real_position)

    def take(self, keep_stops: int = 0) -> None:
        """STT was accepted: it will act on the registers as they are now; stop bits serve once."""
        self.taken_control = self.control
        self.taken_acceleration = self.acceleration
        self.taken_velocity = self.velocity
        self.taken_position = self.position
        self.taken_relative = self.relative
        if not keep_stops:
            self.control &= ~_STOPS
        self.newer_position = False

    def resolve(self, base: int) -> int:
        """The absolute target of the STT that executes now, kept for the next one."""
        position, relative = self.taken_position, self.taken_relative
        target = signed_31(base + position) if relative else position
        if not self.newer_position:
            self.position = target
            self.relative = False
        return target


class FilterBuffer:
    """LFIL's primary registers and the copy a UDF has taken: coefficients (kp, ki, kd, il), and ds."""

    STATE = {
        "due": ("i", 0, 0x000F),
        "coefficients": ("4i", 0, 0x7FFF),
        "ds": ("i", 0, 0xFF),
        "taken": ("4i", 0, 0x7FFF),
        "taken_ds": ("i", 0, 0xFF),
    }

    def __init__(self) -> None:
        self.coefficients = [0] * 4
        self.taken = [0] * 4
        self.reset()

    def reset(self) -> None:
        self.due = 0
        self.ds = 0
        for place in range(4):
            self.coefficients[place] = 0
        self.take()

    def begin(self, control: int) -> int:
        """The control word arrived. Returns how many words follow."""
        self.ds = control >> 8
        self.due = control & 0x000F
        return self.words_due()

    def words_due(self) -> int:
        """Number of words still expected: one per coefficient."""
        return (self.due >> 3 & 1) + (self.due >> 2 & 1) + (self.due >> 1 & 1) + (self.due & 1)

    def word(self, word: int, clamp: int = 0) -> int:
        """The next coefficient, 15 bits; bits 3 to 0 of `due` are those of kp to il. Returns 0 or OUT_OF_RANGE."""
        place = 0
        while place < 3 and not self.due & 8 >> place:
            place += 1
        self.due &= ~(8 >> place)
        self.coefficients[place] = fit_15(word, clamp)
        return _OUT_OF_RANGE if word > 0x7FFF else 0

    def abandon(self) -> None:
        """Another command came first."""
        self.due = 0

    def take(self) -> None:
        """UDF was accepted: it will act on the registers as they are now."""
        self.taken[:] = self.coefficients
        self.taken_ds = self.ds
