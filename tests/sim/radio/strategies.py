"""What the radio's tests draw: parameters, transmissions that do not overlap, and ways to cut time into
pieces."""

from hypothesis import strategies as st
from miro_sim.radio import RadioParams

params = st.builds(
    RadioParams,
    latency_ticks=st.sampled_from([0, 1, 2499, 2500, 7777]),
    error_threshold=st.sampled_from([0, 2**32 // 100, 2**32 // 4, 2**31, 2**32]),
    carrier=st.sampled_from(["keyed", "on"]),
    keyup_ticks=st.sampled_from([0, 1, 2500, 24_000]),
    squelch=st.booleans(),
)
seeds = st.integers(0, 2**63 - 1)


@st.composite
def transmissions(draw, most=4):
    """(start tick, bytes) in order, with gaps from none to ten characters."""
    start = 0
    sent = []
    for _ in range(draw(st.integers(0, most))):
        start += draw(st.one_of(st.just(0), st.integers(0, 250_000)))
        data = draw(st.binary(min_size=1, max_size=4))
        sent.append((start, data))
        start += 25_000 * len(data)
    return sent


def cuts(until):
    """Ticks in ascending order that end with `until`; some on the edges of the slots."""
    ticks = st.one_of(st.integers(0, until), st.integers(0, until // 2500).map(lambda slot: slot * 2500))
    return st.lists(ticks, max_size=12).map(lambda ticks: [*sorted(ticks), until])
