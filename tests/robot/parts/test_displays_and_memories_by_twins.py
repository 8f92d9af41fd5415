"""Any activity on the wires of a display or an EEPROM: as their plain twins have it, whatever is saved in between."""

import hashlib
import random
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import engine
from miro_robot.parts.at24c import At24c
from miro_robot.parts.lcd1602 import _ROM, Lcd1602
from tests import children
from tests.example_count import examples
from tests.naive import at24c, lcd1602
from tests.robot.parts.wires import DATA, I2cBus, Wires

ROOT = Path(__file__).parents[3]
NETS = ["rs", "rw", "e", *DATA]


class Twins:
    """A part on its bench beside the plain one. Each step moves both and compares; `log` has what was seen."""

    def __init__(self):
        self.bench = self.make()
        self.log = hashlib.sha256()

    def cut(self):
        """Goes on with another bench that has loaded the state of this one."""
        state, tick = self.bench.save(), self.bench.tick
        self.bench = self.make()
        self.bench.load(state)
        self.bench.tick = tick
        assert self.bench.save() == state

    def note(self, *seen):
        self.log.update(repr((self.bench.tick, self.bench.save(), seen)).encode())


class Displays(Twins):
    """48 MHz: 37 us are 1776 ticks, 5.6 us 267, 230 ns 12, 500 ns 24, 40 ns 2 and 80 ns 4."""

    def __init__(self):
        super().__init__()
        self.plain = lcd1602.Lcd(1776, 72_960, 267, 4800, 12, 24, 2, 4)
        self.driven = dict.fromkeys(NETS, 1)
        self.plain.step(0, dict(self.driven))
        self.bench.later(100)

    def make(self):
        return Wires(Lcd1602(reset_ms=0.1), {net: net for net in NETS}, NETS, crystal_hz=48_000_000)

    def step(self, wait, **levels):
        bench, chip = self.bench, self.plain
        bench.later(wait)
        tick = bench.tick
        self.driven.update(levels)
        reads = self.driven["e"] and self.driven["rw"]
        bench.set(**{net: None if reads and net in DATA else level for net, level in self.driven.items()})
        touched = [net for net in NETS if [edge for edge in bench.edges_of(net)[-1:] if edge[0] == tick]]
        chip.step(tick, {net: bench.level(net) for net in NETS}, touched)
        if reads:
            assert [bench.driven(net) for net in DATA] == chip.output(tick)
        else:
            assert [bench.level(net) for net in DATA] == [self.driven[net] for net in DATA]
        assert (bench.value("lost"), bench.value("busy")) == (chip.lost, tick < chip.busy_until)
        assert bench.value("short_pulses") == chip.broken
        assert (bench.value("on"), bench.value("blink")) == (chip.shown, chip.shown and chip.blink)

    def compare(self):
        rows = [row.translate(dict(enumerate(_ROM))) for row in self.plain.rows()]
        assert self.bench.value("text").split("\n") == rows
        self.note(self.bench.value("text"), self.bench.value("cursor"))

    def byte(self, value, wait, **levels):
        """A byte or two halves, properly."""
        for half in (value, value << 4)[: 1 if self.plain.wide else 2]:
            self.step(20, **levels, **{net: half >> bit & 1 for bit, net in enumerate(DATA)})
            self.step(20, e=1)
            self.step(20, e=0)
        self.bench.later(wait)

    def pulse(self, select, data, high, hold, value, **levels):
        """Signals, E, other data: each so many ticks after the one before."""
        self.step(20, **{**dict.fromkeys(NETS, 0), **levels, "rs": 1 - levels["rs"]})
        self.step(20, rs=levels["rs"])
        self.step(select, e=1)
        self.step(high, **{net: value >> bit & 1 for bit, net in enumerate(DATA)})
        self.step(data, e=0)
        self.step(hold, d7=0)


class Memories(Twins):
    def __init__(self, size="02"):
        self.size = size
        super().__init__()
        self.plain = at24c.Eeprom(size, 2400)
        self.driven = {"scl": 1, "sda": 1, "wp": 0}
        self.step(60)

    def make(self):
        return I2cBus(At24c(size=self.size, write_ms=2400 / 12_000), half=0, pins=["wp"])

    def step(self, wait, power=None, **levels):
        bench, chip = self.bench, self.plain
        bench.later(wait)
        tick = bench.tick
        if power is not None and power != chip.powered:
            bench.power(power)
            chip.supply(tick, bool(power))
        self.driven.update(levels)  # the supply is the master's, too
        bench.set(**{net: None if level and net != "wp" else level for net, level in self.driven.items()})
        chip.wire(tick, bench.level("scl"), bench.level("sda"), self.driven["wp"])
        assert bench.level("sda") == (0 if chip.low else self.driven["sda"])
        assert (bench.value("busy"), bench.value("writes")) == (chip.busy(tick), chip.writes)

    def compare(self):
        assert self.bench.value("content") == self.plain.content()
        self.note(self.bench.level("sda"))

    def bits(self, *levels):
        for level in levels:
            self.step(15, sda=level)
            self.step(15, scl=1)
            self.step(15, scl=0)

    def start(self, *values):
        for wires in ({"sda": 1}, {"scl": 1}, {"sda": 0}, {"scl": 0}):
            self.step(15, **wires)
        self.send(*values)

    def send(self, *values):
        for value in values:
            self.bits(*(value >> bit & 1 for bit in range(7, -1, -1)), 1)

    def stop(self):
        for wires in ({"sda": 0}, {"scl": 1}, {"sda": 1}):
            self.step(15, **wires)

    def write(self, *values):
        self.start(*values)
        self.stop()


