"""What each disturbance does to the wire, one at a time, and that they do not touch each other's draws."""

import math
from itertools import pairwise

import pytest

from miro_robot.mcs51.line import Line
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import Bursts, Dropouts
from tests.naive import radio as naive
from tests.sim.radio.radios import ALWAYS, clean

DATA = bytes(i * 73 & 255 for i in range(25))
PERIOD = 700_000  # of frames that take 625 000 ticks


def band(radio, seed):
    downlink, line = Downlink(radio, seed, "net"), Line()
    downlink.listen(0, line)
    return downlink, line


def heard(radio, seed=0, frames=1):
    """Start ticks, and the levels that the robot has in the middle of each nominal bit, frame by frame."""
    downlink, line = band(radio, seed)
    starts = [radio.keyup_ticks + number * PERIOD for number in range(frames)]
    levels = []
    for start in starts:
        downlink.send(start, DATA)
        downlink.settle(start + PERIOD - radio.keyup_ticks)
        levels.append([line.level_at(start + 2500 * i + 1250) for i in range(len(BITS))])
        line.forget(downlink.settled_tick - 1)
    return levels


BITS = naive.wire_bits(DATA)


def wrong(levels):
    return [number for number, (level, bit) in enumerate(zip(levels, BITS, strict=True)) if level != bit]


@pytest.mark.parametrize(("eb_n0_db", "rate"), [(8.93, 1e-2), (10.94, 1e-3), (12.31, 1e-4)])
def test_the_errors_at_a_signal_to_noise_ratio_are_as_many_as_the_formula_says(eb_n0_db, rate):
    """250 000 bits each, within four standard deviations of a binomial."""
    radio = clean(eb_n0_db=eb_n0_db, carrier="on")
    count = sum(len(wrong(levels)) for levels in heard(radio, 11, 1000))
    expected = 0.5 * math.exp(-(10 ** (eb_n0_db / 10)) / 2)
    assert abs(count - 250_000 * expected) < 4 * (250_000 * expected) ** 0.5
    assert radio.error_threshold / 2**32 == pytest.approx(rate, rel=0.02)


def arrivals(radio, seed=1, frames=200, period=800_800):
    """How late each frame of one 55h is, by its start bit; squelched, so that nothing else falls."""
    downlink, line = band(radio, seed)
    late = []
    for number in range(frames):
        start = 50_000 + number * period
        downlink.send(start, b"\x55")
        downlink.settle(start + period - 40_000)
        late.append(line.next_edge(start - 1) - start)
        line.forget(downlink.settled_tick - 1)
    return late


def test_jitter_spreads_evenly_over_latency_and_what_is_on_top():
    late = arrivals(clean(latency_ticks=1000, jitter_ticks=24_000, squelch=True))
    assert all(1000 <= tick <= 25_000 for tick in late)
    assert min(late) < 2500 < 23_500 < max(late)
    assert sum(late) / len(late) == pytest.approx(13_000, abs=4 * 24_000 / (12 * len(late)) ** 0.5)


def test_a_late_transmission_holds_up_the_next_one_but_never_overlaps_it():
    downlink, line = band(clean(jitter_ticks=100_000, squelch=True, keyup_ticks=0), 2)
    for number in range(40):
        downlink.send(number * 25_000, b"\x55")
    downlink.settle(3_000_000)
    symbols = naive.receive(line.edges(), 3_000_000)
    assert [(byte, good) for byte, good, _ in symbols] == [(0x55, True)] * 40
    assert all(after - before >= 25_000 for (*_, before), (*_, after) in pairwise(symbols))


@pytest.mark.parametrize(
    ("baud", "crystal", "last_edge"),
    [
        (0, 0, 22_500),
        (10_000, 0, 22_277),
        (-10_000, 0, 22_727),
        (0, 10_000, 22_725),
        (10_000, 10_000, 22_500),
    ],
)
def test_a_fast_pc_makes_short_bits_and_a_fast_robot_finds_them_long(baud, crystal, last_edge):
    """22 500 ticks to the stop bit, divided by 1 + baud, times 1 + crystal, rounded down once."""
    radio = clean(baud_offset_ppm=baud, crystal_offset_ppm=crystal, squelch=True, keyup_ticks=0)
    downlink, line = band(radio, 0)
    downlink.send(100_000, b"\x00")
    downlink.settle(200_000)
    assert line.edges() == [(100_000, 0), (100_000 + last_edge, 1)]


def test_fractions_of_a_tick_do_not_add_up():
    """At 9600 baud + 3 ppm a bit is 2499.9925.. ticks; bit 9990 of a long transmission is one rounding off."""
    downlink, line = band(clean(baud_offset_ppm=3, squelch=True, keyup_ticks=0), 0)
    downlink.send(0, b"\xff" * 1000)
    downlink.settle(30_000_000)
    assert line.edges()[-2][0] == 9990 * 2500 * 1_000_000 // 1_000_003


def test_a_dropped_carrier_is_noise_or_mark_and_comes_back():
    assert heard(clean(dropouts=ALWAYS, squelch=True)) == [[1] * 250]
    noise = heard(clean(dropouts=ALWAYS), frames=20)
    assert sum(map(sum, noise)) == pytest.approx(2500, abs=4 * 35)
    now_and_then = Dropouts(every_s=0.05, length_s=0.01)
    damaged = [len(wrong(levels)) for levels in heard(clean(dropouts=now_and_then, squelch=True), 3, 40)]
    assert 0 in damaged
    assert max(damaged) > 20


