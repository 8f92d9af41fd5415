"""Random sessions at the pins: the chip and its slow twin agree after every step, however the rules are read."""

from fractions import Fraction

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from miro_robot.event_log import EventLog
from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.commands import COMMANDS
from miro_robot.lm629.options import CHOICES, DEFAULT_OPTIONS, Lm629Options
from tests.example_count import examples
from tests.naive.lm629 import NaiveLm629
from tests.robot.lm629.bench import Bench

NO_WORDS = [command.name for command in COMMANDS if not command.words_in and command.name != "RESET"]
POSITIONS = st.one_of(
    st.integers(-60, 60),
    st.integers(-(2**30), 2**30 - 1),
    st.sampled_from([-(2**30), 2**30 - 1, 2**30 - 3, 0]),
)
ACCELERATIONS = st.one_of(st.integers(0x800, 0x30000), st.integers(0, 2**32 - 1))
VELOCITIES = st.one_of(st.integers(0, 0x80000), st.integers(0, 2**32 - 1))
CONTROLS = st.sampled_from(
    [0x002A, 0x002B, 0x000A, 0x0002, 0x0003, 0x1828, 0x0828, 0x0008, 0x003F]
) | st.builds(
    lambda a, b: a & 0xF83F | b, st.integers(0, 0xFFFF), st.sampled_from([0, 0x100, 0x200, 0x400, 0x700])
)
COEFFICIENTS = st.integers(0, 300) | st.integers(0, 0xFFFF)
WORDY = ["LPEI", "MSKI", "RSTI", "LFIL", "SBPA", "LTRJ"]
FLAGS = st.sampled_from([0, 0x7E, 0x3E, 0xFFFF]) | st.integers(0, 0xFFFF)


@st.composite
def trajectories(draw):
    control = draw(CONTROLS)
    values = []
    for bit, choice in ((0x20, ACCELERATIONS), (0x08, VELOCITIES), (0x02, POSITIONS)):
        if control & bit:
            values.append(draw(choice))
    return ("load", control, *values)


HOST_ACTIONS = st.one_of(
    st.tuples(st.just("command"), st.sampled_from(NO_WORDS)),
    st.tuples(st.just("ask"), st.sampled_from([c.name for c in COMMANDS if c.words_out])),
    st.tuples(st.just("command"), st.sampled_from(["LPES", "LPEI"]), st.integers(0, 40) | FLAGS),
    st.tuples(st.just("command"), st.sampled_from(["MSKI", "RSTI"]), FLAGS),
    st.builds(
        lambda name, place: ("command", name, place >> 16 & 0xFFFF, place & 0xFFFF),
        st.sampled_from(["SBPA", "SBPR"]),
        POSITIONS,
    ),
    st.tuples(st.just("write"), st.integers(0, 1), st.integers(0, 0x22) | st.integers(0, 255)),
    st.tuples(st.just("read"), st.integers(0, 1)),
    st.tuples(st.just("slow_write"), st.integers(0, 1), st.integers(0, 0x22), st.integers(0, 900)),
    st.tuples(
        st.just("glitches"), st.lists(st.tuples(*[st.integers(0, 1)] * 4, st.integers(0, 0x22)), max_size=6)
    ),
    st.tuples(st.just("hurry"), st.sampled_from(NO_WORDS), st.integers(0, 0x22)),
    st.builds(
        lambda first, second, data: ("half_a_word", first, second, *data),
        st.sampled_from(WORDY),
        st.sampled_from([*WORDY, "RDRP", "RDSIGS"]),
        st.tuples(*[st.integers(0, 255)] * 3),
    ),
    st.tuples(st.just("excess"), st.integers(0, 20)),
    st.just(("index_over_reset",)),
    st.just(("command", "RESET")),
)
WORLD_ACTIONS = st.one_of(
    st.tuples(st.just("wait"), st.integers(1, 3000)),
    st.tuples(st.just("turn"), st.integers(-70, 70)),
    st.tuples(st.just("turn"), st.integers(-70, 70)),
    st.tuples(st.just("index"), st.integers(0, 1)),
    st.tuples(st.just("find_index"), st.integers(1, 9)),
    st.tuples(st.just("jump"), POSITIONS),
    st.tuples(st.just("cross"), st.sampled_from([-(2**30), 2**30 - 1]), st.integers(-30, 30)),
    st.tuples(st.just("pass_breakpoint"), st.integers(-20, 20), st.integers(-30, 30)),
    st.tuples(st.just("home_loaded"), st.integers(1, 9), POSITIONS),
    st.tuples(st.just("ask_between_samples"), st.integers(1, 9)),
    st.tuples(
        st.just("stress"), st.integers(-200_000, 200_000), COEFFICIENTS, COEFFICIENTS, st.integers(1, 500)
    ),
    st.tuples(st.just("wind_up"), st.integers(-(2**23), 2**23 - 1)),
    st.tuples(st.just("pulse"), st.sampled_from([28, 32, 50])),
)
MOVES = st.one_of(
    st.tuples(st.just("go"), trajectories(), st.integers(1, 25)),
    st.tuples(st.just("go"), trajectories(), st.just(1)),
    trajectories(),
    st.tuples(st.just("filter"), COEFFICIENTS, COEFFICIENTS, COEFFICIENTS, COEFFICIENTS, st.integers(0, 4)),
    st.tuples(st.just("go_twice"), trajectories(), trajectories()),
    st.tuples(st.just("stops"), st.integers(-200, 200), st.sampled_from([0x100, 0x200, 0x400])),
    st.tuples(st.just("nudge"), st.integers(-300, 300), st.integers(1, 6)),
    st.tuples(st.just("retune"), COEFFICIENTS, st.integers(1, 4), st.integers(1, 6)),
    st.just(("command", "STT")),
    st.tuples(st.just("sample"), st.integers(1, 12)),
)
ACTIONS = st.one_of(MOVES, MOVES, HOST_ACTIONS, WORLD_ACTIONS)
POLITE = (
    "load go go_twice filter retune command ask hurry home_loaded ask_between_samples stress stops half_a_word excess "
    "index_over_reset nudge sample find_index cross pass_breakpoint"
)
"""These would wait for ever for a chip that is in reset."""
LENGTHS = {
    "busy_clocks": [120, 160, 0, 33],
    "reset_clocks": [6144, 50],
    "reset_pulse_clocks": [8],
    "filter_clocks": [8, 8, 1, 0],
}
OPTIONS = st.builds(
    Lm629Options,
    **{name: st.sampled_from(values) for name, values in LENGTHS.items()},
    **{name: st.sampled_from(values) for name, values in CHOICES.items()},
)
OPTIONS = st.just(DEFAULT_OPTIONS) | OPTIONS


