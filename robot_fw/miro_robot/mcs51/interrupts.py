"""Interrupts: the six sources, their priorities, and the two external inputs.

   INT0 --> IE0 ------+
   timer 0 --> TF0 ---+
   INT1 --> IE1 ------+--> latched at S5P2 --> polled with IE in the next cycle, --> highest level, then in this order:
   timer 1 --> TF1 ---+    [since, until)      if it is the last of an instruction   LCALL, in service
   serial --> RI TI --+
   timer 2 --> TF2 EXF2

Flags are raised elsewhere (timers, serial port); the two-cycle LCALL itself is in `Cpu`.

Timing (4316E section 2.16; letters are rules in README.md): flags are latched at S5P2 of every cycle and the latched
copies are polled in the next one; an LCALL follows the polling cycle if that was the last of an instruction. So at the
boundary after cycle b - 1 those sources count that were latched in cycle b - 2. Each source is therefore kept as the
window [since, until) of cycles whose S5P2 saw it. A cleared flag still counts in the poll of its last cycle (I4).
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK


class Interrupts:
    """IE, IP, the sources' windows (0 to 5 in polling order) and the two in-service flip-flops."""

    STATE = {
        "ie": ("i", 0, 0xFF),
        "ip": ("i", 0, 0xFF),
        "in_service": ("i", 0, 3),
        "since": ("6q", -2, NEVER_TICK),  # a flag of timer 2 is seen a cycle early
        "until": ("6q", -2, NEVER_TICK),
    }
    NOT_STATE = ("asked",)

    def __init__(self) -> None:
        self.since = [0] * 6
        self.until = [0] * 6
        self.asked = 0  # bit per source: its window has not passed yet, or is not known to have
        self.clear()

    def clear(self) -> None:
        """Resets to the state after reset."""
        self.ie = 0
        self.ip = 0
        self.in_service = 0  # bit 0 a low-priority, bit 1 a high-priority routine
        for source in range(6):
            self.since[source] = 0
            self.until[source] = 0

    def ask(self, source: int, cycle: int) -> None:
        """The source's flag is first seen at S5P2 of `cycle`, or before if it is up already.

        The serial port reports its transmission before its reception.
        """
        # A flag that is up already keeps its first cycle: set again, it would be latched later than it was.
        if self.until[source] != NEVER_TICK:
            self.since[source] = cycle
            self.until[source] = NEVER_TICK
            self.asked |= 1 << source
        elif cycle < self.since[source]:
            self.since[source] = cycle

    def withdraw(self, source: int, cycle: int) -> None:
        """The source's flag is no longer seen at S5P2 of `cycle`."""
        # A flag that is down keeps its last cycle: cleared twice, it would seem to have been up until now.
        if self.until[source] == NEVER_TICK:
            self.until[source] = cycle

    def follow(self, source: int, flag: int, cycle: int) -> None:
        """The source's flag was written: up unless 0."""
        if flag:
            self.ask(source, cycle)
        else:
            self.withdraw(source, cycle)

    def enabled(self) -> int:
        """Sources that IE lets interrupt, a bit each."""
        return self.ie if self.ie & 0x80 else 0

    def open(self) -> int:
        """The requests that the interrupts in service allow."""
        if self.in_service & 2:
            return 0
        return self.enabled() & self.ip if self.in_service else self.enabled()

    def choose(self, boundary: int) -> int:
        """The source whose LCALL begins in cycle `boundary`, or -1."""
        waiting = self.open() & self.asked
        latched = boundary - 2
        chosen = -1
        for source in range(6 if waiting else 0):
            # Latched two cycles before: a flag of the last cycle waits for the next poll.
            if (waiting >> source) & 1 and self.since[source] <= latched < self.until[source]:
                if (self.ip >> source) & 1:
                    return source  # the first of the high level wins over every low one
                # Within a level the first in polling order (4316E section 2.16).
                if chosen < 0:
                    chosen = source
        return chosen

    def next_boundary(self, now: int) -> int:
        """The first cycle >= `now` in which `choose` may find something among the flags known, or NEVER_TICK."""
        waiting = self.open() & self.asked
        earliest = NEVER_TICK
        for source in range(6 if waiting else 0):
            if not (waiting >> source) & 1:
                continue
            # Its last copy has been polled: nothing more comes of it.
            if self.until[source] <= now - 2:
                self.asked &= ~(1 << source)
            else:
                # IE, IP or a routine may have held it back: then it is due now.
                boundary = max(self.since[source] + 2, now)
                if boundary - 2 < self.until[source] and boundary < earliest:
                    earliest = boundary
        return earliest

    def enter(self, source: int) -> None:
        """Its routine is called."""
        # By IP as it is now: changing IP within the routine does not change the level that RETI ends.
        self.in_service |= 1 + ((self.ip >> source) & 1)

    def after_load(self) -> None:
        # Not saved: any of them may wait. Those that do not are left out at the next look.
        self.asked = 0x3F

    def leave(self) -> None:
        """RETI: the highest routine in service is over."""
        if self.in_service & 2:
            self.in_service &= 1
        else:
            self.in_service = 0


class ExternalInterrupts:
    """INT0, INT1 and their half of TCON: level mode follows the inverted pin, edge mode latches a fall."""

    STATE = {"control": ("i", 0, 0x0F), "levels": ("i", 0, 3)}
    NOT_STATE = ("interrupts",)

    def __init__(self, interrupts: Interrupts) -> None:
        self.interrupts = interrupts
        self.control = 0  # TCON.3:0 = IE1 IT1 IE0 IT0
        self.levels = 3  # pins INT1, INT0 as last sampled

    def sample(self, number: int, level: int, cycle: int) -> None:
        """The pin of INT`number` changed to `level` for the sample at S5P2 of `cycle`."""
        bit = 1 << number
        self.levels = (self.levels & (3 ^ bit)) | (level << number)
        if (self.control >> (2 * number)) & 1 == 0:
            self._follow(number, cycle)
        # A fall sets the flag; that the pin rises again does not clear it.
        elif level == 0:
            self.control |= 2 << (2 * number)
            self.interrupts.ask(2 * number, cycle)

    def write(self, value: int, cycle: int) -> None:
        """TCON.3:0 is written; `cycle` is the first to see it."""
        self.control = value & 0x0F
        for number in range(2):
            # In level mode what software writes to IE has no effect: the flag is the pin.
            if (value >> (2 * number)) & 1 == 0:
                self._follow(number, cycle)
            else:
                self.interrupts.follow(2 * number, value >> (2 * number) & 2, cycle)

    def taken(self, number: int, cycle: int) -> None:
        """The CPU vectors: an edge flag is cleared, a level flag stays."""
        if (self.control >> (2 * number)) & 1:
            self.control &= 0x0F ^ (2 << (2 * number))
            self.interrupts.withdraw(2 * number, cycle)

    def _follow(self, number: int, cycle: int) -> None:
        low = (self.levels >> number & 1) ^ 1
        self.control = self.control & (0x0F ^ (2 << (2 * number))) | low << (2 * number + 1)
        self.interrupts.follow(2 * number, low, cycle)
