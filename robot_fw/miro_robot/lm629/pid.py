"""The digital filter: error in, 16-bit drive out, once per sample.

Equation and widths: data sheet (SNVS781), "PID Compensation Filter". Order, rounding and saturation are chosen
(README.md, rules F1 to F6). Which coefficients are in force when is in `buffers.py`, the excessive-error test in
`chip.py`.
"""

from __future__ import annotations

_FIT_15 = ("q", 0, 0x7FFF)
_DRIVE = ("q", -0x8000, 0x7FFF)


def _saturated(value: int) -> int:
    """Limited to 16 bits, two's complement."""
    return max(-32768, min(value, 32767))


class Pid:
    """u(n) = kp*e(n) + ki*sum(e) + kd*(e(n') - e(n'-1)), n' = every (ds+1)-th sample."""

    STATE = {
        "kp": _FIT_15,
        "ki": _FIT_15,
        "kd": _FIT_15,
        "il": _FIT_15,
        "ds": ("q", 0, 0xFF),
        "error_sum": ("q", -0x800000, 0x7FFFFF),
        "previous": _DRIVE,
        "derivative": _DRIVE,
        "integral": _DRIVE,
        "phase": ("q", 0, 0xFF),
    }
    NOT_STATE = ("saturates", "rounds_down")

    def __init__(self, saturates: bool = True, rounds_down: bool = True) -> None:
        self.saturates = 1 if saturates else 0
        self.rounds_down = 1 if rounds_down else 0
        self.load(0, 0, 0, 0, 0)
        self.open_loop()

    def load(self, kp: int, ki: int, kd: int, il: int, ds: int) -> None:
        """New coefficients (UDF). Sum and error history stay; the derivative interval starts afresh."""
        self.kp = kp
        self.ki = ki
        self.kd = kd
        self.il = il
        self.ds = ds
        self.phase = 0

    def open_loop(self) -> None:
        """Motor off: nothing is remembered."""
        self.error_sum = 0
        self.previous = 0
        self.derivative = 0
        self.integral = 0
        self.phase = 0

    def step(self, position_error: int) -> int:
        """Computes one sample of the closed loop. `position_error` in counts, any width; returns -32768..32767."""
        # The filter works on 16 bits of the error (SNVS781, PID Compensation Filter).
        e = _saturated(position_error)
        self.error_sum = max(-0x800000, min(self.error_sum + e, 0x7FFFFF))
        self.integral = self._limited(self._narrow(self.ki * self._top()))
        # Held between its samples: an interval of ds + 1 samples makes slow motion visible to it.
        if self.phase == 0:
            # The difference of two errors has 17 bits.
            self.derivative = self._narrow(self.kd * _saturated(e - self.previous))
            self.previous = e
        self.phase = self.phase + 1 if self.phase < self.ds else 0
        # Each product is narrowed by itself, then their sum (F1).
        return self._narrow(self._narrow(self.kp * e) + self.integral + self.derivative)

    def top_of_sum(self) -> int:
        """The top 16 bits of the 24-bit error sum, limited like the integral term."""
        return self._limited(self._top())

    def _top(self) -> int:
        if self.error_sum < 0 and not self.rounds_down:
            return -(-self.error_sum >> 8)
        return self.error_sum >> 8

    def _narrow(self, value: int) -> int:
        """16 bits, limited or the bottom ones."""
        return _saturated(value) if self.saturates else ((value + 32768) & 65535) - 32768

    def _limited(self, value: int) -> int:
        return max(-self.il, min(value, self.il))
