"""A controller's demands on the wheels: its effort, and a chattering index for speeds that go back and forth.

The total variation of a controller's output, TV = sum |u(k+1) - u(k)|, is the usual measure of its smoothness (S.
Skogestad, J. Process Control 13 (2003) 291, doi:10.1016/S0959-1524(02)00062-8). It counts a turn or a start that the
path needs as well. So the net motion is taken away: in each window of ten control periods the variation less |u(last) -
u(first)|. The rest is 0 for speeds that only rise or only fall within a window, and twice the swing for those that come
back. It is summed over the windows, and given per wheel and second of command: m/s per s. The effort is TV itself, in
the same unit: the mean size of the commanded acceleration of a wheel.
"""

from miro_host.wheels import Wheels

WINDOW = 10
"""Control periods: a swing that takes longer than a third of a second is a movement of the robot."""
_UNITS_PER_M_S = Wheels().units_per_m_s


class Chattering:
    """Sums up commands in 1/256 count per sample, as the station sends them; integers, so nothing is rounded."""

    def __init__(self) -> None:
        self.commands = 0
        self._variation = 0  # of the windows that are over
        self._back_and_forth = 0  # of the same
        self._path = 0  # of the open window
        self._since = 0
        self._first = (0, 0)
        self._last = (0, 0)

    def add(self, left: int, right: int) -> None:
        """The next control period's command."""
        before_left, before_right = self._last
        if self.commands:
            self._path += abs(left - before_left) + abs(right - before_right)
            self._since += 1
        else:
            self._first = (left, right)
        self._last = (left, right)
        self.commands += 1
        if self._since == WINDOW:
            self._variation += self._path
            self._back_and_forth += self._open()
            self._path, self._since, self._first = 0, 0, self._last

    def _open(self) -> int:
        net = abs(self._last[0] - self._first[0]) + abs(self._last[1] - self._first[1])
        return self._path - net

    def index(self, period_s: float) -> float | None:
        """The index in m/s2 for commands that are `period_s` apart; None for less than two of them."""
        return self._per_wheel_and_second(self._back_and_forth + self._open(), period_s)

    def effort(self, period_s: float) -> float | None:
        """The total variation in m/s2, in the same way."""
        return self._per_wheel_and_second(self._variation + self._path, period_s)

    def _per_wheel_and_second(self, total: int, period_s: float) -> float | None:
        if self.commands < 2:
            return None
        return 0.5 * total / _UNITS_PER_M_S / ((self.commands - 1) * period_s)
