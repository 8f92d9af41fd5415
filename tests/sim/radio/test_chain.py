"""The two-state chain: the textbook's one, whatever one asks it first; and the fading that it stands for."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.rng import Stream
from miro_sim.radio.chain import Chain
from miro_sim.radio.params import Bursts
from miro_sim.scenario import profiles
from miro_sim.scenario.file import load
from tests.naive import radio as naive
from tests.sim.radio.radios import bursts, dropouts, seeds

SECONDS = 100
SLOTS = 9600 * SECONDS

# Margin in dB, time below, fades a second, mean fade in ms, frames hit (31 characters). Rayleigh fading: level crossing
# rate and mean fade duration (Rappaport, Wireless Communications, 5.7.3) at 433.92 MHz and 1.46 m/s: 2.11 Hz Doppler.
RAYLEIGH = [
    ("fade5", 0.27, 2.17, 125, 0.34),
    ("fade10", 0.095, 1.52, 63, 0.14),
    ("fade15", 0.031, 0.91, 34, 0.061),
    ("fade20", 0.010, 0.52, 19, 0.027),
    ("fade30", 0.001, 0.17, 6, 0.007),
]


@pytest.mark.slow
@given(bursts() | dropouts, seeds, st.lists(st.integers(0, 1023), min_size=1, max_size=60))
def test_any_slot_in_any_order_is_as_the_naive_chain_has_it_step_by_step(params, seed, slots):
    states = naive.chain_states(params, seed, "fade", 1024)
    chain = Chain(params, seed, "fade")
    assert [chain.bad(slot) for slot in slots] == [states[slot] for slot in slots]
    assert [Chain(params, seed, "fade").bad(slot) for slot in slots[:3]] == [
        states[slot] for slot in slots[:3]
    ]


@given(bursts() | dropouts, seeds, seeds, st.integers(0, 300), st.lists(st.integers(0, 400), max_size=20))
def test_after_a_reseed_the_walk_into_the_past_ends_where_the_other_seed_begins(
    params, seed, other, first, slots
):
    draws = Stream(seed, "fade"), Stream(other, "fade")
    enter, leave = params.chances()
    states, state = [], 0
    for slot in range(401):
        draw = draws[slot >= first].u32(slot)
        state = 1 if draw < enter else 0 if draw >= (1 << 32) - leave else state
        states.append(state)
    chain = Chain(params, seed, "fade")
    chain.bad(first // 2)
    chain.reseed(other, first)
    asked = [max(slot, first - 1, 0) for slot in slots]  # nobody asks for what is further behind
    assert [chain.bad(slot) for slot in asked] == [states[slot] for slot in asked]


def runs_of(states):
    """Lengths of the runs of 1 that are over."""
    return [len(run) for run in "".join(map(str, states)).split("0")[:-1] if run]


@pytest.mark.parametrize(("name", "below", "per_s", "mean_ms", "hit"), RAYLEIGH)
def test_a_fading_profile_is_as_often_and_as_long_below_as_rayleighs_crossings(
    name, below, per_s, mean_ms, hit
):
    """Within four standard deviations of the chain's figures, which are the table's but for its rounding."""
    bursts = profiles.keys_of(name)["bursts"]
    enter, leave = bursts["good_to_bad"], bursts["bad_to_good"]
    chain = Chain(Bursts(good_to_bad=enter, bad_to_good=leave), 3, name)
    states = [chain.bad(slot) for slot in range(SLOTS)]
    fades = runs_of(states)
    share = enter / (enter + leave)
    expected = SLOTS * share * leave  # number of fades
    assert abs(len(fades) - expected) < 4 * expected**0.5
    assert abs(sum(fades) / len(fades) - 1 / leave) < 4 / leave / len(fades) ** 0.5
    assert abs(sum(states) / SLOTS - share) < 4 * (2 * share / leave / SLOTS) ** 0.5
    assert share == pytest.approx(below, rel=0.05)
    assert share * leave * 9600 == pytest.approx(per_s, rel=0.05)
    assert 1000 / leave / 9600 == pytest.approx(mean_ms, rel=0.05)
    frames = [max(states[start : start + 310]) for start in range(0, SLOTS - 320, 320)]
    chance = 1 - (1 - share) * (1 - enter) ** 309
    assert (
        abs(sum(frames) / len(frames) - chance) < 4 * (2 * chance / leave / 320 / len(frames)) ** 0.5 + 0.002
    )
    assert chance == pytest.approx(hit, rel=0.1, abs=0.001)


@pytest.mark.parametrize("margin_db", [5, 10, 15, 20, 30])
@pytest.mark.parametrize(("ending", "speed_m_s"), [("", 1.46), ("_slow", 0.2)])
def test_the_chances_of_a_fading_profile_are_rayleighs_at_its_speed(margin_db, ending, speed_m_s):
    """Crossing rate sqrt(2 pi) f r exp(-r^2), mean fade (exp(r^2) - 1) / (sqrt(2 pi) f r), with f the Doppler shift."""
    bursts = profiles.keys_of(f"fade{margin_db}{ending}")["bursts"]
    power = 10 ** (-margin_db / 10)
    crossings_hz = math.sqrt(2 * math.pi * power) * speed_m_s * 433.92e6 / 299_792_458
    assert bursts["good_to_bad"] == pytest.approx(crossings_hz / 9600, rel=0.03)
    assert bursts["bad_to_good"] == pytest.approx(crossings_hz / (math.exp(power) - 1) / 9600, rel=0.03)


def test_at_the_speed_of_the_figures_a_mean_fade_stops_a_robot_and_at_the_largest_speed_it_does_not():
    """Which is after 110 ms without a fresh frame."""
    fast, slow = (
        1000 / profiles.keys_of(name)["bursts"]["bad_to_good"] / 9600 for name in ("fade15", "fade15_slow")
    )
    assert fast < 110 < slow
    assert slow / fast == pytest.approx(1.46 / 0.2, rel=0.03)
    for name in ("fig6", "fig7", "fig8", "fig9", "fig10"):
        assert load(name).scenario.networks[0].robot[0].reference.speed_m_s == 0.2


def test_a_chain_shows_what_it_is():
    never = Bursts(good_to_bad=0.0, bad_to_good=1.0)
    assert repr(Chain(never, 0, "a")) == f"Chain('a', enter=0, leave={2**32})"
