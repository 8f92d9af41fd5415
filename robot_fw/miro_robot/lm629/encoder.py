"""The encoder inputs: digital filter, quadrature decoder, index capture.

Nothing is done per clock: a level is known to count from the moment it has been there long enough, so every
input keeps the tick at which that will be (`due`). What is made of the counts (positions, flags) is in
`chip.py`.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK

_COUNTS = ("q", -(1 << 40), 1 << 40)  # between two samples: far more than ticks


class InputFilter:
    """Digital filter of one input (A and B together are one): a level counts when `clocks` consecutive samples have it.

    Samples are taken at multiples of 4 ticks and see the level that was there just before. With 0 clocks
    there is no sampling at all: a level counts at once. `level` is what counts, `due` the tick at which
    that will change.
    """

    STATE = {
        "level": ("i", 0, 3),
        "run_level": ("i", 0, 3),
        "run_tick": TICK,
        "pin": ("i", 0, 3),
        "pin_tick": TICK,
        "due": TICK,
    }
    NOT_STATE = ("wait", "direct")

    def __init__(self, clocks: int, level: int) -> None:
        # The first of `clocks` equal samples is on the clock edge itself: the wait is for the others.
        self.wait = 4 * (clocks - 1) if clocks > 0 else 0
        self.direct = 1 if clocks == 0 else 0
        self.take(level)

    def take(self, level: int, tick: int = 0) -> None:
        """Sets the level without a change: the filter does not see an edge. It has been there since `tick`."""
        self.level = level
        self.run_level = level
        self.run_tick = tick
        self.pin = level
        self.pin_tick = tick
        self.due = NEVER_TICK

    def set(self, tick: int, level: int) -> None:
        """The pin changes at `tick`. What was due before that must have been taken already (`accept`)."""
        if self.direct:
            self.pin = level
            self.due = tick if level != self.level else NEVER_TICK
            return
        # A sample on a clock edge sees the level just before it: this one is seen by the next edge (X3).
        clock = (tick & -4) + 4
        if clock > self.pin_tick:
            if self.pin != self.run_level:
                self.run_level = self.pin
                self.run_tick = self.pin_tick
            self.pin_tick = clock
        self.pin = level
        if level == self.level:
            self.due = NEVER_TICK
        elif level == self.run_level:
            self.due = self.run_tick + self.wait
        else:
            self.due = clock + self.wait

    def accept(self) -> None:
        """The level at the pin counts from now on."""
        self.level = self.pin
        self.due = NEVER_TICK


class Encoder:
    """Counts quadrature states and catches the index.

    `counts`: counts since the chip last took them (the chip sets it back to 0). While `armed`, the first
    moment at which A, B and /IN are all low puts `counts` into `caught_counts`, sets `caught` and disarms.
    Quadrature states are held as their place in the forward order: (A,B) = 00, 10, 11, 01 -> 0, 1, 2, 3.
    """

    STATE = {
        "quadrature": InputFilter,
        "index": InputFilter,
        "seen": FLAG,
        "counts": _COUNTS,
        "armed": FLAG,
        "caught": FLAG,
        "caught_counts": _COUNTS,
    }
    NOT_STATE = ("steps", "spacing")

    def __init__(self, filter_clocks: int, double_step: int = 0) -> None:
        self.steps = [0, 1, double_step, -1]  # counts, by how far the place has gone forward
        self.quadrature = InputFilter(filter_clocks, 0)
        self.spacing = self.quadrature.wait + 7  # of edges that all count
        self.index = InputFilter(filter_clocks, 1)
        self.seen = 0
        self.armed = 0
        self.clear()

    def clear(self, disarm: int = 1) -> None:
        """Forget counts and captures (reset); the inputs go on being watched, for an index too if not `disarm`."""
        self.counts = 0
        if disarm:
            self.armed = 0
        self.caught = 0
        self.caught_counts = 0

    def set_phases(self, tick: int, a: int, b: int) -> None:
        """Sets the levels of A and B from `tick` on.

        The first call sets the start position of the wheel and counts nothing.
        """
        self.set_place(tick, (b + b) | (a ^ b))

    def set_place(self, tick: int, place: int) -> None:
        """Sets A and B from `tick` on by their place (0..3) in the forward order."""
        if not self.seen:
            self.seen = 1
            self.quadrature.take(place)
            return
        if self.quadrature.direct:
            self.quadrature.set(tick, place)
            self.settle(tick)
            return
        clock = tick & -4
        # The order of counts and index matters only while one is looked for; the count alone is the usual way.
        if self.index.due <= clock or self.armed:
            self.settle(clock)
        elif self.quadrature.due <= clock:
            self._count()
        self.quadrature.set(tick, place)

    def set_run(
        self, first_tick: int, before_tick: int, last_tick: int, edges: int, step: int, count: int
    ) -> int:
        """`set_place` for edges one way (`step`) to the place of `count`, each `spacing` or more ticks after another.

        The first comes after `first_tick`, the last two at these ticks. Where that does not suffice nothing is done: 0.
        """
        quadrature = self.quadrature
        clock = first_tick & -4
        waits = clock < quadrature.due != NEVER_TICK or clock < quadrature.pin_tick
        if not self.seen or quadrature.direct or self.armed or self.index.due <= last_tick or waits:
            return 0
        if quadrature.due <= clock:
            self._count()
        if edges > 1:
            self.counts += step * (edges - 1)
            quadrature.take((count - step) & 3, (before_tick & -4) + 4)
        quadrature.set(last_tick, count & 3)
        return 1

    def set_index(self, tick: int, level: int) -> None:
        """Level of /IN from `tick` on."""
        self.settle(tick & -4)
        self.index.set(tick, level)
        if self.index.direct:
            self.settle(tick)

    def arm(self, tick: int) -> None:
        """Catch the next index; it is caught at once if all three inputs are low."""
        # What came before the SIP is not its index (X4).
        self.settle(tick)
        self.armed = 1
        self.caught = 0
        self._watch()

    def settle(self, tick: int) -> None:
        """Take everything that counts at or before `tick`, in the order in which it happened."""
        while self.quadrature.due <= tick or self.index.due <= tick:
            now = min(self.quadrature.due, self.index.due)
            if self.quadrature.due == now:
                self._count()
            if self.index.due == now:
                self.index.accept()
            if self.armed:
                self._watch()

    def _count(self) -> None:
        self.counts += self.steps[(self.quadrature.pin - self.quadrature.level) & 3]
        self.quadrature.accept()

    def _watch(self) -> None:
        if self.quadrature.level == 0 and self.index.level == 0:
            self.caught = 1
            self.caught_counts = self.counts
            self.armed = 0