class Pair:
    """The chip and its slow twin, compared after every step; looks like a chip to a `Bench`."""

    def __init__(self, options):
        self.chip = Lm629(options)
        self.log = EventLog()
        self.chip.tell(self.log, 0)
        self.naive = NaiveLm629(options)

    def __getattr__(self, name):
        return getattr(self.chip, name)

    def compare(self, tick):
        chip, naive = self.chip, self.naive
        loaded, gains = chip.trajectory_buffer, chip.filter_buffer
        pairs = {
            "status": (chip.status_at(tick), naive.status_at(tick)),
            "signals": (chip.signals.word, naive.signals_word()),
            "hi": (chip.hi, naive.hi_at(tick)),
            "output": (
                (chip.pwm, chip.sign, chip.pwm_magnitude),
                (naive.pwm_at(tick), naive.sign, naive.magnitude),
            ),
            "data": (chip.data_out(tick), naive.data_out(tick)),
            "lost": (chip.writes_while_busy, naive.lost),
            "notes": (self.log.end, naive.lost_starts + naive.lost_wheels + len(chip.commands)),
            "breakpoint": (chip.breakpoint, naive.breakpoint[0]) if naive.breakpoint else (0, 0),
            "position": (chip.real_position, naive.real),
            "velocity": (chip.real_velocity, naive.velocity_counts),
            "index": (chip.index_position, naive.index_position),
            "desired position": (chip.trajectory.position, naive.desired * 65536),
            "desired velocity": (chip.desired_velocity, naive.speed),
            "integral": (chip.pid.integral, naive.pid.integral),
            "target": (chip.trajectory.target, naive.target),
            "threshold": (chip.threshold, naive.threshold),
            "mask": (chip.signals.mask, sum(1 << bit for bit in naive.mask)),
            "trajectory": (
                (loaded.acceleration, loaded.velocity, loaded.position, loaded.relative),
                (naive.buffer["a"], naive.buffer["v"], naive.buffer["p"], naive.relative),
            ),
            "filter": (
                (*gains.coefficients, gains.ds),
                tuple(naive.filter[name] for name in ("kp", "ki", "kd", "il", "ds")),
            ),
        }
        differing = {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}
        assert not differing, f"ours and the twin's at tick {tick}"

    def advance(self, tick):
        self.chip.advance(tick)
        self.naive.run_to(tick)
        self.compare(tick)

    def set_bus(self, tick, cs, rd, wr, ps, data):
        self.chip.set_bus(tick, cs, rd, wr, ps, data)
        self.naive.set_bus(tick, cs, rd, wr, ps, data)
        self.compare(tick)

    def set_reset(self, tick, level):
        self.chip.set_reset(tick, level)
        self.naive.set_reset(tick, level)
        self.compare(tick)

    def set_encoder(self, tick, a, b):
        self.chip.set_encoder(tick, a, b)
        self.naive.set_encoder(tick, a, b)

    def set_index(self, tick, level):
        self.chip.set_index(tick, level)
        self.naive.set_index(tick, level)


