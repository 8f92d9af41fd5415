"""The promise of the frame: any 1 to 4 wrong bits in HDR..CRC are refused, whatever the frame says."""

from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from miro_protocol.crc import crc16
from miro_protocol.decoder import Decoder
from miro_protocol.frames import TeamFrame, encode, layout_crc
from miro_protocol.strategies import host_frames
from miro_protocol.table import DOWNLINK, TELEMETRY, downlink

COVERED = {n: 8 * (downlink(n).body_size + 2) for n in (3, 5)}


def with_wrong_bits(wire: bytes, covered: int, bits) -> bytes:
    number = int.from_bytes(wire, "little")
    for bit in bits:
        number ^= 1 << (8 * len(wire) - covered + bit)
    return number.to_bytes(len(wire), "little")


@pytest.mark.parametrize("n", [3, 5])
@pytest.mark.parametrize("wrong", [1, 2])
def test_every_way_to_get_one_or_two_bits_wrong_is_refused(n, wrong):
    wire = encode(TeamFrame(0, 5, ((16633, -16633),) * n), n)
    decoder = Decoder(n)
    ways = list(combinations(range(COVERED[n]), wrong))
    decoder.feed(b"".join(with_wrong_bits(wire, COVERED[n], bits) for bits in ways))
    assert (decoder.valid, decoder.rejected >= len(ways)) == (0, True)
    decoder.feed(wire)
    assert decoder.valid == 1


@pytest.mark.parametrize("form", [*DOWNLINK.values(), TELEMETRY], ids=lambda form: form.name)
def test_no_one_to_four_wrong_bits_at_all_leave_the_crc_good(form):
    """The code is linear: what a set of wrong bits does to the CRC is the XOR of what each does alone. If those
    of no bit, of one and of any two all differ, then three or four never cancel each other either."""
    bits = 8 * (form.body_size + 2)
    good = crc16(bytes(bits // 8), layout_crc(form))
    alone = [crc16((1 << bit).to_bytes(bits // 8, "little"), layout_crc(form)) ^ good for bit in range(bits)]
    pairs = [first ^ second for first, second in combinations(alone, 2)]
    assert len({0, *alone, *pairs}) == 1 + len(alone) + len(pairs)


@settings(deadline=None, max_examples=200)
@given(st.data(), st.sampled_from([3, 5]), st.integers(1, 4))
def test_one_to_four_wrong_bits_in_any_frame_are_refused(data, n, wrong):
    wire = encode(data.draw(host_frames(n)), n)
    place = st.integers(0, COVERED[n] - 1)
    bits = data.draw(st.lists(place, min_size=wrong, max_size=wrong, unique=True))
    decoder = Decoder(n)
    decoder.feed(with_wrong_bits(wire, COVERED[n], bits))
    assert (decoder.valid, decoder.rejected >= 1) == (0, True)
