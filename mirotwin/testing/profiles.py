"""Hypothesis strategies of radios: what `Bench` and `LinkMachine` take as their air."""

from __future__ import annotations

from hypothesis import strategies as st

from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.seed import MAX_SEED
from miro_sim.radio import RadioParams, error_threshold
from miro_sim.radio.params import ChainParams

MS = TICKS_PER_SECOND // 1000
BIT_ERROR_RATES = (0.0, 1e-4, 1e-3, 1e-2)


def link_profiles() -> st.SearchStrategy[RadioParams]:
    """Radios from an ideal wire (what shrinking ends at) to a keyed carrier with noise, one wrong bit in 100, bursts,
    drop-outs, false start bits and lost characters; without what leaves the grid of bits (see `Bench`).
    """
    wires = st.just(RadioParams.ideal())
    radios = st.builds(
        RadioParams,
        latency_ticks=st.sampled_from([0, 1, 2500, 5 * MS]),
        error_threshold=st.sampled_from([error_threshold(rate) for rate in BIT_ERROR_RATES]),
        carrier=st.sampled_from(["on", "keyed"]),
        keyup_ticks=st.sampled_from([MS, 2 * MS]),
        squelch=st.booleans(),
        bursts=st.none() | st.just(ChainParams.of(1e-3, 1e-2)),
        dropouts=st.none() | st.just(ChainParams.lasting(0.3, 0.02)),
        false_start_threshold=st.sampled_from([0, error_threshold(0.002)]),
        lost_threshold=st.sampled_from([0, error_threshold(0.01)]),
    )
    return st.one_of(wires, radios)


def seeds() -> st.SearchStrategy[int]:
    """Of all noise on the air."""
    return st.integers(0, MAX_SEED)
