"""The receiver: spacing, stop bits, window, freshness; and the decoder in C against the one in Python."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_protocol.hypothesis_frames import damaged_streams
from tests.robot.firmware.differential import compare, drawn_stream, frame
from tests.robot.firmware.rig import BIT, CHARACTER, MS, US, Rig

LEAD = 6  # characters before the sync


@pytest.mark.parametrize(("pause_us", "accepted"), [(0, 1), (20, 1), (80, 0), (200, 0)])
@pytest.mark.parametrize("place", [0, 5, 15])
def test_a_pause_inside_the_window_decides_by_its_length(pause_us, accepted, place):
    rig = Rig()
    pauses = [0] * (LEAD + place) + [pause_us * US]
    last = rig.send(frame(0), pauses=pauses)
    rig.run_to(last + 5 * CHARACTER)
    assert rig.counters == (accepted, 0, 0)


@pytest.mark.parametrize(("character_us", "accepted"), [(1010, 1), (1040, 1), (1080, 1), (1100, 0)])
def test_the_gauge_tells_spacings_within_50_us_of_1040_us(character_us, accepted):
    """Short bits, the stop bit stretched. Below 1001 us the receiver itself misses start edges: RI comes then."""
    rig = Rig()
    pause = character_us * US - 10 * 2400
    last = rig.send(frame(0), bit=2400, pauses=[pause] * 30)
    rig.run_to(last + 5 * CHARACTER)
    assert rig.counters == (accepted, 0, 0)


@pytest.mark.parametrize("pause_us", [20, 80])
def test_the_gauge_holds_while_telemetry_is_sent(pause_us):
    """The transmit branch of the interrupt delays a received character's reading; the margin covers it."""
    rig = Rig()
    rig.team(0, 0, 0, ask=True)
    for seq in range(1, 9):
        last = rig.send(
            frame(seq, kind=3 if seq % 3 == 0 else 0), pauses=[0] * (LEAD + 2) + [pause_us * US] * 14
        )
        rig.run_to(last + 5 * CHARACTER + seq * 37)
    assert rig.counters == (9 if pause_us == 20 else 1, 0, 0)


@pytest.mark.parametrize("place", range(LEAD, LEAD + 17))
def test_a_damaged_stop_bit_in_the_window_refuses_the_frame(place):
    rig = Rig()
    start = rig.now + CHARACTER
    for index, byte in enumerate(frame(0)):
        rig.send_symbol((byte, index != place, start + index * CHARACTER))
    rig.run_to(rig.line_free + 3 * CHARACTER)
    assert rig.counters == (0, 0, 0)


@pytest.mark.parametrize(("steps", "counters"), [
    ([0, 1, 9], (3, 0, 0)),
    ([0, 0], (1, 0, 1)),
    ([5, 14], (1, 0, 1)),
    ([63, 0, 8], (3, 0, 0)),
    ([3, 2], (1, 0, 1)),
])  # fmt: skip
def test_only_one_to_eight_steps_forward_are_fresh(steps, counters):
    rig = Rig()
    for seq in steps:
        rig.frame(frame(seq))
    assert rig.counters == counters


@settings(max_examples=10)
@given(st.integers(0, 2**32), st.sampled_from([3, 5]))
def test_firmware_and_python_agree_on_long_damaged_streams(seed, n):
    compare(drawn_stream(seed, n, 25), n)


@pytest.mark.slow
@settings(max_examples=40)
@given(damaged_streams())
def test_firmware_and_python_agree_on_any_damage(heard):
    compare(heard.symbols, heard.n)


@settings(max_examples=20)
@given(st.binary(max_size=200), st.sampled_from([3, 5]), st.integers(0, 63))
def test_firmware_and_python_agree_on_any_bytes_with_frames_among_them(data, n, seq):
    cut = len(data) // 2
    wire = data[:cut] + frame(seq, n) + data[cut:] + frame(seq + 1 & 63, n)
    compare([(byte, True, place * CHARACTER) for place, byte in enumerate(wire)], n)


def test_the_comparison_sees_a_difference():
    """A character more for Python than for the firmware: the frame it spoils is missed by one of them."""
    symbols = [(byte, True, place * CHARACTER) for place, byte in enumerate(frame(1))]
    with pytest.raises(AssertionError, match="firmware"):
        compare(
            symbols,
            3,
            sent=[(byte ^ (place == 12), good, at) for place, (byte, good, at) in enumerate(symbols)],
        )


@settings(max_examples=40)
@given(
    st.lists(st.integers(0, 1), max_size=400), st.integers(1, 2 * BIT), st.sampled_from([3, 5]), st.booleans()
)
def test_the_first_frame_after_any_garbage_on_the_line_is_taken(levels, width, n, at_once):
    """Garbage of any pulse width and phase, the frame right after it or after a key-up."""
    rig = Rig(n=n)
    start = rig.now + CHARACTER
    rig.pending += [(start + place * width, level) for place, level in enumerate(levels)]
    end = start + len(levels) * width
    if not at_once:
        rig.pending.append((end, 1))
        end += MS
    rig.send(frame(1, n), at=end)
    rig.run_to(rig.line_free + 5 * CHARACTER)
    assert rig.counters[0] == 1
    assert rig.u8("_last_hdr") & 63 == 1


def test_random_levels_without_a_carrier_never_make_a_frame():
    rig = Rig()
    draw = random.Random(1)
    for slot in range(10_000):
        rig.pending.append((rig.now + 100 + slot * BIT, draw.getrandbits(1)))
    rig.run_ms(1050)
    assert rig.counters == (0, 0, 0)
