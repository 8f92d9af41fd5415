"""Inputs are made small, in the same way each time."""

import time

from hypothesis import given
from hypothesis import strategies as st

from mirotwin.fuzz.minimise import Budget, minimise


def small(data, still, tries=100_000):
    return minimise(data, still, Budget(tries, 60.0))


def test_what_does_not_matter_goes_away_and_the_rest_becomes_zero():
    data = bytes(range(1, 200))
    assert small(data, lambda one: 77 in one and one.index(77) >= 3) == bytes([0, 0, 0, 77])


def test_bytes_that_belong_together_stay_together():
    data = b"....A....B........"
    assert small(data, lambda one: b"A" in one and b"B" in one[one.index(b"A") :]) == b"AB"


@given(st.binary(max_size=60), st.binary(min_size=1, max_size=3))
def test_the_result_still_does_it_and_has_no_byte_that_could_be_left_out(data, needle):
    whole = data + needle + data

    def still(one):
        return needle in one

    found = small(whole, still)
    assert found == needle
    assert small(found, still) == found


@given(st.binary(max_size=80))
def test_the_same_input_is_tried_in_the_same_order(data):
    def asked(one, log):
        log.append(one)
        return sum(one) % 7 == 3

    logs = [[], []]
    results = [small(data, lambda one, log=log: asked(one, log)) for log in logs]
    assert results[0] == results[1]
    assert logs[0] == logs[1]


def test_an_input_that_does_not_do_it_comes_back_as_it_was():
    assert small(b"abc", lambda one: False) == b"abc"


def test_a_search_ends_with_its_tries():
    tried = []
    minimise(bytes(range(256)), lambda one: tried.append(one) or len(one) == 256, Budget(10, 60.0))
    assert len(tried) == 10


def test_a_search_ends_with_its_time():
    began_s = time.monotonic()
    minimise(bytes(4000), lambda one: time.sleep(0.01) or len(one) == 4000, Budget(10**9, 0.2))
    assert time.monotonic() - began_s < 5.0
