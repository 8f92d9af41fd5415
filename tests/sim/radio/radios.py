"""Radios for tests, given and drawn: parameters, transmissions that do not overlap, ways to cut time into pieces."""

from hypothesis import strategies as st

from miro_exact.clock import TICKS_PER_SECOND
from miro_sim.radio.params import Bursts, Dropouts, Radio, SlicerParams

ALWAYS = Dropouts(every_s=0.000105, length_s=1e6)
"""No carrier from the first bits on."""


def clean(**keys):
    """A radio without errors unless these keys ask for some; `latency_ticks` is `latency_s` in ticks, and so on."""
    found = {} if "eb_n0_db" in keys else {"bit_error_rate": 0.0}
    for key, value in keys.items():
        name = key.removesuffix("_ticks")
        found.update({key: value} if name == key else {f"{name}_s": value / TICKS_PER_SECOND})
    return Radio(**found)


rates = st.sampled_from([0.0, 0.01, 0.25, 0.5])
chances = st.sampled_from([0.0, 0.0, 0.2, 1.0])
offsets = st.sampled_from([0, 0, 1, -1, 173, -10_000, 50_000, -50_000])


@st.composite
def bursts(draw):
    """Chains of short and long runs, also those that never change and those that always do."""
    enter = draw(st.sampled_from([0.0, 2**-32, 1 / 300, 1 / 7, 0.5, 1.0]))
    leave = draw(st.sampled_from([0.0, 2**-32, 0.02, 1 / 3, 0.5, 1.0]))
    leave = min(leave, 1.0 - enter)
    return Bursts(good_to_bad=enter, bad_to_good=leave, bit_error_rate=draw(rates))


dropouts = st.builds(
    Dropouts,
    every_s=st.sampled_from([0.00025, 0.001, 0.3, 1e6]),
    length_s=st.sampled_from([0.00025, 0.001, 0.02, 1e6]),
)
slicers = st.builds(
    SlicerParams,
    settle_s=st.sampled_from([0.000105, 0.004, 0.3]),
    offset=st.sampled_from([-1.0, -0.5, 0.0, 0.3, 1.0]),
)
signals_db = st.sampled_from([-20.0, 0.0, 9.0, 13.35, 60.0])
errors = st.one_of(
    st.fixed_dictionaries({"bit_error_rate": rates}),
    st.fixed_dictionaries({"eb_n0_db": signals_db, "slicer": st.none() | slicers}),
)
params = st.builds(
    lambda errors, **keys: clean(**errors, **keys),
    errors,
    latency_ticks=st.sampled_from([0, 1, 2499, 2500, 7777]),
    jitter_ticks=st.sampled_from([0, 0, 1, 2500, 60_000]),
    carrier=st.sampled_from(["keyed", "on"]),
    keyup_ticks=st.sampled_from([0, 1, 2500, 24_000]),
    squelch=st.booleans(),
    baud_offset_ppm=offsets,
    crystal_offset_ppm=offsets,
    bursts=st.none() | bursts(),
    dropouts=st.none() | dropouts,
    false_starts_hz=st.sampled_from([0.0, 96.0, 2400.0, 9600.0]),
    lost_character_rate=chances,
    lost_frames=chances,
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
