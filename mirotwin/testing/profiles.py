"""Hypothesis strategies of radios: what `Bench` and `LinkMachine` take as their air."""

from __future__ import annotations

from hypothesis import strategies as st

from miro_exact.seed import MAX_SEED
from miro_sim.radio.params import Bursts, Dropouts, Radio

BIT_ERROR_RATES = (0.0, 1e-4, 1e-3, 1e-2)


def link_profiles() -> st.SearchStrategy[Radio]:
    """Radios from an ideal wire (what shrinking ends at) to a keyed carrier with noise, one wrong bit in 100, bursts,
    drop-outs, false start bits and lost characters; without what leaves the grid of bits (see `Bench`).
    """
    wires = st.just(Radio.ideal())
    radios = st.builds(
        Radio,
        latency_s=st.sampled_from([0.0, 1 / 24e6, 1 / 9600, 0.005]),
        bit_error_rate=st.sampled_from(BIT_ERROR_RATES),
        carrier=st.sampled_from(["on", "keyed"]),
        keyup_s=st.sampled_from([0.001, 0.002]),
        squelch=st.booleans(),
        bursts=st.none() | st.just(Bursts(good_to_bad=1e-3, bad_to_good=1e-2)),
        dropouts=st.none() | st.just(Dropouts(every_s=0.3, length_s=0.02)),
        false_starts_hz=st.sampled_from([0.0, 19.2]),
        lost_character_rate=st.sampled_from([0.0, 0.01]),
    )
    return st.one_of(wires, radios)


def seeds() -> st.SearchStrategy[int]:
    """Of all noise on the air."""
    return st.integers(0, MAX_SEED)
