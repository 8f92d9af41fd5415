"""When an HC-SR04 answers, and for how long."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.parts.hc_sr04 import HcSr04
from tests.naive.parts import echo_levels
from tests.robot.parts.bench import Bench

US = 12


def bench(crystal_hz=12_000_000, seed=0, **keys):
    board = Bench({"eyes": (HcSr04(**keys), {"trig": "trig", "echo": "echo"})}, ["trig"], crystal_hz, seed)
    board.drive("trig", 0)
    board.run(1)
    return board


def ping(board, tick, us=10.0):
    """Asks, waits for 60 ms, and gives the pulses of the answer: (begin after trig falls, length), in us."""
    fall = tick + int(us * US)
    board.drive("trig", 1, tick)
    board.drive("trig", 0, fall)
    seen = len(board.edges_of("echo"))
    board.run(fall + 60_000 * US)
    edges = [edge_tick for edge_tick, _ in board.edges_of("echo")[seen:]]
    return [
        ((rise - fall) / US, (end - rise) / US) for rise, end in zip(edges[::2], edges[1::2], strict=True)
    ]


def test_its_echo_is_58_us_a_cm_long():
    board = bench()
    board.put("eyes.distance_cm", 60.0)
    assert ping(board, 1000) == [(450.0, 3480.0)]
    assert (board.read("eyes.pings"), board.read("eyes.distance_cm")) == (1, 60.0)


def test_an_echo_is_rounded_to_the_next_tick():
    board = bench(11_059_200)
    board.put("eyes.distance_cm", 25.0)
    board.drive("trig", 1, 1000)
    board.drive("trig", 0, 2000)
    board.run(10**6)
    (rise, _), (end, _) = board.edges_of("echo")[-2:]
    assert end - rise == 16_036  # 1450 us are 16035.84 ticks
    assert rise - 2000 == 4977  # 450 us are 4976.64


def test_a_pulse_of_less_than_10_us_asks_nothing():
    board = bench()
    assert ping(board, 1000, us=9.9) == []
    assert board.read("eyes.pings") == 0


def test_it_ignores_what_it_is_asked_while_it_measures():
    board = bench()
    board.put("eyes.distance_cm", 100.0)
    board.drive("trig", 1, 1000)
    for fall_us in (10, 200, 3000, 6000):
        board.drive("trig", 0, 1000 + fall_us * US)
        board.drive("trig", 1, 1000 + (fall_us + 20) * US)
    board.run(1000 + 100_000 * US)
    assert board.read("eyes.pings") == 1
    # A trig that rose during a measurement asks nothing when it falls after it.
    board.drive("trig", 0)
    board.run(board.tick + 1000 * US)
    assert board.read("eyes.pings") == 1


@pytest.mark.parametrize(("no_echo", "answer"), [("38ms", [(450.0, 38_000.0)]), ("low", [])])
def test_without_an_echo_it_answers_as_its_make_does(no_echo, answer):
    board = bench(no_echo=no_echo)
    board.put("eyes.echo", "none")
    assert ping(board, 1000) == answer
    board.put("eyes.echo", "normal")
    assert ping(board, board.tick + 1) == [(450.0, 5800.0)]


@pytest.mark.parametrize(("echo", "level"), [("low", 0), ("high", 1)])
def test_an_output_that_is_stuck_stays_at_its_level_and_is_mended(echo, level):
    board = bench()
    board.put("eyes.echo", echo, 500)
    seen = len(board.edges_of("echo"))
    assert ping(board, 1000) == []
    assert (board.level("echo"), board.read("eyes.echo")) == (level, echo)
    assert len(board.edges_of("echo")) == seen
    board.put("eyes.echo", "normal")
    assert board.level("echo") == 0
    assert ping(board, board.tick + 1) == [(450.0, 5800.0)]


def test_noise_is_off_by_default_and_by_the_seed():
    def answers(seed, noise_cm):
        board = bench(seed=seed, noise_cm=noise_cm)
        return [ping(board, board.tick + 1) for _ in range(3)]

    assert answers(1, 0.0) == answers(2, 0.0) == [[(450.0, 5800.0)]] * 3
    assert answers(1, 1.0) == answers(1, 1.0) != answers(2, 1.0)
    lengths = [length for ((_, length),) in answers(1, 1.0)]
    assert len(set(lengths)) == 3
    assert all(abs(length - 5800.0) < 58.0 * 6 for length in lengths)


def test_a_trig_that_is_high_from_power_on_asks_when_it_first_falls():
    board = Bench({"eyes": (HcSr04(), {"trig": "trig", "echo": "echo"})}, ["trig"])
    board.drive("trig", 0, 1000)
    board.run(100_000)
    assert board.read("eyes.pings") == 1


def test_the_obstacle_stays_while_the_supply_is_off():
    board = bench()
    board.put("eyes.distance_cm", 60.0)
    board.drive("trig", 1, 1000)
    board.drive("trig", 0, 2000)
    board.run(10_000)
    assert board.level("echo") == 1
    board.power(0)
    board.power(1)
    assert board.level("echo") == 0
    assert board.read("eyes.pings") == 0
    assert ping(board, board.tick + 1) == [(450.0, 3480.0)]


@given(
    gaps=st.lists(st.sampled_from([1, 9, 10, 11, 100, 450, 460, 1000, 2000]), min_size=1, max_size=12),
    distance=st.floats(2.0, 30.0),
    none=st.sampled_from(["normal", "none"]),
    cuts=st.lists(st.integers(0, 3000), max_size=4),
)
def test_it_is_its_slow_twin_however_a_run_is_cut_and_saved(gaps, distance, none, cuts):
    def fresh():
        board = Bench(
            {"eyes": (HcSr04(no_echo="low"), {"trig": "trig", "echo": "echo"})}, ["trig"], 1_000_000
        )
        board.drive("trig", 0)
        board.put("eyes.distance_cm", distance)
        board.put("eyes.echo", none)
        return board

    board = fresh()
    trig = [0] * 20
    for number, gap in enumerate(gaps):
        board.drive("trig", 1 - number % 2, len(trig))
        for cut in sorted(cuts):
            board.run(min(len(trig) + cut, len(trig) + gap))
            board.read("eyes.pings")
            other = fresh()
            other.load(board.save())
            other.tick = board.tick
            other.edges_of("echo")[:] = board.edges_of("echo")
            board = other
        board.run(len(trig) + gap)
        trig += [1 - number % 2] * gap
    trig += trig[-1:] * 4000
    board.run(len(trig))
    edges = [edge for edge in board.edges_of("echo") if edge[0] > 0]
    wanted = echo_levels(trig, 1.0, lambda ping: 58.0 * distance if none == "normal" else 0)
    assert edges == [
        (tick, wanted[tick]) for tick in range(1, len(wanted)) if wanted[tick] != wanted[tick - 1]
    ]
