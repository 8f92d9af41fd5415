"""The serial port in modes 1 to 3: transmitter and receiver on line levels.

   16x ticks --> /16, free running --> rollover: next bit, at S1P1        latch P3.1
   write SBUF --> [ start | D0 .. D7 | TB8 | stop ] ---------------------------(&)--> TXD;  with the stop bit: TI

        latch P3.0
   RXD ----(&)--+--> 1 then 0 at a 16x tick: reset and start --> /16
                +--> levels in its states 7, 8, 9 --> majority in state 10 --> [ D0 .. D7 | RB8 ] --> SBUF, RI

Where the 16x ticks come from (timer 1, timer 2, crystal) is worked out by `Peripherals`, which calls `set_clock`;
mode 0 is in `shift.py`.

Timing (4316E section 2.13; letters are rules in README.md), all in crystal ticks: `sync(tick)` does everything below
`tick`. Transmitter: the start bit begins at S1P1 after the first rollover that follows the write to SBUF, further bits
one rollover apart, TI with the stop bit. Receiver: tests RXD on every 16x tick for a fall, samples each bit in counter
states 7, 8, 9, acts in state 10; RI shows at the next S3P1 (U6). Between bits nothing is stepped: an idle
receiver takes the next edge from the Line.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import FLAG, TICK
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.interrupts import Interrupts
from miro_robot.mcs51.line import Line

STOPPED_TICK = 1 << 61
"""Next tick of a clock that does not run. A tick computed from it lies beyond it, and never comes."""
_STOPPED = STOPPED_TICK
_STOPPED_PERIOD = 1 << 40
_SERIAL = 4  # its place in the polling order
_SM0, _SM1, _SM2, _REN, _TB8, _RB8, _TI, _RI = 0x80, 0x40, 0x20, 0x10, 0x08, 0x04, 0x02, 0x01
_ROLLOVERS = 16
_COUNTER_BITS = 15  # of the divide-by-16 counter: masks instead of divisions
_VOTE_FIRST, _VOTE_LAST, _ACTION = 7, 9, 10  # states of the receiver's counter
_LAST_BIT = 9  # the start bit is 0
_LAST_ACTION = _LAST_BIT * _ROLLOVERS + _ACTION  # 16x ticks from the fall to the end of a character


def _flag_tick(tick: int) -> int:
    """Tick at which RI shows that the last vote was taken at `tick`: the next S3P1 (U6)."""
    return (tick + 7) // 12 * 12 + 4


class Uart:
    """Serial port. `rxd` and `txd` are the wires; `latch` bits 0 and 1 are P3.0 and P3.1, which gate them."""

    STATE = {
        "rxd": Line,
        "txd": Line,
        "latch": ("i", 0, 3),
        "scon": ("i", 0, 0xFF),
        "received": ("i", 0, 0xFF),
        "tx_next": ("q", 0, _STOPPED),
        "tx_period": ("q", 1, _STOPPED_PERIOD),
        "tx_phase": ("i", 0, 15),
        "tx_bits": ("i", 0, 0x7FF),
        "tx_left": ("i", 0, 11),
        "tx_value": ("i", 0, 0xFF),
        "tx_delay": ("q", 0, 12),
        "tx_level": FLAG,
        "tx_edge": TICK,
        "tx_coming": FLAG,
        "rx_next": ("q", 0, _STOPPED),
        "rx_period": ("q", 1, _STOPPED_PERIOD),
        "rx_count": ("i", 0, 0xFF),
        "rx_last": FLAG,
        "rx_votes": ("i", 0, 3),
        "rx_bits": ("i", 0, 0x1FF),
        "rx_done": TICK,
        "rx_frame": ("i", 0, 0x1FF),
    }
    NOT_STATE = ("bus", "interrupts", "overruns")

    def __init__(self, bus: Bus, interrupts: Interrupts) -> None:
        self.bus = bus
        self.interrupts = interrupts
        self.overruns = 0  # characters lost because RI was still up
        self.rxd = Line()
        self.rxd.settled_tick = NEVER_TICK  # nothing connected: mark, until a producer sets it
        self.txd = Line()
        self.txd.unread = True  # until a listener says otherwise
        self.latch = 3
        self.received = 0  # SBUF as read
        self.tx_bits = 0  # what is still to be sent, next bit lowest
        self.tx_value = 0
        self.tx_delay = 0  # from rollover to pin (U3); 0 before the start bit
        self.tx_coming = 1
        self.rx_last = 1  # RXD at the last 16x tick
        self.rx_votes = 0
        self.rx_bits = 0
        self.rx_frame = 0  # data, and the bit after them in bit 8
        self.set_clock(NEVER_TICK, 0, NEVER_TICK, 0)
        self.clear(0)

    def clear(self, cycle: int) -> None:
        """Resets registers and both state machines to the state after reset in `cycle`; SBUF stays unchanged."""
        self.scon = 0
        self.tx_phase = 0  # 16x ticks since the last rollover
        self.abort(12 * cycle)
        self.interrupts.withdraw(_SERIAL, cycle)

    def abort(self, tick: int) -> None:
        """Both state machines to idle: reset, and a change of mode; with everything below `tick` done."""
        # The line goes back to mark, unless P3.1 holds it low.
        self.txd.append(tick, self.latch >> 1)
        self.tx_left = 0  # how many bits are still to be sent; 0 idle
        self.tx_edge = NEVER_TICK  # tick at which tx_coming replaces tx_level
        self.tx_level = 1  # what the transmitter puts on TXD
        self.rx_count = 0  # 16x ticks since the fall; 0 searching
        self.rx_done = NEVER_TICK  # tick at which rx_frame is delivered

    def mode(self) -> int:
        return self.scon >> 6

    def set_clock(self, rx_next: int, rx_period: int, tx_next: int, tx_period: int) -> None:
        """16x ticks from now on: the next one and their distance, for both directions. NEVER_TICK stops one."""
        self.rx_next = rx_next if rx_next < _STOPPED else _STOPPED
        self.rx_period = rx_period if rx_next < _STOPPED else _STOPPED_PERIOD
        self.tx_next = tx_next if tx_next < _STOPPED else _STOPPED
        self.tx_period = tx_period if tx_next < _STOPPED else _STOPPED_PERIOD

    def sync(self, tick: int) -> None:
        """Sends and receives everything below `tick`."""
        self._transmit(tick)
        self._receive(tick)

    def pulse(self, rx: int, tx: int, tick: int) -> None:
        """Processes one 16x tick for either direction, from an irregular clock."""
        if rx:
            self.rx_next = tick
        if tx:
            self.tx_next = tick
        self.sync(tick + 1)
        if rx:
            self.rx_next = _STOPPED
        if tx:
            self.tx_next = _STOPPED

    def level(self, tick: int) -> int:
        """RXD as the pin has it: the wire ANDed with the latch of P3.0."""
        return self.rxd.level_at(tick) if self.latch & 1 else 0

    # Registers

    def write_scon(self, value: int, cycle: int) -> None:
        """SCON is written; `cycle` is the first to see it. Another mode aborts what is on its way (U5)."""
        if (value ^ self.scon) & (_SM0 | _SM1):
            self.abort(12 * cycle)
        switched_on = value & ~self.scon & _REN
        self.scon = value
        # Software sets and clears both flags; the interrupt is their OR (4316E sections 2.13, 2.16).
        self.interrupts.follow(_SERIAL, value & (_RI | _TI), cycle)
        if switched_on:
            self.bus.receiver_on(12 * cycle)

    def write_sbuf(self, value: int) -> None:
        """Loads the transmitter; a character on its way is cut off, the new one begins at the next rollover (U4)."""
        self.tx_value = value
        if self.scon & _SM0:  # nine bits
            # TB8 is loaded together with SBUF: a later write to it is for the next character (4316E section 2.13).
            ninth = 1 if self.scon & _TB8 else 0
            # The start bit (0) is lowest, then the data from bit 0 on, the stop bit (1) highest.
            self.tx_bits = (value << 1) | (ninth << 9) | (1 << 10)
            self.tx_left = 11
        else:
            self.tx_bits = (value << 1) | (1 << 9)
            self.tx_left = 10
        # Taken anew from this character's first rollover; all its bits keep it (U3).
        self.tx_delay = 0

    def write_latch(self, latch: int, tick: int) -> None:
        """P3.1:0 is written; called with everything below `tick` done."""
        self.latch = latch
        # At once, also within a bit: the latch and the transmitter are ANDed at the pin.
        self.txd.append(tick, self.tx_level & (latch >> 1))

    def raise_flag(self, flag: int, tick: int) -> None:
        """TI or RI goes up at `tick`, and is seen at the next S5P2."""
        self.scon |= flag
        # S5P2 is tick 9 of a cycle: a flag of ticks 10 and 11 is seen by the next one.
        self.interrupts.ask(_SERIAL, (tick + 2) // 12)

    # Transmitter

    def _transmit(self, tick: int) -> None:
        while True:
            # The pin follows its rollover by at most 12 ticks, so before the next rollover.
            if self.tx_edge < tick:
                self._edge()
            if self.tx_left == 0:
                break
            rollover = self.tx_next + (_ROLLOVERS - 1 - self.tx_phase) * self.tx_period
            if rollover >= tick:
                break
            self.tx_next = rollover + self.tx_period
            self.tx_phase = 0
            if self.tx_delay == 0:
                self.tx_delay = 12 - rollover % 12
            self.tx_edge = rollover + self.tx_delay
            self.tx_coming = self.tx_bits & 1
            self.tx_bits >>= 1
            self.tx_left -= 1
        # The divider runs while nothing is sent: where it stands decides when the next character begins (U1).
        if self.tx_next < tick:
            passed = (tick - 1 - self.tx_next) // self.tx_period + 1
            self.tx_next += passed * self.tx_period
            self.tx_phase = (self.tx_phase + passed) & _COUNTER_BITS

    def _edge(self) -> None:
        """Puts one bit on TXD; the stop bit sets TI."""
        self.tx_level = self.tx_coming
        self.txd.append(self.tx_edge, self.tx_level & (self.latch >> 1))
        if self.tx_left == 0:
            self.raise_flag(_TI, self.tx_edge)
            self.bus.byte_sent(self.tx_value, self.tx_edge)
        self.tx_edge = NEVER_TICK

    def ti_tick(self) -> int:
        """Tick at which TI goes up if nothing changes, NEVER_TICK if nothing is being sent."""
        if self.tx_left == 0:
            return self.tx_edge
        return self._first_bit() + (self.tx_left - 1) * _ROLLOVERS * self.tx_period

    def tx_at(self, tick: int) -> int:
        """The transmitter's level on TXD at `tick`, if nothing changes until then; not for ticks in the past."""
        level = self.tx_coming if self.tx_edge <= tick else self.tx_level
        edge = self._first_bit()
        for number in range(self.tx_left):
            if edge > tick:
                break
            level = self.tx_bits >> number & 1
            edge += _ROLLOVERS * self.tx_period
        return level

    def tx_after(self, tick: int) -> int:
        """The tick of its first edge later than that, NEVER_TICK without one."""
        level = self.tx_at(tick)
        if tick < self.tx_edge < NEVER_TICK and self.tx_coming != level:
            return self.tx_edge
        edge = self._first_bit()
        for number in range(self.tx_left):
            if edge > tick and self.tx_bits >> number & 1 != level:
                return edge if edge < _STOPPED else NEVER_TICK
            edge += _ROLLOVERS * self.tx_period
        return NEVER_TICK

    def _first_bit(self) -> int:
        """Tick of the next bit that has no rollover yet."""
        rollover = self.tx_next + (_ROLLOVERS - 1 - self.tx_phase) * self.tx_period
        return rollover + (self.tx_delay if self.tx_delay else 12 - rollover % 12)

    # Receiver

    def _receive(self, tick: int) -> None:
        while True:
            if self.rx_done < tick and self.rx_done <= self.rx_next:
                self._deliver()
            if self.rx_next >= tick:
                break
            if self.rx_count == 0:
                self._search(tick)
            else:
                self._bit(tick)
        if self.rx_done < tick:
            self._deliver()

    def _search(self, tick: int) -> None:
        """From 16x tick to 16x tick below `tick`, jumping over constant level, until a 1 is followed by a 0."""
        now = self.rx_next
        enabled = self.scon & _REN
        while now < tick:
            level = self.level(now)
            # A fall, not a low level: a line that is still low after a bad stop bit starts nothing (4316E 2.13).
            if enabled and self.rx_last and not level:
                self.rx_last = 0
                self.rx_count = 1
                self.rx_votes = 0
                self.rx_bits = 0
                self.rx_next = now + self.rx_period
                return
            self.rx_last = level
            # P3.0 at 0 holds the pin low whatever the wire does.
            change = min(self.rxd.next_edge(now), tick) if self.latch & 1 else tick
            now += ((change - now + self.rx_period - 1) // self.rx_period) * self.rx_period
        self.rx_next = now

    def _bit(self, tick: int) -> None:
        """16x ticks of a character below `tick`: only counter states 7 to 10 of its bits do anything."""
        period = self.rx_period
        while self.rx_next < tick and self.rx_count:
            state = self.rx_count & _COUNTER_BITS
            now = self.rx_next
            # Whole bits can be skipped only before the vote of state 7 or after state 10.
            if (state <= _VOTE_FIRST or state > _ACTION) and self._unanimous(tick):
                continue
            if state < _VOTE_FIRST or state > _ACTION:
                idle = (_VOTE_FIRST - state) & _COUNTER_BITS
                if now + (idle - 1) * period >= tick:
                    idle = (tick - 1 - now) // period + 1
                self.rx_count += idle
                self.rx_next = now + idle * period
                # Kept up to date when skipping, too: after a start bit that was noise the search continues from it.
                self.rx_last = self.level(self.rx_next - period)
                continue
            level = self.level(now)
            self.rx_last = level
            self.rx_next = now + period
            self.rx_count += 1
            if state < _ACTION:
                self.rx_votes += level
            else:
                self._act(now)

    def _unanimous(self, tick: int) -> bool:
        """Takes bits below `tick` at once whose three samples agree: the start bit, or data to the last bit.

        False if the next bit needs its votes one by one.
        """
        period = self.rx_period
        idle = (_VOTE_FIRST - self.rx_count) & _COUNTER_BITS
        first = self.rx_next + idle * period
        number = (self.rx_count + idle) >> 4
        # At most to the last bit: it decides what comes next, as the start bit does by itself.
        most = _LAST_BIT + 1 - number if 1 <= number <= _LAST_BIT else 1
        # `samples` knows only the wire; while P3.0 is low, the pin is low regardless.
        if not self.latch & 1:
            return False
        sampled = self.rxd.samples(first, _ROLLOVERS * period, 3 * period, tick, most)
        more = (sampled >> 16) - 1  # bits after the first; bits 0 to 15 are their levels
        if more < 0:
            return False
        level = sampled >> more & 1
        self.rx_last = level
        self.rx_votes = 3 * level
        self.rx_bits |= (sampled & ((1 << more) - 1)) << number >> 1
        self.rx_count += idle + 4 + _ROLLOVERS * more  # 4: states 7 to 10 of the last bit
        self.rx_next = first + (4 + _ROLLOVERS * more) * period
        self._act(self.rx_next - period)
        return True

    def _act(self, now: int) -> None:
        """State 10 of a bit: take the vote. Bit 0 is the start bit; the last one ends the frame."""
        number = self.rx_count >> 4
        bit = 1 if self.rx_votes >= 2 else 0
        self.rx_votes = 0
        # A start bit that is 1 by majority was noise: back to the search (4316E section 2.13).
        if number == 0:
            if bit:
                self.rx_count = 0
        elif number <= 8:
            self.rx_bits |= bit << (number - 1)
        elif number == _LAST_BIT:
            self.rx_frame = self.rx_bits | (bit << 8)
            self.rx_done = _flag_tick(now)
            # Eight bits: this was the stop bit. The search begins before it is over, so a sender may be fast.
            if not self.scon & _SM0:
                self.rx_count = 0
        else:  # the stop bit of a nine-bit frame: ignored, but the search begins only now (U7)
            self.rx_count = 0

    def _deliver(self) -> None:
        """Into SBUF and RB8, if RI is 0 and SM2 lets it pass; otherwise the frame is lost."""
        tick = self.rx_done
        self.rx_done = NEVER_TICK
        last = self.rx_frame >> 8
        # Checked when the character is complete, not before: SBUF may be read until then (4316E section 2.13).
        if self.scon & _RI or (self.scon & _SM2 and not last):
            if last or not self.scon & _SM2:
                self.overruns += 1
            return
        self.received = self.rx_frame & 0xFF
        self.scon = (self.scon & (0xFF ^ _RB8)) | (_RB8 if last else 0)
        self.raise_flag(_RI, tick)
        self.bus.byte_received(self.received, last, tick)

    def ri_tick(self) -> int:
        """A tick before which RI will not go up: where the next character shows, NEVER_TICK if none can come."""
        if self.rx_done != NEVER_TICK:
            return self.rx_done
        if self.rx_count > _LAST_ACTION:  # a nine-bit frame without its stop bit: no other begins before that
            return self.rx_next + (_LAST_ACTION + _ROLLOVERS - self.rx_count) * self.rx_period
        if self.rx_count:
            return _flag_tick(self.rx_next + (_LAST_ACTION - self.rx_count) * self.rx_period)
        start = self._start_tick()
        return _flag_tick(start + _LAST_ACTION * self.rx_period) if start < _STOPPED else NEVER_TICK

    def _start_tick(self) -> int:
        """The 16x tick that finds the next start bit, as far as is known; NEVER_TICK if none can come.

        It follows from the level at the next 16x tick and the edges after it: a run that ends forgets earlier ones.
        """
        tick = self.rx_next
        if not self.scon & _REN or tick >= _STOPPED:
            return NEVER_TICK
        if not self.latch & 1:  # P3.0 holds RXD low
            return tick if self.rx_last else NEVER_TICK
        settled = self.rxd.settled_tick
        if tick >= settled or (self.rx_last and not self.rxd.level_at(tick)):
            return tick
        change = min(self.rxd.next_edge(tick), settled)
        return change + (tick - change) % self.rx_period if change < _STOPPED else NEVER_TICK

    def turn_tick(self) -> int:
        """A tick before which nothing changes what `ri_tick` knows: a fall, the vote of a start bit, RI."""
        if self.rx_done == NEVER_TICK and self.rx_count == 0:
            return self._start_tick()
        if self.rx_done == NEVER_TICK and self.rx_count <= _ACTION:
            return self.rx_next + (_ACTION - self.rx_count) * self.rx_period
        return self.ri_tick()

    def check_times(self, tick: int) -> None:
        """Raises ValueError unless the port continues at `tick`: what it sends comes after the edges on TXD."""
        if self.txd.last_tick() > tick or self.tx_edge < tick or self.tx_next < tick:
            raise ValueError(f"the serial port has edges of TXD out of order at tick {tick}")
        if self.rx_next < tick:
            raise ValueError(f"the serial port is behind tick {tick}")