levels = st.integers(0, 1)
bytes_ = st.integers(0, 255)
WAITS = (0, 1, 1715, 1716, 1735, 1736, 2002, 2003, 72_899, 72_900, 80_000)
"""Around what ends 60 ticks later, at a fall of E, or 40 ticks later, at a rise."""
GAPS = (1, 2, 3, 4, 5, 11, 12, 13, 20, 24)
INSTRUCTIONS = (0, 1, 2, 4, 5, 6, 7, 8, 12, 15, 0x10, 0x14, 0x18, 0x1C, 0x20, 0x28, 0x30, 0x38, 0x40, 0x7F)
ADDRESSES = (0x80, 0xA7, 0xA8, 0xC0, 0xCF, 0xE7, 0xFF)
waits = st.sampled_from(WAITS)
gaps = st.sampled_from(GAPS)
selects = st.fixed_dictionaries({"rs": levels, "rw": levels})
lcd_steps = st.one_of(
    st.tuples(st.just("step"), gaps, st.dictionaries(st.sampled_from(NETS), levels, min_size=1)),
    st.tuples(st.just("pulse"), gaps, gaps, gaps, gaps, bytes_, selects),
    st.tuples(st.just("byte"), st.sampled_from(INSTRUCTIONS + ADDRESSES), waits, st.just({"rs": 0, "rw": 0})),
    st.tuples(st.just("byte"), bytes_, waits, st.just({"rs": 1, "rw": 0})),
    st.tuples(st.just("byte"), st.just(0), waits, st.fixed_dictionaries({"rs": levels, "rw": st.just(1)})),
    st.tuples(st.just("cut")),
)
memory_steps = st.one_of(
    st.tuples(
        st.just("step"), st.integers(1, 40), st.dictionaries(st.sampled_from(["scl", "sda", "wp"]), levels)
    ),
    st.tuples(st.just("step"), st.integers(1, 2000), st.fixed_dictionaries({"power": levels})),
    st.tuples(st.just("step"), st.sampled_from([1, 1979, 1980, 2400]), st.just({})),
    st.tuples(st.just("start"), st.sampled_from([0xA0, 0xA1, 0xA2, 0xA3, 0x50])),
    st.tuples(st.just("start"), st.just(0xA0), bytes_, bytes_),
    st.tuples(st.just("start"), st.just(0xA0), st.just(0), st.just(0xFE), bytes_, bytes_, bytes_),
    st.tuples(st.just("write"), st.just(0xA0), bytes_, bytes_, bytes_),
    st.tuples(st.just("send"), bytes_),
    st.tuples(st.just("bits"), *[st.just(1)] * 8, levels),
    st.tuples(st.just("stop")),
    st.tuples(st.just("cut")),
)


def play(twins, steps):
    for name, *arguments in steps:
        named = arguments.pop() if arguments and isinstance(arguments[-1], dict) else {}
        getattr(twins, name)(*arguments, **named)
        twins.compare()
    return twins.log.hexdigest()


@given(st.lists(lcd_steps, min_size=10, max_size=40))
@examples(60)
def test_a_display_does_what_its_plain_twin_does(steps):
    play(Displays(), steps)


@given(st.sampled_from(["02", "16", "64"]), st.lists(memory_steps, min_size=10, max_size=30))
@examples(60)
def test_an_eeprom_does_what_its_plain_twin_does(size, steps):
    play(Memories(size), steps)


def begun():
    """A display that has been initialized and shows two lines."""
    display = Displays()
    play(display, [("byte", value, 80_000, {"rs": 0, "rw": 0}) for value in (0x38, 0x0F, 0x01)])
    return display


@given(st.lists(lcd_steps, min_size=20, max_size=60))
@examples(60)
def test_a_display_that_was_initialized_does_so(steps):
    play(begun(), steps)


def test_a_busy_flag_that_falls_with_e_is_half_a_byte_that_was_read_clear():
    """Four wires; E falls a tick after the instruction before is over, on the very tick, and a tick before."""
    for late in (1, 0, -1):
        display = begun()
        play(display, [("byte", 0x20, 1776 - 61 + late, {"rs": 0, "rw": 0})])
        display.step(20, rw=1)
        display.step(20, e=1)
        display.step(21, e=0)
        play(display, [("byte", 0x35, 2000, {"rs": 1, "rw": 0})])


def drawn(seed):
    """Steps of both kinds that depend on nothing but a number."""
    dice = random.Random(seed)
    for _ in range(60):
        value, wait, rs = dice.randrange(256), dice.choice([5, 2000, 80_000]), dice.randrange(2)
        yield "byte", value, wait, {"rs": rs, "rw": int(dice.random() < 0.3)}


def digest(seed):
    dice = random.Random(seed)
    memories = Memories("16")
    for _ in range(6):
        memories.write(0xA0, *(dice.randrange(256) for _ in range(dice.randrange(6))))
        memories.start(0xA1)
        memories.bits(*[1] * 17)
        memories.stop()
        memories.step(dice.randrange(1, 1500))
        memories.compare()
    return play(begun(), drawn(seed)) + memories.log.hexdigest()


@pytest.mark.parametrize("seed", [1, 2])
def test_compiled_and_uncompiled_parts_do_the_same(seed):
    if engine.active() != "compiled":
        pytest.skip("nothing is compiled here")
    command = [sys.executable, "-c", f"{SELECT}; print(engine.active(), digest({seed}))"]
    done = children.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.split() == ["python", digest(seed)]


SELECT = "from miro_exact import engine; engine.select('python'); "
SELECT += f"from {__name__} import digest"
