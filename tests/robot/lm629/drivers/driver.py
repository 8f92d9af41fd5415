"""A host that drives one LM629 as published drivers of real chips do, at every phase of the sample.

`outcomes` plays a sequence at 64 phases and with three busy times. What a sequence returns has to be the same
everywhere: a driver cannot know where in a sample it is.
"""

from collections import Counter

from miro_robot.lm629.buffers import signed_31
from miro_robot.lm629.chip import SAMPLE_TICKS, Lm629
from miro_robot.lm629.options import Lm629Options
from tests.naive.lm629_encoder import FORWARD
from tests.robot.lm629.bench import Bench

PHASES = 64
BUSY_CLOCKS = (90, 120, 600)
"""15 us, the default of 20 us, and the 100 us that the data sheet allows, at 6 MHz."""
PLACES = PHASES * len(BUSY_CLOCKS)
MOTOR_OFF, BREAKPOINT, EXCESS, INDEX, COMPLETE, ERROR = 0x80, 0x40, 0x20, 0x08, 0x04, 0x02
HOST_INTERRUPT, ON_TARGET = 0x8000, 0x0400
BUSY_PAUSE = 120
PAUSE = 2900
LONGEST_WAIT = 150  # samples


class Driver(Bench):
    """The wheel is where it should be, `turn` counts a turn; the encoder gives an index pulse once a turn."""

    def __init__(self, turn=0, **options):
        self.turn_counts = turn
        super().__init__(Lm629(Lm629Options(**options)))
        self.chip.set_encoder(0, 0, 0)

    def wait(self, ticks):
        end = self.tick + ticks
        while (now := min(self.chip.next_tick, self.chip.hi_falls_tick)) <= end:
            sampled = now == self.chip.sample_tick
            self.chip.advance(now)
            self.note(now)
            if sampled:
                self.follow(now)
        self.tick = end

    def follow(self, tick):
        """Edges up to the next sample, so that the wheel is then where the profile is now."""
        missing = signed_31(self.chip.desired_position - self.chip.real_position)
        for _ in range(min(abs(missing), 200)):
            tick += 32
            self.place += 1 if missing > 0 else -1
            self.chip.set_encoder(tick, *FORWARD[self.place % 4])
            if self.turn_counts:
                self.chip.set_index(tick, 1 if self.place % self.turn_counts else 0)

    def sample(self, count=1):
        """As long as `count` samples: the phase stays."""
        self.wait(count * SAMPLE_TICKS)

    def ready(self):
        while self.status() & 1:
            self.wait(BUSY_PAUSE)

    def boot(self, phase):
        self.reset()
        self.command("RSTI", 0)
        self.ready()
        super().sample()
        self.wait(phase * SAMPLE_TICKS // PHASES)

    def until(self, condition):
        """Whether the condition comes true within `LONGEST_WAIT` samples."""
        end = self.tick + LONGEST_WAIT * SAMPLE_TICKS
        while self.tick < end:
            if condition():
                return True
            self.wait(PAUSE)
        return False

    def until_flag(self, flag):
        return self.until(lambda: self.status() & flag)

    def position(self, name, place):
        self.command(name, place >> 16 & 0xFFFF, place & 0xFFFF)


def outcomes(sequence, turn=0, boots=True, **options):
    """What the sequence returns, counted over all phases and busy times."""
    seen = Counter()
    for busy_clocks in BUSY_CLOCKS:
        for phase in range(PHASES):
            driver = Driver(turn, busy_clocks=busy_clocks, **options)
            if boots:
                driver.boot(phase)
            else:
                driver.wait(1000 + phase * SAMPLE_TICKS // PHASES)
            seen[sequence(driver)] += 1
    return seen


def everywhere(result):
    """The outcomes of a sequence that gives the same at every phase and with every busy time."""
    return {result: PLACES}
