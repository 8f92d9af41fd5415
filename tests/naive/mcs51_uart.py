"""The serial port (modes 1 to 3) put down a second time: every 16x tick, every counter state, nothing skipped.

Driven tick by tick of the crystal: `tick(now, rxd)` for each, with `clock(now)` called first at ticks in which the
clock source overflows. Software reads and writes between two machine cycles.
"""


class NaiveUart:
    """Two divide-by-16 counters with their shift registers."""

    def __init__(self):
        self.scon = 0
        self.sbuf = 0  # receive side
        self.txd = [(0, 1)]  # edges
        self.halves = {"rx": 0, "tx": 0}
        # transmitter
        self.divider = 0
        self.pending = None  # bits not yet on the pin
        self.delay = 0
        self.due = []  # (tick, level, last)
        # receiver
        self.previous = 1
        self.state = None  # 16x ticks since the fall
        self.samples = []
        self.bits = []
        self.delivery = None

    @property
    def nine(self):
        return bool(self.scon & 0x80)

    def write_sbuf(self, value):
        bits = [0, *(value >> number & 1 for number in range(8))]
        if self.nine:
            bits.append(self.scon >> 3 & 1)
        self.pending = [*bits, 1]
        self.delay = 0

    def write_scon(self, value, now):
        if (value ^ self.scon) & 0xC0:
            self.pending, self.due, self.state, self.delivery = None, [], None, None
            self._put(now, 1)
        self.scon = value

    def clock_tx(self, now):
        self.divider += 1
        if self.divider < 16:
            return
        self.divider = 0
        if self.pending:
            if not self.delay:
                self.delay = 12 - now % 12  # to the next S1P1
            level = self.pending.pop(0)
            self.due.append((now + self.delay, level, not self.pending))

    def clock_rx(self, now, rxd):
        fell = self.previous == 1 and rxd == 0
        self.previous = rxd
        if self.state is None:
            if fell and self.scon & 0x10:
                self.state, self.samples, self.bits = 0, [], []
            return
        self.state += 1
        if self.state % 16 in (7, 8, 9):
            self.samples.append(rxd)
        if self.state % 16 == 10:
            self.bits.append(1 if sum(self.samples) >= 2 else 0)
            self.samples = []
            if self.bits == [1]:
                self.state = None
            elif len(self.bits) == 10:
                shown = now
                while shown % 12 != 4:  # S3P1
                    shown += 1
                self.delivery = (shown, self.bits[1:])
                if not self.nine:
                    self.state = None
            elif len(self.bits) == 11:
                self.state = None

    def tick(self, now):
        """What shows at this tick."""
        if self.due and self.due[0][0] == now:
            _, level, last = self.due.pop(0)
            self._put(now, level)
            if last:
                self.scon |= 0x02
        if self.delivery and self.delivery[0] == now:
            bits = self.delivery[1]
            self.delivery = None
            if not self.scon & 0x01 and (not self.scon & 0x20 or bits[8]):
                self.sbuf = sum(bit << number for number, bit in enumerate(bits[:8]))
                self.scon = self.scon & 0xFB | bits[8] << 2 | 0x01

    def _put(self, now, level):
        if self.txd[-1][1] != level:
            self.txd.append((now, level))
