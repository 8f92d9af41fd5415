"""A DS18B20 as slow as it is plain: all bits since the last reset are kept, and each answer is worked out from them.

`slot` gets the tick at which the master pulls the wire low, and whether it holds it (0) or lets it go (1: it may read).
"""

from fractions import Fraction
from math import floor


def crc(values):
    """The rest of a division of polynomials, on lists of bits."""
    bits = [value >> bit & 1 for value in values for bit in range(8)]
    bits += [0] * 8
    divisor = [1, 0, 0, 1, 1, 0, 0, 0, 1]  # x^8 + x^5 + x^4 + 1
    for place in range(len(bits) - 8):
        if bits[place]:
            for index, one in enumerate(divisor):
                bits[place + index] ^= one
    return sum(bit << place for place, bit in enumerate(bits[-8:]))


def byte_of(bits):
    return sum(bit << place for place, bit in enumerate(bits))


def bits_of(values):
    return [value >> bit & 1 for value in values for bit in range(8)]


class Thermometer:
    def __init__(self, serial, look, times, parasite=False):
        """`look`: ticks after which it looks at a slot. `times`: of a conversion by bits, and "copy"."""
        rom = [0x28, *serial]
        self.rom = bits_of([*rom, crc(rom)])
        self.look, self.times, self.parasite = look, times, parasite
        self.celsius = 20.0
        self.kept = [0x4B, 0x46, 0x7F]
        self.begin()

    def begin(self):
        self.scratch = [*self.kept]
        self.sixteenths, self.coming, self.alarm = 0x0550, None, False
        self.busy_until = self.copied = 0
        self.bits = None  # since the reset: (tick, bit), None for one that it sends

    def reset(self, tick):
        self.fall(tick)
        self.bits = []

    def fall(self, tick):
        if self.parasite and self.coming and tick < self.coming[0]:
            self.begin()

    def settle(self, tick):
        if self.coming and tick >= self.coming[0]:
            self.sixteenths, self.coming = self.coming[1], None
            signed = [value - 256 if value > 127 else value for value in self.scratch[:2]]
            self.alarm = not signed[1] < floor(Fraction(self.sixteenths, 16)) < signed[0]

    def slot(self, tick, bit):
        """The level of the wire in this slot."""
        self.fall(tick)
        if self.bits is None:
            return bit
        sent = self.turn(tick)
        if sent is not None:
            self.sent += 1
            return bit & sent
        self.bits.append(bit)
        self.act(tick + self.look)
        return bit

    def turn(self, tick):
        """The bit that the chip sends in this slot, None if it listens."""
        if not self.bits:
            self.sent = 0
        if len(self.bits) < 8:
            return None
        rom, rest = byte_of(self.bits[:8]), self.bits[8:]
        if rom == 0x33 and self.sent < 64:
            return self.rom[self.sent]
        if rom in (0xF0, 0xEC):
            if rom == 0xEC and not self.called_in_alarm:
                return None
            if rest != self.rom[: len(rest)] or len(rest) == 64 or self.sent == 2 * len(rest) + 2:
                return None
            return self.rom[len(rest)] ^ (self.sent - 2 * len(rest))
        command = self.command()
        if command is None:
            return None
        kind, _, begun = command
        answered = self.sent - begun
        if kind == 0xBE:
            return self.shown[answered] if answered < 72 else 1
        if kind == 0xB4:
            return 0 if self.parasite else 1
        if kind in (0x44, 0x48, 0xB8):
            return int(not (self.busy_until > tick or self.copied > tick))
        return None

    def command(self):
        """The function command, if it is there: kind, bits after it, slots that were sent before it."""
        rom, rest = byte_of(self.bits[:8]), self.bits[8:]
        begun = 64 if rom == 0x33 else 0
        if rom == 0x55:
            if rest[:64] != self.rom:
                return None
            rest = rest[64:]
        elif rom not in (0x33, 0xCC):
            return None
        return (byte_of(rest[:8]), len(rest) - 8, begun) if len(rest) >= 8 else None

    def act(self, tick):
        """What follows from the last bit."""
        if len(self.bits) == 8:
            self.settle(tick)
            self.called_in_alarm = self.alarm
        command = self.command() if len(self.bits) >= 16 else None
        if not command:
            return
        kind, count, _ = command
        if kind == 0x4E and count in (8, 16, 24):
            value = byte_of(self.bits[-8:])
            self.scratch[count // 8 - 1] = value if count < 24 else value & 0b1100000 | 0b11111
        if count:
            return
        self.settle(tick)
        if kind == 0x44:
            if self.coming:
                return
            bits = 9 + (self.scratch[2] >> 5 & 3)
            step = 2 ** (12 - bits)
            sixteenths = floor(Fraction(self.celsius) * 16 + Fraction(1, 2)) // step * step
            self.busy_until = tick + self.times[bits]
            self.coming = self.busy_until, sixteenths
        elif kind == 0xBE:
            values = [self.sixteenths & 0xFF, self.sixteenths >> 8 & 0xFF, *self.scratch, 0xFF, 0x0C, 0x10]
            self.shown = bits_of([*values, crc(values)])
        elif kind == 0x48:
            self.kept = [*self.scratch]
            self.copied = tick + self.times["copy"]
        elif kind == 0xB8:
            self.scratch = [*self.kept]
