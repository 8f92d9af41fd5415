"""Wire formats as plug-ins: the two laws of the interface, on our own format."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.frames import TeamFrame, decode_fields
from miro_protocol.miro_wire import Miro
from miro_protocol.protocol import Damage, Frame
from miro_protocol.table import downlink

NETWORKS = st.sampled_from([3, 5]).map(lambda robots: Miro(robots=robots))


@given(NETWORKS, st.data())
def test_what_is_encoded_is_decoded_again(protocol, data):
    size = downlink(protocol.robots).body_size
    body = data.draw(st.binary(min_size=size, max_size=size))
    wire = protocol.encode(body)
    assert protocol.decode(wire) == [Frame(body, 0, len(wire))]


@given(NETWORKS, st.binary(max_size=40), st.none() | st.integers(0, 300))
def test_any_bytes_are_repaired_to_one_good_frame(protocol, body, number):
    (found,) = protocol.decode(protocol.repair(body, number))
    assert isinstance(found, Frame)
    assert number is None or found.body[0] % 64 == number % 64


@given(NETWORKS, st.binary(max_size=100))
def test_what_is_decoded_is_in_order_and_says_something_of_every_character(protocol, wire):
    found = protocol.decode(wire)
    assert [one.start for one in found] == [0, *(one.end for one in found)][: len(found)]
    assert sum(one.end - one.start for one in found) == len(wire)


def test_damage_is_told_with_its_place_and_its_reason():
    protocol = Miro()
    wire = bytearray(protocol.repair(b"\x01"))
    wire[-1] ^= 1
    assert protocol.decode(bytes(wire)) == [Damage(0, len(wire), "bad crc")]


def test_a_body_that_no_frame_can_carry_is_refused():
    with pytest.raises(ValueError, match="body of 4 bytes: a network of 3 robots has 13"):
        Miro().encode(b"four")


@pytest.mark.parametrize("robots", [3, 5])
def test_samples_are_bodies_that_mean_something(robots):
    protocol = Miro(robots=robots)
    messages = [decode_fields(body, robots) for body in protocol.samples()]
    assert len({type(message) for message in messages}) == 2
    assert isinstance(messages[0], TeamFrame)
    assert all(protocol.decode(protocol.encode(body)) for body in protocol.samples())
