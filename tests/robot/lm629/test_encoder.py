"""The encoder inputs: filter, counting and index capture, against a sampler that looks at every clock."""

from hypothesis import given
from hypothesis import strategies as st

from miro_robot.lm629.encoder import Encoder
from tests.example_count import examples
from tests.naive.lm629_encoder import FORWARD, NaiveEncoder
from tests.robot.lm629.bench import Bench

EVENT = st.tuples(
    st.sampled_from(["forward", "back", "a", "b", "index", "take", "arm"]),
    st.integers(0, 6) | st.sampled_from([24, 28, 29, 31, 32, 33, 36, 200]),
)


@examples(400)
@given(
    filter_clocks=st.sampled_from([8, 8, 8, 3, 1, 0]),
    start=st.integers(0, 40),
    place=st.integers(0, 3),
    events=st.lists(EVENT, max_size=60),
)
def test_any_edges_count_like_a_sampler_that_looks_at_every_clock(filter_clocks, start, place, events):
    ours, theirs = Encoder(filter_clocks), NaiveEncoder(filter_clocks)
    tick, index = start, 1
    a, b = FORWARD[place]
    for encoder in (ours, theirs):
        encoder.set_phases(tick, a, b)
    for what, pause in events:
        tick += pause
        if what == "take":
            ours.settle(tick)
            caught = ours.caught_counts if ours.caught else None
            assert (ours.counts, caught) == theirs.take(tick)
            ours.counts = ours.caught = 0
            continue
        if what == "arm":
            ours.arm(tick)
            theirs.arm(tick)
            continue
        if what == "index":
            index ^= 1
            ours.set_index(tick, index)
            theirs.set_index(tick, index)
            continue
        place = FORWARD.index((a, b))
        moves = {
            "forward": FORWARD[(place + 1) % 4],
            "back": FORWARD[place - 1],
            "a": (1 - a, b),
            "b": (a, 1 - b),
        }
        a, b = moves[what]
        ours.set_phases(tick, a, b)
        theirs.set_phases(tick, a, b)
    ours.settle(tick + 400)
    caught = ours.caught_counts if ours.caught else None
    assert (ours.counts, caught) == theirs.take(tick + 400)


def test_a_leading_b_counts_up_and_4_counts_are_a_line():
    bench = Bench.running()
    bench.turn(0)
    bench.chip.set_encoder(bench.tick, 0, 0)
    bench.turn(40)
    bench.sample()
    assert bench.ask("RDRP") == 40
    assert bench.ask("RDRV") == 40
    bench.turn(-48)
    bench.sample()
    assert bench.ask("RDRP") == -8
    assert bench.ask("RDRV") == -48


def test_two_index_captures_a_turn_apart_differ_by_the_counts_of_a_turn():
    bench = Bench.running()
    bench.chip.set_encoder(bench.tick, 0, 0)
    captured = []
    for _ in range(2):
        bench.command("SIP")
        assert bench.signals() & 1 == 1
        bench.turn(13 * 4)
        assert bench.status() & 0x08 == 0
        bench.chip.set_index(bench.tick, 0)
        bench.wait(64)
        bench.chip.set_index(bench.tick, 1)
        bench.turn(7 * 4)
        bench.sample()
        assert bench.status() & 0x08
        assert bench.signals() & 1 == 0
        captured.append(bench.ask("RDIP"))
        bench.command("RSTI", 0x0077)
        bench.sample()
        assert bench.status() & 0x08 == 0
    assert captured == [52, 80 + 52]
    assert bench.ask("RDRP") == 160
