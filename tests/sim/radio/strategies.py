"""What the radio's tests draw: parameters, transmissions that do not overlap, and ways to cut time into
pieces."""

from hypothesis import strategies as st

from miro_sim.radio import ChainParams, RadioParams, SlicerParams

rates = st.sampled_from([0, 2**32 // 100, 2**32 // 4, 2**31, 2**32])
offsets = st.sampled_from([0, 0, 1, -1, 173, -10_000, 50_000, -50_000])


@st.composite
def chains(draw):
    """Chains of short and long runs, also those that never change and those that always do."""
    enter = draw(st.sampled_from([0, 1, 2**32 // 300, 2**32 // 7, 2**31, 2**32]))
    leave = draw(st.sampled_from([0, 1, 2**32 // 50, 2**32 // 3, 2**31, 2**32]))
    return ChainParams(enter=enter, leave=min(leave, 2**32 - enter))


slicers = st.builds(
    SlicerParams.of,
    settle_s=st.sampled_from([0.000105, 0.004, 0.3]),
    offset=st.sampled_from([-1.0, -0.5, 0.0, 0.3, 1.0]),
    eb_n0_db=st.sampled_from([-20.0, 0.0, 9.0, 13.35, 60.0]),
)
params = st.builds(
    RadioParams,
    latency_ticks=st.sampled_from([0, 1, 2499, 2500, 7777]),
    jitter_ticks=st.sampled_from([0, 0, 1, 2500, 60_000]),
    error_threshold=rates,
    carrier=st.sampled_from(["keyed", "on"]),
    keyup_ticks=st.sampled_from([0, 1, 2500, 24_000]),
    squelch=st.booleans(),
    baud_offset_ppm=offsets,
    crystal_offset_ppm=offsets,
    bursts=st.none() | chains(),
    burst_threshold=rates,
    dropouts=st.none() | chains(),
    slicer=st.none() | slicers,
    false_start_threshold=rates,
    lost_threshold=st.sampled_from([0, 0, 2**32 // 5, 2**32]),
    lost_frame_threshold=st.sampled_from([0, 0, 2**31, 2**32]),
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


@st.composite
def flawed(draw, most=4):
    """The same with indices of characters whose stop bit is bad."""
    sent = draw(transmissions(most))
    places = [
        st.sets(st.integers(0, len(data) - 1)).map(lambda some: tuple(sorted(some))) for _, data in sent
    ]
    return [(start, data, draw(bad_stop)) for (start, data), bad_stop in zip(sent, places, strict=True)]


neighbours = st.lists(st.tuples(params, flawed(most=3)), max_size=2)


def cuts(until):
    """Ticks in ascending order that end with `until`; some on the edges of the slots."""
    ticks = st.one_of(st.integers(0, until), st.integers(0, until // 2500).map(lambda slot: slot * 2500))
    return st.lists(ticks, max_size=12).map(lambda ticks: [*sorted(ticks), until])