def test_errors_come_in_bursts_and_are_few_in_between():
    radio = clean(bursts=Bursts(good_to_bad=2e-3, bad_to_good=1e-2), carrier="on")
    places = [
        250 * frame + place for frame, levels in enumerate(heard(radio, 4, 80)) for place in wrong(levels)
    ]
    share = 2e-3 / 1.2e-2
    assert len(places) / 20_000 == pytest.approx(share / 2, abs=4 * (2 * share / 1e-2 / 20_000) ** 0.5)
    near = sum(after - before < 10 for before, after in pairwise(places))
    assert near > 0.9 * len(places)  # independent ones would be so near in 56 % of the cases


def test_an_idle_carrier_has_as_many_false_starts_as_asked_for():
    downlink, line = band(clean(false_starts_hz=50.0, carrier="on"), 6)
    spaces = 0
    for second in range(1, 21):
        downlink.settle(second * 24_000_000)
        edges = [tick for tick, level in line.edges() if level == 0]
        assert all(tick % 2500 == 0 for tick in edges)
        spaces += len(edges)
        line.forget(second * 24_000_000 - 1)
    assert abs(spaces - 1000) < 4 * 32


def test_a_lost_character_is_mark_all_along_and_its_neighbours_are_whole():
    radio = clean(lost_character_rate=0.1, squelch=True)
    lost = 0
    for levels in heard(radio, 7, 40):
        for character in range(25):
            bits = levels[10 * character : 10 * character + 10]
            whole = naive.wire_bits(DATA[character : character + 1])
            lost += bits != whole
            assert bits in (whole, [1] * 10)
    assert abs(lost - 100) < 4 * 9.5


def collided(others_start, mine=b"\x0f" * 20, other=b"\xf0" * 20):
    one, two = (Downlink(clean(squelch=True), 8, name) for name in ("one", "two"))
    lines = Line(), Line()
    for link, line in zip((one, two), lines, strict=True):
        link.listen(0, line)
    one.overhear(two)
    two.overhear(one)
    one.send(100_000, mine)
    two.send(others_start, other)
    one.settle(3_000_000)
    two.settle(3_000_000)
    return [naive.receive(line.edges(), 3_000_000) for line in lines]


def test_two_transmitters_one_after_the_other_are_both_heard_by_both_networks():
    for symbols in collided(1_000_000):
        assert bytes(byte for byte, _, _ in symbols) == b"\x0f" * 20 + b"\xf0" * 20
        assert all(good for _, good, _ in symbols)


def test_two_transmitters_at_once_spoil_each_other_wherever_they_differ():
    mine, its = collided(100_000)
    assert [byte for byte, _, _ in mine] != [0x0F] * 20
    assert [byte for byte, _, _ in its] != [0xF0] * 20


def test_two_transmitters_that_say_the_same_do_not_disturb_each_other():
    for symbols in collided(100_000, b"same", b"same"):
        assert [(byte, good) for byte, good, _ in symbols] == [(byte, True) for byte in b"same"]


def test_where_two_differ_the_level_is_a_fair_coin():
    radio = clean(squelch=True, keyup_ticks=0)
    (one, line), two = band(radio, 9), Downlink(radio, 9, "two")
    one.overhear(two)
    one.send(0, b"\xff" * 300)
    two.send(0, b"\x00" * 300)
    one.settle(7_500_000)
    coins = [line.level_at(i * 2500 + 1250) for i in range(3000) if 0 < i % 10 < 9]
    assert abs(sum(coins) - 1200) < 4 * 24.5


def test_a_neighbour_must_be_announced_before_its_carrier_comes_up_here():
    one, two = Downlink(clean(), 0, "one"), Downlink(clean(), 0, "two")
    one.overhear(two)
    one.settle(500_000)
    with pytest.raises(ValueError, match=r"two: the carrier for tick 510000 .* settled up to 500000"):
        two.send(510_000, b"x")


def test_lost_frames_are_as_many_as_asked_for_and_the_others_are_whole():
    quiet = [1] * len(BITS)
    levels = heard(clean(lost_frames=0.3, squelch=True), 3, 1000)
    assert all(frame in (BITS, quiet) for frame in levels)
    assert abs(levels.count(quiet) / 1000 - 0.3) < 4 * (0.3 * 0.7 / 1000) ** 0.5
    assert heard(clean(lost_frames=1.0, squelch=True), 3, 5) == [quiet] * 5


@pytest.mark.parametrize(
    "extra",
    [
        {"bursts": Bursts(good_to_bad=0.0, bad_to_good=1e-3)},
        {"dropouts": Dropouts(every_s=1e6, length_s=0.1)},
        {"false_starts_hz": 1e-6},
        {"lost_character_rate": 2**-32},
        {"lost_frames": 2**-32},
    ],
    ids=lambda extra: next(iter(extra)),
)
def test_a_disturbance_that_does_not_strike_leaves_all_other_draws_as_they_are(extra):
    plain = {"bit_error_rate": 0.02, "carrier": "on", "keyup_ticks": 24_000}
    assert heard(clean(**plain, **extra), 10, 20) == heard(clean(**plain), 10, 20)
