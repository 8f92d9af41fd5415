"""The edges of an encoder on a motor's shaft."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import NEVER_TICK
from miro_exact.plugins import PluginError
from miro_sim.plant.dc_motor import DcMotor
from miro_sim.plant.encoder import Encoder
from tests.robot.parts.bench import Bench
from tests.sim.plant.motor_bench import HZ, bench, drive, put_mode

MS = HZ // 1000
FORWARD = [(0, 0), (1, 0), (1, 1), (0, 1)]
NAMES = list(itertools.permutations(["a_one", "b_one", "c_one"]))
QUICK = DcMotor(inertia_kg_m2=1e-6, friction_nm=0.01)


def outputs(board):
    return board.level("a"), board.level("b")


def test_forward_a_leads_and_backward_b():
    for mode, sequence in (("forward", FORWARD), ("backward", FORWARD[::-1])):
        board = bench()
        seen = [outputs(board)]
        put_mode(board, mode)
        while len(seen) < 9:
            board.run(board.tick + 100)
            if outputs(board) != seen[-1]:
                seen.append(outputs(board))
        begin = sequence.index((0, 0))
        assert seen == [sequence[(begin + step) % 4] for step in range(9)]


def test_it_has_so_many_lines_a_turn():
    board = bench(encoder=Encoder(lines=20))
    drive(board, [("forward", 1000 * MS)])
    turns = board.read("motor.turns")
    rises = [tick for tick, level in board.edges_of("a") if level and tick > 1]
    assert len(rises) == pytest.approx(20 * turns, abs=1)
    assert board.read("wheel.counts") == pytest.approx(80 * turns, abs=1)


def test_where_the_motor_stands_it_has_no_events():
    board = bench()
    assert board.named["wheel"].next_tick == NEVER_TICK
    drive(board, [("forward", 100 * MS), ("brake", 1000 * MS)])
    assert board.named["wheel"].next_tick == NEVER_TICK


MODES = st.sampled_from(["forward", "backward", "brake", "coast"])


@settings(max_examples=40)
@given(st.lists(st.tuples(MODES, st.integers(1, 150)), min_size=1, max_size=6), st.sampled_from(NAMES))
def test_each_edge_is_on_the_first_tick_at_which_the_shaft_is_beyond_it(stretches, names):
    """At 100 kHz, each tick looked at, whichever part comes first in the order of names."""
    board = bench(QUICK, Encoder(lines=50), names, 100_000)
    _, motor, wheel = names
    counts = []
    for mode, ticks in stretches:
        put_mode(board, mode)
        for _ in range(ticks):
            tick = board.tick
            board.run(tick + 1)
            position = board.named[motor].turns_at(tick) * 200 + 0.5
            assert board.read(f"{wheel}.counts") == position // 1
            counts.append(position // 1)
            assert outputs(board) == FORWARD[int(counts[-1]) % 4]


@settings(max_examples=30)
@given(
    st.lists(st.tuples(MODES, st.integers(1, 30_000)), min_size=1, max_size=10),
    st.lists(st.integers(1, 30_000), max_size=3),
)
def test_edges_are_the_same_for_any_names_any_looks_and_after_loading(stretches, cuts):
    edges = []
    for names in NAMES:
        board = bench(QUICK, Encoder(lines=50), names, 1_000_000)
        for mode, ticks in stretches:
            begin = board.tick
            put_mode(board, mode)
            for cut in sorted(cuts):
                board.run(begin + min(cut, ticks))
                board.read(f"{names[1]}.turns")
                other = bench(QUICK, Encoder(lines=50), names, 1_000_000)
                other.load(board.save())
                other.tick = board.tick
                for net in ("a", "b"):
                    other.edges_of(net)[:] = board.edges_of(net)
                board = other
            board.run(begin + ticks)
        edges.append((board.edges_of("a"), board.edges_of("b")))
        cuts = []
    assert edges == edges[:1] * len(edges)


@pytest.mark.parametrize("hz", [92, 20_000])
def test_under_pwm_its_counts_are_those_of_the_shaft(hz):
    board = bench(encoder=Encoder(lines=500))
    period = HZ // hz
    drive(board, [("forward", period // 2), ("coast", period - period // 2)] * (hz // 5))
    assert board.read("motor.rpm") > 20
    assert abs(board.read("wheel.counts") - 2000 * board.read("motor.turns")) <= 1


@pytest.mark.parametrize(("broken", "level"), [("low", 0), ("high", 1)])
def test_a_broken_channel_is_stuck_until_it_is_mended(broken, level):
    board = bench()
    board.put("wheel.a.broken", broken)
    before = len(board.edges_of("a"))
    drive(board, [("forward", 500 * MS)])
    assert (board.level("a"), len(board.edges_of("a")), board.read("wheel.a.broken")) == (
        level,
        before,
        broken,
    )
    assert len(board.edges_of("b")) > 10
    board.put("wheel.a.broken", "none")
    drive(board, [("forward", 500 * MS)])
    assert len(board.edges_of("a")) > 10


def test_without_supply_it_lets_go_and_afterwards_it_shows_where_the_shaft_is():
    board = bench()
    drive(board, [("forward", 500 * MS)])
    board.power(0)
    assert board.driven("a") is board.driven("b") is None
    counts = board.read("wheel.counts")
    board.run(board.tick + 1000 * MS)
    assert board.read("wheel.counts") == counts
    board.power(1)
    assert board.read("wheel.counts") == (board.read("motor.turns") * 80 + 0.5) // 1 > counts


def test_an_encoder_without_a_motor_says_what_to_wire():
    with pytest.raises(PluginError, match="no motor at pin shaft"):
        Bench({"wheel": (Encoder(), {"shaft": "x", "a": "a"})})
