"""A chip on the bench: bus cycles as a host drives them, with the chip's own events run on the way.

Only what several tests need; the sequences under test stand in the tests.
"""

from miro_robot.lm629.chip import SAMPLE_TICKS, Lm629
from miro_robot.lm629.commands import BY_NAME
from miro_robot.lm629.options import Lm629Options
from tests.naive.lm629_encoder import FORWARD

CYCLE = 12
"""One machine cycle of the host's CPU, the shortest time between two changes of a pin."""


class Bench:
    """`edges` collects (tick, pwm, sign, hi) at every change of the output pins."""

    def __init__(self, chip=None, tick=0):
        self.chip = Lm629() if chip is None else chip
        self.tick = tick
        self.edges = []
        self.pins = (1, 1, 1, 1, 0xFF)
        self.place = 0  # of the wheel

    @classmethod
    def running(cls, **options):
        """A bench whose chip has gone through the reset handshake, on a wheel whose phases are low."""
        bench = cls(Lm629(Lm629Options(**options)))
        bench.reset()
        bench.command("RSTI", 0)
        bench.chip.set_encoder(bench.tick, 0, 0)
        return bench

    def wait(self, ticks):
        end = self.tick + ticks
        while (now := min(self.chip.next_tick, self.chip.hi_falls_tick)) <= end:
            self.chip.advance(now)
            self.note(now)
        self.tick = end

    def note(self, tick):
        state = (self.chip.pwm, self.chip.sign, self.chip.hi)
        if not self.edges or self.edges[-1][1:] != state:
            self.edges.append((tick, *state))

    def drive(self, **levels):
        """Change pins now, then let one machine cycle pass."""
        cs, rd, wr, ps, data = self.pins
        named = {"cs": cs, "rd": rd, "wr": wr, "ps": ps, "data": data} | levels
        self.pins = (named["cs"], named["rd"], named["wr"], named["ps"], named["data"])
        self.chip.set_bus(self.tick, *self.pins)
        self.note(self.tick)
        self.wait(CYCLE)

    def reset(self, wait=True):
        self.chip.set_reset(self.tick, 0)
        self.wait(5 * CYCLE)
        self.chip.set_reset(self.tick, 1)
        if wait:
            self.wait(3 * SAMPLE_TICKS + 4)

    def write(self, ps, byte):
        self.drive(ps=ps, data=byte, cs=0)
        self.drive(wr=0)
        self.drive(wr=1)
        self.drive(cs=1)

    def read(self, ps):
        self.drive(ps=ps, data=0xFF, cs=0)
        self.drive(rd=0)
        byte = self.chip.data_out(self.tick)
        self.drive(rd=1)
        self.drive(cs=1)
        return byte

    def status(self):
        return self.read(0)

    def ready(self):
        while self.status() & 1:
            pass

    def word(self, word):
        self.ready()
        self.write(1, word >> 8)
        self.write(1, word & 0xFF)

    def command(self, name, *words):
        self.ready()
        self.write(0, BY_NAME[name].opcode)
        for word in words:
            self.word(word)

    def ask(self, name, signed=True):
        """A reading command and its answer."""
        self.command(name)
        answer = bytearray()
        for _ in range(BY_NAME[name].words_out):
            self.ready()
            answer += bytes((self.read(1), self.read(1)))
        return int.from_bytes(answer, "big", signed=signed)

    def signals(self):
        return self.ask("RDSIGS", signed=False)

    def load(self, control, *values):
        """LTRJ with 32-bit parameters."""
        words = [word for value in values for word in (value >> 16 & 0xFFFF, value & 0xFFFF)]
        self.command("LTRJ", control, *words)

    def start(self, control, *values, samples=1):
        """LTRJ, STT, and so many samples."""
        self.load(control, *values)
        self.command("STT")
        self.sample(samples)

    def filter(self, kp=0, ki=0, kd=0, il=0, ds=0):
        self.command("LFIL", ds << 8 | 0x0F, kp, ki, kd, il)
        self.command("UDF")

    def closed(self, error, samples=1, **coefficients):
        """The loop closed with a constant error."""
        self.filter(**coefficients)
        self.start(0x0200)
        self.command("RSTI", 0)
        self.sample()
        self.chip.trajectory.position = error * 65536
        self.sample(samples)

    def sample(self, count=1):
        """To the next sample boundary, `count` times."""
        for _ in range(count):
            self.wait(self.chip.sample_tick - self.tick)

    def turn(self, counts, pause=32):
        """Turn the encoder, as fast as the chip can follow."""
        for _ in range(abs(counts)):
            self.place += 1 if counts > 0 else -1
            self.chip.set_encoder(self.tick, *FORWARD[self.place % 4])
            self.wait(pause)
