"""Timer 2: capture, auto-reload up and down, baud rate generator, clock output.

   fosc/12: timer ---------+
   fosc/2: baud, output ---+--> [TH2|TL2] -- overflow --> TF2, or 16x ticks of the serial port, or P1.0
   fall of T2: counter ----+     |     ^
                         capture v     | reload
   fall of T2EX, EXEN2 ----> [RCAP2H|RCAP2L], and EXF2; with DCEN T2EX says up or down

Dividing its overflows down to bits is the serial port's.

Timing (4316E section 2.12, 1919D sections 10 to 13; letters are rules in README.md): as a timer it counts once per
cycle, as a baud rate generator or clock output six times (fosc/2). TF2 is set at S2P2 and polled in the same cycle, a
cycle sooner than TF0. Pins are sampled at S5P2 and act in the next cycle: a count, or a capture or reload that goes
before that cycle's own count (T4), with EXF2 latched at S5P2 of that cycle (I3).
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.mcs51.interrupts import Interrupts

_NONE = -1
_TIMER2 = 5  # its place in the polling order
_TF2, _EXF2, _RCLK, _TCLK, _EXEN2, _TR2, _C_T2, _CP_RL2 = 0x80, 0x40, 0x20, 0x10, 0x08, 0x04, 0x02, 0x01
_T2OE, _DCEN = 0x02, 0x01  # T2MOD
_FELL = 2  # T2EX is low in the last sample and was high in the one before: the cycle that comes acts on it
_STATES = 6  # per machine cycle


class Timer2:
    """The 16-bit counter with its reload and capture register."""

    STATE = {
        "control": ("i", 0, 0xFF),
        "t2mod": ("i", 0, 3),
        "count": ("i", 0, 0xFFFF),
        "capture": ("i", 0, 0xFFFF),
        "up": ("i", 0, 2),
        "edge_cycle": ("q", -1, NEVER_TICK),
        "clock_out": FLAG,
        "synced": TICK,
    }
    NOT_STATE = ("interrupts", "sleeps")

    def __init__(self, interrupts: Interrupts) -> None:
        self.interrupts = interrupts
        self.up = 1  # pin T2EX as last sampled (DCEN: count up), or _FELL
        self.clear(0)

    def clear(self, cycle: int) -> None:
        """Resets to the state after reset in `cycle`."""
        self.control = 0  # T2CON
        self.t2mod = 0
        self.count = 0
        self.capture = 0  # RCAP2
        self.edge_cycle = _NONE  # cycle in which a fall of T2 counts
        self.clock_out = 0  # level on T2 while T2OE
        self.synced = cycle
        self._note_sleep()
        self.interrupts.withdraw(_TIMER2, cycle)

    def drives_pin(self) -> int:
        """Clock output on P1.0."""
        return 1 if self.t2mod & _T2OE and not self.control & _C_T2 else 0

    def silent(self) -> int:
        """Overflows set no TF2: baud rate generator and clock output."""
        # A rollover sets no TF2 while it makes a baud rate or a clock (4316E section 2.12).
        return 1 if self.control & (_RCLK | _TCLK) or self.drives_pin() else 0

    def up_down(self) -> int:
        return 1 if self.t2mod & _DCEN and not self.silent() and not self.control & _CP_RL2 else 0

    def down(self) -> int:
        return 1 if self.up_down() and self.up != 1 else 0

    def rate(self) -> int:
        """Counts per cycle from the crystal; 0 when stopped or counting a pin."""
        if not self.control & _TR2 or self.control & _C_T2:
            return 0
        return _STATES if self.silent() else 1

    def left(self) -> int:
        """Counts to the next overflow or underflow."""
        if self.down():
            # Down, the underflow is the count after the one that equals RCAP2 (1919D, timer 2, up or down).
            return ((self.count - self.capture) & 0xFFFF) + 1
        return 0x10000 - self.count

    def span(self) -> int:
        """Counts from one overflow to the next."""
        captures = self.control & _CP_RL2 and not self.silent()
        return 0x10000 if captures else 0x10000 - self.capture

    def sync(self, cycle: int) -> None:
        """Counts through all cycles below `cycle`."""
        if cycle <= self.synced:
            return
        if self.up == _FELL:
            self._external(self.synced)
        rate = self.rate()
        if rate:
            self._pass((cycle - self.synced) * rate, rate, self.synced)
        elif self.counts_pin() and self.synced <= self.edge_cycle < cycle:
            self._pass(1, 1, self.edge_cycle)
        self.synced = cycle

    def _pass(self, counts: int, rate: int, first: int) -> None:
        """`counts` counts, `rate` of them per cycle, starting with cycle `first`."""
        left = self.left()
        down = self.down()
        step = -1 if down else 1
        if counts < left:
            self.count = (self.count + step * counts) & 0xFFFF
            return
        span = self.span()
        overflows = (counts - left) // span + 1
        beyond = counts - left - (overflows - 1) * span
        if down:
            # An underflow reloads FFFFh, not RCAP2 (1919D, timer 2, up or down).
            self.count = 0xFFFF - beyond
        else:
            self.count = 0x10000 - span + beyond
        self._overflowed(overflows, first + (left - 1) // rate)

    def _overflowed(self, overflows: int, cycle: int) -> None:
        if self.drives_pin():
            self.clock_out ^= overflows & 1
        if self.silent():
            return
        self.control |= _TF2
        if self.up_down():
            # With DCEN, EXF2 toggles as a 17th bit and interrupts no more (1919D, timer 2).
            self.control ^= _EXF2 if overflows & 1 else 0
        # Set at S2P2 and polled in its own cycle: as if S5P2 of the one before had seen it (1919D section 13).
        self.interrupts.ask(_TIMER2, cycle - 1)

    def next_flag(self) -> int:
        """No `since` with which TF2 or EXF2 will ask if nothing changes comes before this; NEVER_TICK if none will."""
        if self.falls():
            # EXF2 asks a cycle later, but TF2 may go up in the same cycle: by a reload, too.
            return self.synced - 1
        if self.control & _TF2 or self.silent():
            return NEVER_TICK
        if self.rate():
            return self.synced + self.left() - 2
        overflow = self.next_pin_overflow()
        return overflow - 1 if overflow < NEVER_TICK else NEVER_TICK

    def next_overflow_tick(self) -> int:
        """Tick at which the state ends that overflows next as a baud rate generator, or NEVER_TICK."""
        if self.rate() != _STATES:
            return NEVER_TICK
        # Two ticks a state; the overflow shows with the last of them (U2).
        return 12 * self.synced + 2 * self.left() - 1

    def out_at(self, tick: int) -> int:
        """The clock output at `tick`, if nothing changes until then; 1 while there is none. It toggles on the tick with
        which an overflow shows (U2).
        """
        if not self.drives_pin():
            return 1
        first = self.next_overflow_tick()
        return (
            self.clock_out
            if tick < first
            else self.clock_out ^ (1 - ((tick - first) // (2 * self.span()) & 1))
        )

    def out_after(self, tick: int) -> int:
        """The tick of its first edge later than that, NEVER_TICK if there will be none."""
        first = self.next_overflow_tick() if self.drives_pin() else NEVER_TICK
        if tick < first:
            return first
        period = 2 * self.span()
        return first + ((tick - first) // period + 1) * period

    def counts_pin(self) -> int:
        return 1 if self.control & _TR2 and self.control & _C_T2 else 0

    def next_pin_overflow(self) -> int:
        """Cycle in which a fall of T2 that was seen already overflows, or NEVER_TICK."""
        waiting = self.counts_pin() and self.left() == 1 and self.edge_cycle >= self.synced
        return self.edge_cycle if waiting else NEVER_TICK

    def fall(self, cycle: int) -> None:
        """T2 was high in one sample and low in the next, that of `cycle`."""
        self.edge_cycle = cycle + 1

    def sample_external(self, level: int) -> None:
        """T2EX changed to `level` in the sample of the cycle before `synced`."""
        self.up = 1 if level else _FELL
        self._note_sleep()

    def _note_sleep(self) -> None:
        """Sets `sleeps`: 1 if no flag is near (overflows set none, and no fall of T2EX waits), else 0."""
        self.sleeps = 1 if self.silent() and self.up != _FELL else 0

    def falls(self) -> int:
        """The cycle that comes acts on a fall of T2EX."""
        return 1 if self.up == _FELL and self.control & _EXEN2 and not self.up_down() else 0

    def _external(self, cycle: int) -> None:
        """`cycle` begins, the one after the sample in which T2EX fell."""
        acts = self.falls()
        self.up = 0
        self._note_sleep()
        if not acts:
            return
        if not self.silent():
            if self.control & _CP_RL2:
                self.capture = self.count
            else:
                self.count = self.capture
        self.control |= _EXF2
        self.interrupts.ask(_TIMER2, cycle)

    def write(self, control: int, t2mod: int, cycle: int) -> None:
        """T2CON or T2MOD is written, whose DCEN decides whether EXF2 interrupts; `cycle` is the first to see it."""
        self.control = control
        self.t2mod = t2mod & 0x03
        self._note_sleep()
        self.interrupts.follow(_TIMER2, control & (_TF2 if self.up_down() else _TF2 | _EXF2), cycle)

    def after_load(self) -> None:
        self._note_sleep()
