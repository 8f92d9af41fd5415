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

_NONE = -1  # no counter edge waiting
_TIMER0, _TIMER1 = 0x02, 0x08  # in IE
_TF0, _TF1 = 0x20, 0x80  # in TCON
_TR0, _TR1 = 0x10, 0x40


class Timers:
    """Timers 0 and 1. Index 0 and 1 are the timers, 2 is TH0 when mode 3 splits it off.

    A part that counts cycles is not stepped: it stands at `synced` - `start`, until it overflows. TL and TH follow when
    it stops, and when they are read, written or saved (`store`).
    """

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
    NOT_STATE = (
        "interrupts",
        *("counts_always", "counts_by_tr0", "counts_by_tr1", "counting", "on_pins", "steady"),
        *("start", "top", "due"),
    )  # all but the first follow from TMOD, TCON, the gates, TL and TH

    def __init__(self, interrupts: Interrupts) -> None:
        self.interrupts = interrupts
        self.tl = [0] * 2
        self.th = [0] * 2
        self.gates = 3  # pins INT1, INT0 as last sampled
        self.edge_cycle = [0] * 2  # cycle in which a fall of T0, T1 counts
        self.start = [0] * 3  # cycle in which a part that counts cycles would have stood at 0
        self.top = [0] * 3  # the count that overflows
        self.clear(0)

    def clear(self, cycle: int) -> None:
        """Resets to the state after reset in `cycle`."""
        self.control = 0  # TCON.7:4 = TF1 TR1 TF0 TR0, in place
        self.synced = cycle  # everything below this cycle is done
        self.overflows1 = 0  # of timer 1 since reset: the serial port halves them
        for timer in range(2):
            self.tl[timer] = 0
            self.th[timer] = 0
            self.edge_cycle[timer] = _NONE
            self.interrupts.withdraw(1 + 2 * timer, cycle)
        self._set_mode(0)

    def sync(self, cycle: int) -> None:
        """Counts through all cycles below `cycle`."""
        if cycle > self.synced:
            # Before `due` nothing overflows: a timer that runs costs nothing until then.
            if cycle > self.due:
                self._pass(cycle)
            self.synced = cycle

    def _set_mode(self, tmod: int) -> None:
        """TMOD, with all counts in TL and TH."""
        self.tmod = tmod
        self.steady = 0  # a bit per part that counts cycles
        self.due = NEVER_TICK  # no overflow and no fall that counts comes before this cycle
        self.on_pins = self.counts_pin(0) | self.counts_pin(1) << 1
        for part in range(3):
            mode = 2 if part == 2 else self.mode(part)
            # Mode 0 is the timer of the 8048: TH, and five bits of TL (4316E section 2.9).
            self.top[part] = 0x2000 if mode == 0 else 0x10000 if mode == 1 else 0x100
        self._note_gates()

    def _note_gates(self) -> None:
        """TMOD or the gates are new: works out what counts, a bit per part, always and as TR0 and TR1 are."""
        split = self.mode(0) == 3
        stands = self.mode(1) == 3
        open0 = not self.tmod & 0x08 or self.gates & 1
        open1 = not self.tmod & 0x80 or self.gates & 2
        # While timer 0 is split, TR1 and TF1 are TH0's: timer 1 runs unless it is in mode 3 itself (section 2.10).
        self.counts_always = 2 if split and not stands else 0
        self.counts_by_tr0 = 1 if open0 else 0
        # TH0 has no gate and no pin: it counts machine cycles while TR1 is set.
        self.counts_by_tr1 = 4 if split else 2 if open1 and not stands else 0
        self._note_counting()

    def _note_counting(self) -> None:
        """TR0, TR1 or what follows them is new: starts and stops the parts."""
        counting = self.counts_always
        if self.control & _TR0:
            counting |= self.counts_by_tr0
        if self.control & _TR1:
            counting |= self.counts_by_tr1
        self.counting = counting
        if counting & self.on_pins:
            self.due = self.synced  # a fall may wait
        steady = counting & ~self.on_pins
        changed = steady ^ self.steady
        for part in range(3):
            if changed >> part & 1:
                if steady >> part & 1:
                    self._begin(part)
                else:
                    # It stops: from here on only TL and TH know its count.
                    self._put(part, self.synced - self.start[part])
        self.steady = steady

    def _begin(self, part: int) -> None:
        """From now on it counts cycles."""
        self.start[part] = self.synced - self.value(part)
        # `min`: another timer may overflow before.
        self.due = min(self.due, self.start[part] + self.top[part] - 1)

    def mode(self, timer: int) -> int:
        return (self.tmod >> (4 * timer)) & 3

    def counts_pin(self, timer: int) -> int:
        return (self.tmod >> (4 * timer + 2)) & 1

    def value(self, part: int) -> int:
        """The count in TL and TH, as wide as the mode makes it."""
        if part == 2:
            return self.th[0]
        mode = self.mode(part)
        if mode == 1:
            return (self.th[part] << 8) | self.tl[part]
        if mode == 0:
            return (self.th[part] << 5) | (self.tl[part] & 0x1F)
        return self.tl[part]

    def _put(self, part: int, count: int) -> None:
        """TL.7:5 are indeterminate in mode 0 (4316E section 2.9); chosen: they keep what was written there."""
        mode = 2 if part == 2 else self.mode(part)
        if mode == 1:
            self.tl[part] = count & 0xFF
            self.th[part] = count >> 8
        elif mode == 0:
            self.tl[part] = (self.tl[part] & 0xE0) | (count & 0x1F)
            self.th[part] = count >> 5
        elif part == 2:
            self.th[0] = count
        else:
            self.tl[part] = count

    def reload(self, part: int) -> int:
        """The count that an overflow leaves."""
        return self.th[part] if part < 2 and self.mode(part) == 2 else 0

    def span(self, part: int) -> int:
        """Counts from one overflow to the next."""
        return self.top[part] - self.reload(part)

    def next_overflow(self, part: int) -> int:
        """Cycle of the next overflow if nothing changes, or NEVER_TICK. A counter is known one edge ahead only."""
        if self.steady >> part & 1:
            # The count is top - 1 when that cycle begins, and passes the top in it.
            return self.start[part] + self.top[part] - 1
        if self.counting >> part & 1 and self.top[part] - self.value(part) == 1:
            return self.edge_cycle[part] if self.edge_cycle[part] >= self.synced else NEVER_TICK
        return NEVER_TICK

    def next_flag(self, timers: int) -> int:
        """The next cycle in which TF0 or TF1 goes up if nothing changes, or NEVER_TICK. `timers`: which, as in IE."""
        first = NEVER_TICK
        if timers & _TIMER0 and not self.control & _TF0:
            first = self.next_overflow(0)
        if timers & _TIMER1 and not self.control & _TF1:
            return min(first, self.next_overflow(2 if self.mode(0) == 3 else 1))
        return first

    def fall(self, timer: int, cycle: int) -> None:
        """T0, T1 was high in one sample and low in the next, that of `cycle`."""
        self.edge_cycle[timer] = cycle + 1
        self.due = self.synced

    def set_gates(self, levels: int) -> None:
        """The pins INT1, INT0 as sampled, with everything below the cycle that they act on done."""
        self.gates = levels
        self._note_gates()

    # Registers, with everything below the cycle that sees them done.

    def read(self, number: int) -> int:
        """0 TL0, 1 TL1, 2 TH0, 3 TH1."""
        self._store(number & 1)
        return self.th[number & 1] if number & 2 else self.tl[number & 1]

    def write(self, number: int, value: int) -> int:
        """Writes 0..3 as `read`. Returns the running timers whose flag may come sooner, as bits of IE."""
        timer = number & 1
        self._store(timer)
        if number & 2:
            self.th[timer] = value
        else:
            self.tl[timer] = value
        if self.steady >> timer & 1:
            self._begin(timer)
        # TH0 is split off timer 0, so a write to TH0 moves it too.
        if self.mode(0) == 3:
            if timer == 0 and self.steady & 4:
                self._begin(2)
            return _TIMER0 | _TIMER1
        return _TIMER0 << (2 * timer) if self.counting >> timer & 1 else 0

    def write_mode(self, value: int) -> int:
        """TMOD. Returns what `write` does."""
        self.store()
        self._set_mode(value)
        return _TIMER0 | _TIMER1

    def write_control(self, value: int, cycle: int) -> int:
        """TCON.7:4; `cycle` is the first to see it. Returns what `write` does: none that the write stops."""
        changed = value ^ self.control
        started = changed & value & (_TR0 | _TR1)
        self.control = value & 0xF0
        if changed & (_TR0 | _TR1):
            self._note_counting()
        if changed & (_TF0 | _TF1):
            started |= changed & (_TF0 | _TF1)
            for timer in range(2):
                # A TF that software sets interrupts as one that hardware sets (I2).
                self.interrupts.follow(1 + 2 * timer, value & (_TF0 << (2 * timer)), cycle)
        if self.mode(0) == 3:
            return _TIMER0 | _TIMER1
        return (_TIMER0 if started & (_TR0 | _TF0) else 0) | (_TIMER1 if started & (_TR1 | _TF1) else 0)

    def taken(self, timer: int, cycle: int) -> None:
        """The CPU vectors: TF is cleared."""
        self.control &= 0xF0 ^ (0x20 << (2 * timer))
        self.interrupts.withdraw(1 + 2 * timer, cycle)

    def _pass(self, cycle: int) -> None:
        """The overflows and the falls that count in the cycles `synced` .. `cycle` - 1."""
        self.due = NEVER_TICK
        for part in range(3):
            if not self.counting >> part & 1:
                continue
            if self.steady >> part & 1:
                self._pass_cycles(part, cycle)
                coming = self.next_overflow(part)
            else:
                self._pass_fall(part, cycle)
                coming = self.edge_cycle[part]
            if cycle <= coming < self.due:
                self.due = coming

    def _pass_cycles(self, part: int, cycle: int) -> None:
        beyond = cycle - self.start[part] - self.top[part]
        if beyond >= 0:
            span = self.span(part)
            # Several at once: nobody looks at a timer whose flag is up or ignored.
            overflows = beyond // span + 1
            self.start[part] += overflows * span
            # The flag goes up with the first of them.
            self._overflowed(part, overflows, cycle - 1 - beyond)

    def _pass_fall(self, part: int, cycle: int) -> None:
        fall = self.edge_cycle[part]
        # An older fall was counted; one that came while the timer stood never counts.
        if self.synced <= fall < cycle:
            count = self.value(part) + 1
            if count == self.top[part]:
                count = self.reload(part)
                self._overflowed(part, 1, fall)
            self._put(part, count)

    def _store(self, timer: int) -> None:
        if self.steady >> timer & 1:
            self._put(timer, self.synced - self.start[timer])
        if timer == 0 and self.steady & 4:
            self._put(2, self.synced - self.start[2])

    def store(self) -> None:
        """Brings TL and TH up to where the counts are."""
        self._store(0)
        self._store(1)

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
        # Bits 3 to 0 of TCON are kept in `ExternalInterrupts`; two copies could disagree.
        if self.control & 0x0F:
            raise ValueError(f"TCON.3:0 is {self.control & 0x0F}, which belongs to the external interrupts")
        self._set_mode(self.tmod)
