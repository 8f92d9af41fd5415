"""Random sessions at the pins: the chip and its slow twin agree after every step."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from miro_robot.lm629.commands import COMMANDS
from miro_robot.lm629.options import Lm629Options

from tests.robot.lm629.bench import Bench
from tests.robot.lm629.pair import Pair

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
FLAGS = st.sampled_from([0, 0x7E, 0x3E, 0xFFFF]) | st.integers(0, 0xFFFF)


@st.composite
def trajectories(draw: st.DrawFn) -> tuple[object, ...]:
    control = draw(CONTROLS)
    values = []
    for bit, choice in ((0x20, ACCELERATIONS), (0x08, VELOCITIES), (0x02, POSITIONS)):
        if control & bit:
            values.append(draw(choice))
    return ("load", control, *values)


ACTIONS = st.one_of(
    trajectories(),
    trajectories(),
    st.just(("command", "STT")),
    st.just(("command", "STT")),
    st.tuples(st.just("command"), st.sampled_from(NO_WORDS)),
    st.tuples(st.just("ask"), st.sampled_from([c.name for c in COMMANDS if c.words_out])),
    st.tuples(st.just("filter"), COEFFICIENTS, COEFFICIENTS, COEFFICIENTS, COEFFICIENTS, st.integers(0, 4)),
    st.tuples(st.just("command"), st.sampled_from(["LPES", "LPEI"]), st.integers(0, 40) | FLAGS),
    st.tuples(st.just("command"), st.sampled_from(["MSKI", "RSTI"]), FLAGS),
    st.tuples(st.just("command"), st.just("RESET")),
    st.builds(
        lambda name, place: ("command", name, place >> 16 & 0xFFFF, place & 0xFFFF),
        st.sampled_from(["SBPA", "SBPR"]),
        POSITIONS,
    ),
    st.tuples(st.just("write"), st.integers(0, 1), st.integers(0, 0x22) | st.integers(0, 255)),
    st.tuples(st.just("read"), st.integers(0, 1)),
    st.tuples(st.just("wait"), st.integers(1, 3000)),
    st.tuples(st.just("sample"), st.integers(1, 12)),
    st.tuples(st.just("sample"), st.integers(1, 12)),
    st.tuples(st.just("turn"), st.integers(-70, 70)),
    st.tuples(st.just("index"), st.integers(0, 1)),
    st.tuples(st.just("pulse"), st.sampled_from([28, 32, 50])),
)
OPTIONS = st.builds(
    Lm629Options,
    busy_clocks=st.sampled_from([160, 160, 0, 33]),
    reset_clocks=st.sampled_from([6144, 50]),
    filter_clocks=st.sampled_from([8, 8, 1, 0]),
    pid_saturates=st.booleans(),
    sum_reading=st.sampled_from(["term", "sum"]),
    relative_base=st.sampled_from(["target", "desired", "real"]),
)


class Session(Bench):
    """A bench that remembers where the wheel stands."""

    place = 0

    def turn(self, counts: int) -> None:
        for _ in range(abs(counts)):
            self.place += 1 if counts > 0 else -1
            a, b = ((0, 0), (1, 0), (1, 1), (0, 1))[self.place % 4]
            self.chip.set_encoder(self.tick, a, b)
            self.wait(30)

    def index(self, level: int) -> None:
        self.chip.set_index(self.tick, level)
        self.wait(60)

    def pulse(self, ticks: int) -> None:
        self.chip.set_reset(self.tick, 0)
        self.wait(ticks)
        self.chip.set_reset(self.tick, 1)
        self.wait(30000)


@settings(deadline=None, max_examples=120)
@given(OPTIONS, st.integers(0, 5000), st.lists(ACTIONS, max_size=40))
def test_random_sessions_agree_with_the_slow_twin_bit_for_bit(
    options: Lm629Options, start: int, actions: list[tuple[object, ...]]
):
    pair = Pair(options)
    session = Session(pair, start)  # type: ignore[arg-type]
    session.chip.set_encoder(start, 0, 0)
    session.pulse(32)
    for name, *arguments in actions:
        if name in ("load", "filter", "command", "ask", "sample") and pair.chip.mode != 2:
            continue  # these would wait for ever for a chip that is in reset
        getattr(session, str(name))(*arguments)
    pair.compare(session.tick)
