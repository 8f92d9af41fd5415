"""Timers 0 and 1: modes 0 to 3, gates, counting on pins.

   fosc/12 --+--> TRx & (not GATE or INTx pin) --> mode 0: [TH 8|TL 5]  mode 1: [TH|TL]  --> TFx
   Tx pin ---+                                     mode 2: [TL] <-- TH   mode 3: [TL0], [TH0] --> TF0, TF1
                                                   overflows of timer 1 also clock the serial port

Timer 2 is in `timer2.py`.

Timing (4316E section 2.9; what it leaves open: T1 to T3 in README.md): TR and TMOD written at the end of cycle n
act from n + 1 on, which counts. A gate and a counter input are sampled at S5P2, and the register counts at S3P1 of the
following cycle. TF is seen at S5P2 of the cycle that overflows.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK
from miro_robot.mcs51.interrupts import Interrupts

_NEVER = NEVER_TICK
_NONE = -1  # no counter edge waiting


class Timers:
    """Timers 0 and 1. Index 0 and 1 are the timers, 2 is TH0 when mode 3 splits it off."""

    STATE = {
        "tmod": ("i", 0, 0xFF),
        "control": ("i", 0, 0xF0),
        "tl": "2B",
        "th": "2B",
        "gates": ("i", 0, 3),
        "edge_cycle": ("2q", -1, NEVER_TICK),
        "synced": TICK,
        "overflows1": TICK,
    }
    NOT_STATE = ("interrupts", "counting")  # the latter follows from TMOD, TCON and the gates

    def __init__(self, interrupts: Interrupts) -> None:
        self.interrupts = interrupts
        self.tmod = 0
        self.control = 0  # TCON.7:4 = TF1 TR1 TF0 TR0, in place
        self.tl = [0] * 2
        self.th = [0] * 2
        self.gates = 3  # pins INT1, INT0 as last sampled
        self.edge_cycle = [-1] * 2  # cycle in which a fall of T0, T1 counts
        self.synced = 0  # everything below this cycle is done
        self.overflows1 = 0  # of timer 1 since reset: the serial port halves them
        self.counting = 0  # bit per part: whether it counts, on cycles or on a pin

    def clear(self, cycle: int) -> None:
        """As after reset in `cycle`."""
        self.tmod = 0
        self.control = 0
        self.synced = cycle
        self.overflows1 = 0
        for timer in range(2):
            self.tl[timer] = 0
            self.th[timer] = 0
            self.edge_cycle[timer] = _NONE
            self.interrupts.withdraw(1 + 2 * timer, cycle)
        self._note_counting()

    def sync(self, cycle: int) -> None:
        """Counts through all cycles below `cycle`."""
        if cycle <= self.synced:
            return
        counting = self.counting
        if counting & 1:
            self._pass(0, cycle)
        if counting & 2:
            self._pass(1, cycle)
        if counting & 4:
            self._pass(2, cycle)
        self.synced = cycle

    def _note_counting(self) -> None:
        self.counting = self.enabled(0) | self.enabled(1) << 1 | self.enabled(2) << 2

    def enabled(self, part: int) -> int:
        """Whether it counts, on cycles or on a pin."""
        split = self.mode(0) == 3
        if part == 2:
            return 1 if split and self.control & 0x40 else 0
        if part == 1:
            if self.mode(1) == 3:
                return 0
            if split:
                return 1
        if not self.control & (0x10 << (2 * part)):
            return 0
        gated = (self.tmod >> (4 * part)) & 8
        return 0 if gated and not (self.gates >> part) & 1 else 1

    def mode(self, timer: int) -> int:
        return (self.tmod >> (4 * timer)) & 3

    def counts_pin(self, part: int) -> int:
        return 1 if part < 2 and (self.tmod >> (4 * part)) & 4 else 0

    def value(self, part: int) -> int:
        """The count, as wide as its mode makes it."""
        if part == 2:
            return self.th[0]
        mode = self.mode(part)
        if mode == 0:
            return (self.th[part] << 5) | (self.tl[part] & 0x1F)
        if mode == 1 or (mode == 3 and part == 1):
            return (self.th[part] << 8) | self.tl[part]
        return self.tl[part]

    def top(self, part: int) -> int:
        """The count that overflows."""
        mode = 2 if part == 2 else self.mode(part)
        if mode == 0:
            return 0x2000
        return 0x10000 if mode == 1 else 0x100

    def reload(self, part: int) -> int:
        """The count that an overflow leaves."""
        return self.th[part] if part < 2 and self.mode(part) == 2 else 0

    def next_overflow(self, part: int) -> int:
        """Cycle of the next overflow if nothing changes, or NEVER_TICK. A counter is known one edge ahead only."""
        if not self.counting >> part & 1:
            return _NEVER
        left = self.top(part) - self.value(part)
        if self.counts_pin(part):
            return self.edge_cycle[part] if left == 1 and self.edge_cycle[part] >= self.synced else _NEVER
        return self.synced + left - 1

    def quiet_until(self) -> int:
        """The next cycle in which TF0 or TF1 goes up if nothing changes, or NEVER_TICK."""
        if not self.counting:
            return _NEVER
        first = self.next_flag(0)
        second = self.next_flag(1)
        return first if first < second else second

    def next_flag(self, timer: int) -> int:
        """Cycle in which TF0, TF1 will be seen set, or NEVER_TICK if it is up already or not in sight."""
        if self.control & (0x20 << (2 * timer)):
            return _NEVER
        if timer == 1 and self.mode(0) == 3:
            return self.next_overflow(2)
        return self.next_overflow(timer)

    def fall(self, timer: int, cycle: int) -> None:
        """T0, T1 was high in one sample and low in the next, that of `cycle`."""
        self.edge_cycle[timer] = cycle + 1

    def write_control(self, value: int, cycle: int) -> None:
        """TCON.7:4 is written; `cycle` is the first to see it."""
        changed = value ^ self.control
        self.control = value & 0xF0
        self._note_counting()
        for timer in range(2 if changed & 0xA0 else 0):
            if value & (0x20 << (2 * timer)):
                self.interrupts.ask(1 + 2 * timer, cycle)
            else:
                self.interrupts.withdraw(1 + 2 * timer, cycle)

    def write_mode(self, value: int) -> None:
        """TMOD is written, with everything below its cycle done."""
        self.tmod = value
        self._note_counting()

    def set_gates(self, levels: int) -> None:
        """The pins INT1, INT0 as sampled, with everything below the cycle that they act on done."""
        self.gates = levels
        self._note_counting()

    def taken(self, timer: int, cycle: int) -> None:
        """The CPU vectors: TF is cleared."""
        self.control &= 0xF0 ^ (0x20 << (2 * timer))
        self.interrupts.withdraw(1 + 2 * timer, cycle)

    def _pass(self, part: int, cycle: int) -> None:
        """The counts of one part in the cycles `synced` .. `cycle` - 1."""
        first = self.synced
        counts = cycle - first
        if self.counts_pin(part):
            first = self.edge_cycle[part]
            if not self.synced <= first < cycle:
                return
            counts = 1
        value = self.value(part)
        left = self.top(part) - value
        if counts < left:
            self._store(part, value + counts)
            return
        reload = self.reload(part)
        span = self.top(part) - reload
        overflows = (counts - left) // span + 1
        self._store(part, reload + (counts - left) - (overflows - 1) * span)
        self._overflowed(part, overflows, first + left - 1)

    def _store(self, part: int, value: int) -> None:
        """TL.7:5 are indeterminate in mode 0 (4316E section 2.9); chosen: they keep what was written there."""
        if part == 2:
            self.th[0] = value
            return
        mode = self.mode(part)
        if mode == 0:
            self.tl[part] = (self.tl[part] & 0xE0) | (value & 0x1F)
            self.th[part] = value >> 5
        elif mode == 1:
            self.tl[part] = value & 0xFF
            self.th[part] = value >> 8
        else:
            self.tl[part] = value

    def _overflowed(self, part: int, overflows: int, cycle: int) -> None:
        """TF1 belongs to TH0 while timer 0 is split; timer 1 then only clocks the serial port."""
        if part == 1:
            self.overflows1 += overflows
            if self.mode(0) == 3:
                return
        timer = 0 if part == 0 else 1
        self.control |= 0x20 << (2 * timer)
        self.interrupts.ask(1 + 2 * timer, cycle)

    def after_load(self) -> None:
        if self.control & 0x0F:
            raise ValueError(f"TCON.3:0 is {self.control & 0x0F}, which belongs to the external interrupts")
        self._note_counting()
