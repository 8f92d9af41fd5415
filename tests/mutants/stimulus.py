"""What a host with all kinds of faults sends for a while: the same characters for every firmware."""

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, TICKS_PER_SECOND
from miro_exact.rng import Stream
from miro_protocol.frames import ServiceFrame, TeamFrame, encode
from miro_protocol.table import SYNC
from miro_protocol.transmission import DOWN, Transmission

MS = TICKS_PER_SECOND // 1000
VELOCITIES = (0, 1, -1, 255, -256, 3000, -3000, 5000, 12000, -12000, 16632, 16633, 16634, -16633, -16634)
VELOCITIES += (32767, -32767)
SILENCES_MS = (60, 105, 112, 149, 150, 151, 200, 480, 520, 700)
PAUSES_US = (10, 20, 80, 100, 500, 1100)
SETTINGS = (
    (0, ()),
    (1, (400, 40, 3000, 2000)),
    (1, (300, 0, 2500, 0)),
    (2, (5973,)),
    (2, (3000,)),
    (2, (70000,)),
)
GARBAGE = 40


class Host:
    """Draws what one host sends to a network of `n` robots, of which `slot` is listened to."""

    NOT_STATE = ("draw", "index", "n", "network", "seq", "slot", "tick")

    def __init__(self, seed, network, n, slot):
        self.draw = Stream(seed, f"stimulus of net{network}")
        self.index = 0
        self.network, self.n, self.slot = network, n, slot
        self.seq = 0
        self.tick = 10 * MS

    def pick(self, count):
        """0 .. count - 1."""
        self.index += 1
        return self.draw.u32(self.index) % count

    def transmissions(self, end_tick):
        """Until the next one would begin after `end_tick`."""
        while self.tick < end_tick:
            begun = self.tick
            yield from self.sent(self.pick(20))
            kind = self.pick(20)
            if kind == 0:
                self.tick += SILENCES_MS[self.pick(len(SILENCES_MS))] * MS
            elif kind < 16:
                self.tick = max(self.tick + MS, begun + CONTROL_PERIOD_TICKS)
            else:
                self.tick += self.pick(12) * MS

    def sent(self, kind):
        """One message, whole or with one fault, or no message at all."""
        if kind == 0:
            yield self.characters(bytes(self.pick(256) for _ in range(1 + self.pick(GARBAGE))))
            return
        data = bytearray(encode(self.message(), self.n))
        if kind == 1:
            data[self.pick(len(data))] ^= 1 << self.pick(8)
        elif kind == 2:
            data[8] ^= (1 << 7) ^ (1 << self.pick(7))  # of HDR: another type
        elif kind == 3:
            data[8:8] = SYNC
        if kind == 4:
            yield self.characters(bytes(data), (self.pick(len(data)),))
        elif kind == 5:
            place = 1 + self.pick(len(data) - 1)
            yield self.characters(bytes(data[:place]))
            self.tick += PAUSES_US[self.pick(len(PAUSES_US))] * MS // 1000
            yield self.characters(bytes(data[place:]))
        else:
            yield self.characters(bytes(data))

    def characters(self, data, bad_stop=()):
        begun = self.tick
        self.tick += len(data) * HOST_CHARACTER_TICKS
        return Transmission(begun, DOWN, data, self.network, bad_stop)

    def message(self):
        """Mostly the next number; now and then the same, an old or a far one."""
        step = self.pick(16)
        self.seq = (self.seq + (step if step < 3 else self.pick(64) if step == 3 else 1)) & 63
        if self.pick(8) == 0:
            opcode, values = SETTINGS[self.pick(len(SETTINGS))]
            slot = self.slot if self.pick(3) else self.pick(self.n)
            return ServiceFrame(self.seq, slot, opcode, values)
        pairs = tuple((self.velocity(), self.velocity()) for _ in range(self.n))
        if self.pick(8) == 0:
            pairs = ((0, 0),) * self.n
        return TeamFrame(3 if self.pick(2) else 0, self.seq, pairs)

    def velocity(self):
        if self.pick(3):
            return VELOCITIES[self.pick(len(VELOCITIES))]
        return self.pick(65535) - 32767
