"""A random host shows what a firmware does otherwise, and nothing where it does the same."""

from itertools import pairwise

import pytest

from miro_protocol.transmission import follows
from tests.mutants.build import shipped
from tests.mutants.difference import difference, image_of, seen_of
from tests.mutants.sdcc import needs_sdcc
from tests.mutants.stimulus import Host

MS = 24_000
SECONDS = 1.5


def test_a_host_never_says_two_things_at_once():
    sent = list(Host(3, 0, 3, 1).transmissions(20_000 * MS))
    assert all(one.end_tick <= other.tick for one, other in pairwise(sent))
    assert len(sent) > 300
    assert any(one.bad_stop for one in sent)
    assert any(not follows(one.end_tick, other.tick) for one, other in pairwise(sent))
    assert sent == list(Host(3, 0, 3, 1).transmissions(20_000 * MS))


@needs_sdcc
def test_the_shipped_firmware_does_the_same_twice_and_swapped_wheels_show():
    right = seen_of(shipped().image, SECONDS, 0)
    assert all(len(events) > 100 for events in right)
    assert str(difference(right, seen_of(shipped().image, SECONDS, 0))) == "the same"
    swapped = difference(right, seen_of(image_of("swaps the wheels"), SECONDS, 0))
    assert "command left LTRJ" in swapped.first


def test_a_name_that_is_no_mutant_is_refused():
    with pytest.raises(ValueError, match=r"there is no mutant 'main\.c:1:1:constant:0'"):
        image_of("main.c:1:1:constant:0")
