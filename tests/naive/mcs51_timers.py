"""Timers 0, 1 and 2 put down a second time, one machine cycle at a time, with every flip-flop spelled out.

Written from the hardware manual's figures, not from the package: nothing here knows about lazy evaluation.
A cycle runs: counts (with what was sampled in the cycle before), flags, then sampling at S5P2. Software writes
happen between two calls of `cycle`.
"""


class NaiveTimers:
    """Registers are plain attributes; `pulses1` and `pulses2` list what the serial port would be clocked by."""

    def __init__(self):
        self.tmod = self.tcon = 0
        self.tl0 = self.th0 = self.tl1 = self.th1 = 0
        self.t2con = self.t2mod = 0
        self.tl2 = self.th2 = self.rcap2l = self.rcap2h = 0
        self.clock_out = 0
        self.samples = [self._pins(1, 1, 1, 1, 1, 1)] * 2  # of the last two cycles, older first
        self.overflowed1 = False  # timer 1, in the last cycle
        self.overflowed2 = []  # timer 2: ticks within the last cycle

    @staticmethod
    def _pins(int0, int1, t0, t1, t2, t2ex):
        return {"int0": int0, "int1": int1, "t0": t0, "t1": t1, "t2": t2, "t2ex": t2ex}

    def fell(self, pin):
        return self.samples[0][pin] == 1 and self.samples[1][pin] == 0

    def cycle(self, pins):
        """One machine cycle; `pins` are the levels at its S5P2."""
        self.overflowed1 = False
        self.overflowed2 = []
        self._timer0()
        self._timer1()
        self._timer2()
        self.samples = [self.samples[1], pins]

    # Timers 0 and 1

    def _mode(self, timer):
        return self.tmod >> (4 * timer) & 3

    def _runs(self, timer):
        tr = self.tcon >> (4 + 2 * timer) & 1
        gate = self.tmod >> (4 * timer) & 8
        return bool(tr and (not gate or self.samples[1][f"int{timer}"]))

    def _event(self, timer):
        if self.tmod >> (4 * timer) & 4:
            return self.fell(f"t{timer}")
        return True

    def _timer0(self):
        if self._mode(0) == 3 and self.tcon & 0x40:
            self.th0 = (self.th0 + 1) & 0xFF
            if self.th0 == 0:
                self.tcon |= 0x80
        if not (self._runs(0) and self._event(0)):
            return
        if self._mode(0) == 3:
            self.tl0 = (self.tl0 + 1) & 0xFF
            overflow = self.tl0 == 0
        else:
            self.tl0, self.th0, overflow = self._count(self._mode(0), self.tl0, self.th0)
        if overflow:
            self.tcon |= 0x20

    def _timer1(self):
        split = self._mode(0) == 3
        if self._mode(1) == 3 or not (split or self._runs(1)) or not self._event(1):
            return
        self.tl1, self.th1, overflow = self._count(self._mode(1), self.tl1, self.th1)
        if overflow:
            self.overflowed1 = True
            if not split:
                self.tcon |= 0x80

    @staticmethod
    def _count(mode, tl, th):
        if mode == 0:
            low = (tl & 0x1F) + 1
            carry = low >> 5
            tl = tl & 0xE0 | low & 0x1F
            return tl, (th + carry) & 0xFF, th + carry > 0xFF
        if mode == 1:
            low = tl + 1
            carry = low >> 8
            return low & 0xFF, (th + carry) & 0xFF, th + carry > 0xFF
        if tl == 0xFF:
            return th, th, True
        return tl + 1, th, False

    # Timer 2

    def _timer2(self):
        baud = bool(self.t2con & 0x30)
        counter = bool(self.t2con & 0x02)
        clock_out = bool(self.t2mod & 0x02) and not counter
        captures = bool(self.t2con & 0x01)
        up_down = bool(self.t2mod & 0x01) and not (baud or clock_out or captures)
        if self.fell("t2ex") and self.t2con & 0x08 and not up_down:
            self.t2con |= 0x40
            if not (baud or clock_out):
                if captures:
                    self.rcap2l, self.rcap2h = self.tl2, self.th2
                else:
                    self.tl2, self.th2 = self.rcap2l, self.rcap2h
        if not self.t2con & 0x04:
            return
        counts = [9] if counter and self.fell("t2") else []
        if not counter:
            counts = [1, 3, 5, 7, 9, 11] if baud or clock_out else [9]
        for tick in counts:
            if up_down and not self.samples[1]["t2ex"]:
                overflow = self._count_down()
            else:
                overflow = self._count_up(captures and not (baud or clock_out))
            if overflow:
                self.overflowed2.append(tick)
                self.clock_out ^= 1 if clock_out else 0
                if not (baud or clock_out):
                    self.t2con |= 0x80
                if up_down:
                    self.t2con ^= 0x40

    def _count_up(self, captures):
        value = (self.th2 << 8 | self.tl2) + 1
        if value > 0xFFFF:
            value = 0 if captures else self.rcap2h << 8 | self.rcap2l
            self.th2, self.tl2 = value >> 8, value & 0xFF
            return True
        self.th2, self.tl2 = value >> 8, value & 0xFF
        return False

    def _count_down(self):
        value = self.th2 << 8 | self.tl2
        underflow = value == self.rcap2h << 8 | self.rcap2l
        value = 0xFFFF if underflow else (value - 1) & 0xFFFF
        self.th2, self.tl2 = value >> 8, value & 0xFF
        return underflow
