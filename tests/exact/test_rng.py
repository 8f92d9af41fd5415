"""Random numbers: Philox against its published vectors, streams as pure functions, the Gaussian's shape."""

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import rng
from miro_exact.rng import HALF_NORMAL, Stream, philox4x32
from tests.exact.uncompiled import uncompiled
from tests.naive import rng as naive

seeds = st.integers(0, 2**63 - 1)
indices = st.one_of(st.integers(0, 1000), st.integers(0, 2**56 - 1))
PLAIN = uncompiled(rng)
DRAWS = ("u32", "u64", "bit", "uniform", "gauss")

# Random123, tests/kat_vectors, lines "philox4x32 10": counter, key, expected
VECTORS = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("counter", "key", "expected"), VECTORS)
def test_philox_gives_the_published_words(counter, key, expected):
    assert philox4x32(*counter, *key) == expected
    assert naive.philox4x32_10(counter, key) == expected


@given(seeds, st.text(max_size=20), st.lists(st.tuples(st.sampled_from(DRAWS), indices), max_size=30))
def test_draws_in_any_order_equal_those_of_the_naive_twin_compiled_and_uncompiled(seed, name, wanted):
    expected = [getattr(naive, draw)(seed, name, index) for draw, index in wanted]
    for stream in (Stream(seed, name), PLAIN.Stream(seed, name)):
        assert [getattr(stream, draw)(index) for draw, index in wanted] == expected


def test_streams_differ_in_name_and_in_every_bit_of_the_seed():
    draws = {Stream(1 << bit, "a").u64(0) for bit in range(63)} | {Stream(0, name).u64(0) for name in "abc"}
    assert len(draws) == 66


def test_kinds_of_draw_share_no_bits():
    stream = Stream(3, "kinds")
    assert stream.u32(0) != stream.u64(0) & 0xFFFFFFFF
    assert [stream.bit(i) for i in range(32)] != [stream.u32(0) >> i & 1 for i in range(32)]


@pytest.mark.parametrize("seed", [-1, 2**63])
def test_a_seed_outside_its_range_is_refused(seed):
    with pytest.raises(ValueError, match="seed"):
        Stream(seed, "x")


@pytest.mark.parametrize("draw", DRAWS)
@pytest.mark.parametrize("index", [-1, 2**56])
def test_an_index_outside_its_range_is_refused(draw, index):
    with pytest.raises(ValueError, match="index"):
        getattr(Stream(0, "x"), draw)(index)


@given(seeds, st.integers(0, 2**56 - 100), st.integers(0, 99), st.sampled_from((0, 2**28, 2**32)))
def test_the_next_index_below_a_threshold_is_the_first_that_is(seed, first, count, threshold):
    hits = [i for i in range(first, first + count) if naive.u32(seed, "errors", i) < threshold]
    for stream in (Stream(seed, "errors"), PLAIN.Stream(seed, "errors")):
        assert [i for i in range(first, first + count) if stream.below(i, threshold)] == hits
        assert stream.next_below(first, first + count, threshold) == min(hits, default=first + count)


@pytest.mark.parametrize(("first", "end"), [(-1, 5), (0, 2**56 + 1)])
def test_the_next_index_below_a_threshold_is_looked_for_in_the_range_of_indices(first, end):
    with pytest.raises(ValueError, match="outside"):
        Stream(0, "x").next_below(first, end, 1)


def test_uniform_lies_in_its_interval_with_the_right_mean_and_53_bits():
    stream = Stream(14, "u")
    values = [stream.uniform(i) for i in range(20_000)]
    assert all(0.0 <= value < 1.0 and (value * 2**53).is_integer() for value in values)
    assert abs(sum(values) / len(values) - 0.5) < 4 * 0.2887 / 20_000**0.5
    assert any((value * 2**53) % 2 for value in values)


def test_the_half_normal_table_is_right_to_the_last_bit():
    assert [naive.half_normal(k) for k in range(len(HALF_NORMAL))] == HALF_NORMAL
    assert HALF_NORMAL[0] == 0
    assert HALF_NORMAL[-1] == 2**63
    assert HALF_NORMAL[-2] < 2**63


@given(seeds, indices)
def test_gauss_is_close_to_exact_inversion_of_the_same_draw(seed, index):
    exact = naive.exact_gauss(seed, "g", index)
    assert abs(Stream(seed, "g").gauss(index) - exact) < 1e-5 + 2e-5 * abs(exact) + 3e-6 * exact * exact


def test_the_distribution_of_gauss_is_normal_to_two_millionths():
    """Exactly, without sampling: its distribution function against the true one inside every cell."""
    for k in range(len(HALF_NORMAL) - 1):
        for place in (0.1, 0.25, 0.5, 0.75, 0.9):
            z = (k + place - (k + 0.5) / 512 * place * (1 - place)) / 16
            mass = (HALF_NORMAL[k] + place * (HALF_NORMAL[k + 1] - HALF_NORMAL[k])) / 2**63
            assert abs(float(mpmath.erf(z / 2**0.5)) - mass) / 2 < 1.6e-6


def test_a_stream_names_itself():
    assert repr(Stream(7, "net0/robot1/noise")) == "Stream(7, 'net0/robot1/noise')"
