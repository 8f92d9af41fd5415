"""Canonical bytes: one encoding per state, none for two, and errors that say where."""

import hashlib
import importlib.util
from enum import IntEnum

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.naive import canonical as naive

from miro_exact import canonical
from miro_exact.canonical import GENESIS, CanonicalError, digest_chain, encode

scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from([2**63 - 1, 2**63, -(2**63), -(2**63) - 1, 255, 256, -129]),
    st.integers(-(2**200), 2**200),
    st.floats(allow_nan=False),
    st.text(max_size=8),
    st.binary(max_size=8),
)
states = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=5),
        st.lists(inner, max_size=5).map(tuple),
        st.dictionaries(st.text(max_size=5), inner, max_size=5),
    ),
    max_leaves=25,
)


@pytest.fixture(scope="module")
def plain():
    """The same source, never compiled."""
    path = canonical.__file__.rpartition("/")[0] + "/canonical.py"
    spec = importlib.util.spec_from_file_location("plain_canonical", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def as_read_back(value):
    """What is left of a value: no difference between list and tuple."""
    if isinstance(value, (list, tuple)):
        return [as_read_back(item) for item in value]
    if isinstance(value, dict):
        return {key: as_read_back(item) for key, item in value.items()}
    return value


def typed(value):
    """The value with its types, so that 1, 1.0 and True differ."""
    if isinstance(value, list):
        return [typed(item) for item in value]
    if isinstance(value, dict):
        return {key: typed(item) for key, item in value.items()}
    return type(value), value


@settings(deadline=None)
@given(states)
def test_the_encoding_equals_its_naive_twin_compiled_or_not(plain, state):
    assert encode(state) == naive.encode(state) == plain.encode(state)


@settings(deadline=None)
@given(states)
def test_a_state_can_be_read_back_so_no_two_states_share_their_bytes(state):
    assert typed(naive.decode(encode(state))) == typed(as_read_back(state))


@given(st.dictionaries(st.text(max_size=5), st.integers(), max_size=8), st.randoms(use_true_random=False))
def test_the_order_in_which_a_dict_was_filled_does_not_matter(entries, random):
    keys = list(entries)
    random.shuffle(keys)
    assert encode({key: entries[key] for key in keys}) == encode(entries)


def test_negative_zero_counts_as_zero_and_an_integer_does_not_count_as_a_float():
    assert encode([-0.0]) == encode([0.0])
    assert encode(0) != encode(0.0) != encode(False)


def test_an_enumeration_member_counts_as_its_number():
    assert encode(IntEnum("Kind", ["A", "B"]).B) == encode(2)


class Text(str): ...


class Octets(bytes): ...


class Entries(dict): ...


class Items(list): ...


class Number(float): ...


def test_a_value_of_a_derived_class_counts_as_one_of_its_base(plain):
    derived = Entries(a=Text("\u00e9"), b=Octets(b"x"), c=Items([1, Number(-0.0)]))
    state = {"a": "\u00e9", "b": b"x", "c": [1, 0.0]}
    assert encode(derived) == plain.encode(derived) == naive.encode(state)


@pytest.mark.parametrize("size", range(200, 300, 7))
@pytest.mark.parametrize("kind", ["text", "ascii", "bytes", "number"])
def test_values_that_cross_the_end_of_the_encoders_room_come_out_whole(plain, size, kind):
    one = {"text": "\u00e9" * size, "ascii": "e" * size, "bytes": b"\x80" * size, "number": 7 ** (3 * size)}[
        kind
    ]
    state = [None] * (size // 3) + [one] * 9 + [-1, 1.5, one, True]
    assert encode(state) == plain.encode(state) == naive.encode(state)


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"robots": [{"v": 1.0}, {"v": float("nan")}]}, r"state.robots\[1\].v: NaN has no canonical form"),
        (float("nan"), "state: NaN"),
        ({"a": {1, 2}}, "state.a: set has no canonical form"),
        ([bytearray(2)], r"state\[0\]: bytearray has no canonical form"),
        ({"slots": {3: None}}, "state.slots: key 3 is no str"),
    ],
)
def test_what_has_no_canonical_form_is_refused_with_its_path(plain, state, message):
    with pytest.raises(CanonicalError, match=message):
        encode(state)
    with pytest.raises(plain.CanonicalError, match=message):
        plain.encode(state)


def test_a_state_that_contains_itself_is_refused():
    state = []
    state.append(state)
    with pytest.raises(CanonicalError, match="nested deeper than 64"):
        encode(state)


def test_the_chain_is_sha_256_over_the_previous_digest_and_the_state():
    first = digest_chain(GENESIS, {"tick": 0})
    assert first == hashlib.sha256(bytes(32) + naive.encode({"tick": 0})).digest()
    assert digest_chain(first, {"tick": 1}) == hashlib.sha256(first + naive.encode({"tick": 1})).digest()


def test_a_chain_refuses_to_go_on_from_something_that_is_no_digest():
    with pytest.raises(ValueError, match="32 bytes, not 0"):
        digest_chain(b"", {})