class Session(Bench):
    """A bench for two."""

    def __init__(self, pair, tick):
        super().__init__(pair, tick)
        self.pair = pair

    def index(self, level):
        self.chip.set_index(self.tick, level)
        self.wait(60)

    def find_index(self, turns):
        """SIP, then the index while both phases are low."""
        self.command("SIP")
        self.turn(turns - self.place)
        self.index(0)
        self.turn(-turns)
        self.sample()
        self.index(1)

    def slow_write(self, ps, byte, ticks):
        """A strobe during which the chip may become free."""
        self.drive(ps=ps, data=byte, cs=0)
        self.drive(wr=0)
        self.wait(ticks)
        self.drive(wr=1)
        self.drive(cs=1)

    def glitches(self, levels):
        """Pins as they come; then the bus rests."""
        for cs, rd, wr, ps, data in levels:
            self.drive(cs=cs, rd=rd, wr=wr, ps=ps, data=data)
        self.drive(cs=1, rd=1, wr=1)

    def hurry(self, name, byte):
        """A command, and without a look at the busy bit a byte to each port."""
        self.command(name)
        self.write(1, byte)
        self.write(0, byte)

    def half_a_word(self, first, second, *data):
        """A command that comes between the two bytes of another one's word."""
        self.command(first)
        self.ready()
        self.write(1, data[0])
        self.command(second)
        for byte in data[1:]:
            self.ready()
            if second.startswith("RD"):
                self.read(1)
            else:
                self.write(1, byte)

    def excess(self, threshold):
        """An error that outlasts a reset of its flag."""
        self.command("LPEI", threshold)
        self.go(("load", 0x002A, 0x10000, 0x40000, self.pair.chip.real_position + 100), 12)
        for _ in range(2):
            self.command("RSTI", 0)
            self.sample(2)

    def index_over_reset(self):
        self.find_index(4)
        self.command("SIP")
        self.command("RESET")
        self.wait(30_000)

    def home_loaded(self, counts, position):
        """DFH while a target is loaded and not started."""
        self.sample()
        self.turn(counts)
        self.sample()
        self.load(0x0002, position)
        self.command("DFH")

    def ask_between_samples(self, counts):
        self.sample()
        self.turn(counts)
        self.ask("RDRP")

    def stress(self, error, kp, ki, il):
        """A large error in a closed loop, and what the integral term makes of it."""
        self.filter(kp=kp, ki=ki, il=il)
        self.start(0x0200, samples=2)
        self.pair.chip.trajectory.position += error * 65536
        self.pair.naive.desired += error
        self.sample(3)
        self.ask("RDSUM")

    def stops(self, error, word):
        """A stop out of motion and drive, and another STT after it."""
        self.stress(error, 100, 0, 0)
        self.go(("load", 0x002A, 0x10000, 0x40000, self.pair.chip.real_position + error), 3)
        self.go(("load", word), 12)
        self.command("STT")
        self.sample(2)

    def nudge(self, counts, samples):
        """A relative target in mid-motion."""
        self.start(0x0003, counts, samples=samples)

    def go(self, load, samples):
        self.start(*load[1:], samples=samples)

    def go_twice(self, first, second):
        """Load again between STT and the sample that executes it."""
        self.load(*first[1:])
        self.sample()
        self.command("STT")
        self.load(*second[1:])
        self.sample()
        self.command("STT")
        self.sample(2)

    def retune(self, kd, ds, samples):
        """New coefficients in the midst of a derivative interval."""
        for _ in range(2):
            self.filter(kp=1, kd=kd, ds=ds)
            self.sample(samples)

    def cross(self, border, counts):
        """Turn over the border of the position space."""
        self.jump(border)
        self.turn(counts)
        self.sample()

    def pass_breakpoint(self, away, counts):
        place = self.pair.chip.real_position + away
        self.command("SBPA", place >> 16 & 0xFFFF, place & 0xFFFF)
        self.sample()
        self.turn(counts)
        self.sample()

    def jump(self, position):
        """Put the axis elsewhere, behind the chips' backs."""
        pair = self.pair
        pair.chip.real_position = position
        pair.chip.trajectory.position = position * 65536
        pair.naive.real = position
        pair.naive.desired = Fraction(position)

    def wind_up(self, error_sum):
        self.pair.chip.pid.error_sum = error_sum
        self.pair.naive.pid.sum = error_sum

    def pulse(self, ticks):
        self.chip.set_reset(self.tick, 0)
        self.wait(ticks)
        self.chip.set_reset(self.tick, 1)
        self.wait(30000)


@pytest.mark.slow
@examples(250)
@given(OPTIONS, st.integers(0, 5000), st.lists(ACTIONS, max_size=40))
@example(
    Lm629Options(reset_clears_index=False),
    0,
    [("command", "SIP"), ("turn", 4), ("index", 0), ("turn", 2), ("command", "RESET")],
)
@example(
    DEFAULT_OPTIONS,
    0,
    [
        ("command", "LPES", 0),
        ("go", ("load", 0x2A, 2048, 0, 0), 1),
        ("turn", 1),
        ("go", ("load", 0x2A, 2048, 0, 0), 1),
    ],
)  # the motor is switched off by its position error, which is noted
def test_random_sessions_agree_with_the_slow_twin_bit_for_bit(options, start, actions):
    pair = Pair(options)
    session = Session(pair, start)
    session.chip.set_encoder(start, 0, 0)
    session.pulse(32)
    for name, *arguments in actions:
        if name not in POLITE.split() or pair.chip.mode == 2:
            getattr(session, name)(*arguments)
    pair.compare(session.tick)
