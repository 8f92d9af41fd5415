"""An EEPROM as slow as it is plain: the bits since the last start are kept, and all is worked out from them.

`wire` gets the levels of SCL and SDA whenever one of them has changed, as they are on the wires; `low` says whether the
chip pulls SDA low from then on.
"""

SIZES = {"02": (256, 8, "210", 1), "16": (2048, 16, "", 1), "64": (8192, 32, "210", 2)}
"""Bytes, bytes of a page, address pins, bytes of the word address."""


class Eeprom:
    def __init__(self, size, write_ticks):
        self.bytes, self.page, self.pins, self.words = SIZES[size]
        self.write_ticks = write_ticks
        self.memory = {}
        self.counter = 0
        self.writes = 0
        self.pending = None  # end of the write cycle, and what it writes
        self.scl = self.sda = 1
        self.bits = None  # since the start
        self.low = False
        self.acknowledged = False
        self.powered = True

    def content(self):
        return bytes(self.memory.get(address, 0xFF) for address in range(self.bytes)).hex()

    def busy(self, tick):
        if self.pending and self.pending[0] <= tick:
            self.memory.update(self.pending[1])
            self.pending = None
        return self.pending is not None

    def supply(self, tick, on):
        if self.busy(tick - 1) and not on:
            self.memory.update(dict.fromkeys(self.pending[1], 0xFF))
            self.pending = None
        self.powered = on
        self.bits, self.low, self.counter = None, False, 0

    def bytes_so_far(self):
        """Bytes whose eight bits are there, the address first."""
        groups = [self.bits[first : first + 8] for first in range(0, len(self.bits), 9)]
        return [int("".join(map(str, group)), 2) for group in groups if len(group) == 8]

    def is_meant(self, tick):
        bits = self.bits
        pins_are_low = all(bits[4 + "210".index(pin)] == 0 for pin in self.pins)
        return not self.busy(tick) and bits[:4] == [1, 0, 1, 0] and pins_are_low

    def block(self):
        """Upper bits of the word address that the address byte has."""
        return 0 if self.pins else (self.bytes_so_far()[0] >> 1 & 7) << 8

    def wire(self, tick, scl, sda, wp):
        scl_moved, sda_moved, self.scl, self.sda = scl != self.scl, sda != self.sda, scl, sda
        if not self.powered:
            return
        if scl_moved and scl:
            if self.bits is not None:
                self.bits.append(sda)
        elif scl_moved:
            self.fall(tick)
        elif sda_moved and scl:
            self.finish(tick, bool(sda), wp)
            self.bits = None if sda else []

    def fall(self, tick):
        if self.bits is None:
            return
        place = len(self.bits) % 9
        if len(self.bits) == 8:
            self.acknowledged = self.is_meant(tick)
            if self.acknowledged and not self.pins:
                self.counter = self.block() + self.counter % 256
        if len(self.bits) < 8 or not self.acknowledged:
            self.low = False
        elif not self.bits[7]:
            self.low = place == 8
        else:
            sent = self.sent()
            self.low = len(self.bits) == 8 or (place != 8 and bool(sent) and not sent[-1] >> (7 - place) & 1)

    def sent(self):
        """The bytes that it began to send, up to a missing acknowledge; none once that has come."""
        count = len(self.bits) // 9
        if 1 in [self.bits[9 * number + 8] for number in range(1, count)]:
            return []
        return [self.memory.get((self.counter + number) % self.bytes, 0xFF) for number in range(count)]

    def finish(self, tick, stop, wp):
        """A stop or a start ends what was going on; SCL has risen once since the last bit that counts."""
        if self.bits is None or len(self.bits) < 9 or not self.acknowledged:
            return
        done = self.bits[:-1]
        if self.bits[7]:
            acks = [done[place] for place in range(17, len(done), 9)]
            begun = 1 + (acks.index(1) if 1 in acks else len(acks))
            self.counter = (self.counter + (begun if len(done) >= 9 else 0)) % self.bytes
            return
        received = [
            int("".join(map(str, done[first : first + 8])), 2)
            for first in range(9, len(done), 9)
            if len(done) >= first + 8
        ]
        if self.words == 1 and received:
            self.counter = (self.counter // 256 * 256 + received[0]) % self.bytes
        if self.words == 2 and received:
            self.counter = self.counter * 256 + received[0]
            if received[1:]:
                self.counter = self.counter * 256 + received[1]
            self.counter %= self.bytes
        wanted = {}
        first = self.counter // self.page * self.page
        for value in received[self.words :]:
            wanted[self.counter] = value
            self.counter = first + (self.counter + 1 - first) % self.page
        if stop and len(self.bits) % 9 == 1 and wanted and not wp:
            self.writes += 1
            self.pending = tick + self.write_ticks, wanted
