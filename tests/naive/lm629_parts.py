"""The arithmetic of the slow LM629: its filter, its stopping distance, its number formats.

Positions are fractions of a count, the stopping distance is added up term by term.
"""

import math
from fractions import Fraction

LSB = Fraction(1, 65536)
HIGH_WORD_READS = {0x07: 2, 0x08: 2, 0x09: 2, 0x0A: 2, 0x0B: 1, 0x0C: 1, 0x0D: 1}  # opcode to words


def modular(value, bits):
    """Two's complement of `bits` bits."""
    value %= 1 << bits
    return value - (1 << bits) if value >= 1 << (bits - 1) else value


def between(low, value, high):
    return sorted((low, value, high))[1]


def stopping_distance(speed, acceleration):
    """In LSBs: speed + (speed - a) + (speed - 2a) + ... down to the last that is not negative."""
    if speed == 0:
        return 0
    if acceleration == 0:
        return math.inf
    terms = range(speed, -1, -acceleration)
    if len(terms) > 5000:
        return len(terms) * (terms[0] + terms[-1]) // 2
    return sum(terms)


def profile_speed(v, a, limit, distance):
    """The new speed towards the target (steps 4 and 5 of the algorithm), all speeds in LSBs."""
    if v < 0:
        return min(v + a, 0)
    up = min(v + a, limit) if v < limit else max(v - a, limit)
    if stopping_distance(up, a) * LSB <= distance:
        return up
    if up >= v and stopping_distance(v, a) * LSB <= distance:
        return v
    return max(v - a, 0)


class NaivePid:
    def __init__(self, saturates, rounds_down=True):
        self.rounds_down = rounds_down
        self.kp = self.ki = self.kd = self.il = self.ds = 0
        self.saturates = saturates
        self.forget()

    def forget(self):
        self.errors = []
        self.sum = self.last_taken = self.held = self.integral = 0
        self.until_next = 0

    def load(self, kp, ki, kd, il, ds):
        self.kp, self.ki, self.kd, self.il, self.ds = kp, ki, kd, il, ds
        self.until_next = 0

    def top(self):
        return (
            math.floor(Fraction(self.sum, 256)) if self.rounds_down else math.trunc(Fraction(self.sum, 256))
        )

    def fit(self, value):
        return between(-32768, value, 32767) if self.saturates else modular(value, 16)

    def step(self, error):
        e = between(-32768, error, 32767)
        self.sum = between(-(2**23), self.sum + e, 2**23 - 1)
        self.integral = between(-self.il, self.fit(self.ki * self.top()), self.il)
        if self.until_next == 0:
            self.held = self.fit(self.kd * between(-32768, e - self.last_taken, 32767))
            self.last_taken = e
            self.until_next = self.ds + 1
        self.until_next -= 1
        return self.fit(self.fit(self.kp * e) + self.integral + self.held)
