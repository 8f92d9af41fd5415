"""The receiver: spacing, stop bits, window, freshness; and the decoder in C against the one in Python."""

import random

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from miro_protocol.decoder import Decoder, Received, Symbol
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.freshness import Freshness
from miro_protocol.table import FRESH_AGAIN_TICKS

from tests.robot.firmware.rig import BIT, CHARACTER, US, Rig

LEAD = 6  # characters before the sync


def frame(seq: int, n: int = 3, velocity: int = 1234, kind: int = 0) -> bytes:
    return encode(TeamFrame(kind, seq, ((velocity, -velocity),) * n), n)


@pytest.mark.parametrize(("pause_us", "accepted"), [(0, 1), (20, 1), (80, 0), (200, 0)])
@pytest.mark.parametrize("place", [0, 5, 15])
def test_a_pause_inside_the_window_decides_by_its_length(pause_us: int, accepted: int, place: int) -> None:
    rig = Rig()
    pauses = [0] * (LEAD + place) + [pause_us * US]
    last = rig.send(frame(0), pauses=pauses)
    rig.run_to(last + 5 * CHARACTER)
    assert rig.counters == (accepted, 0, 0)


@pytest.mark.parametrize(("character_us", "accepted"), [(1010, 1), (1040, 1), (1080, 1), (1100, 0)])
def test_the_gauge_tells_spacings_within_50_us_of_1040_us(character_us: int, accepted: int) -> None:
    """Short bits, the stop bit stretched. Below 1001 us the receiver itself misses start edges: RI comes then."""
    rig = Rig()
    pause = character_us * US - 10 * 2400
    last = rig.send(frame(0), bit=2400, pauses=[pause] * 30)
    rig.run_to(last + 5 * CHARACTER)
    assert rig.counters == (accepted, 0, 0)


@pytest.mark.parametrize("pause_us", [20, 80])
def test_the_gauge_holds_while_telemetry_is_sent(pause_us: int) -> None:
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
def test_a_damaged_stop_bit_in_the_window_refuses_the_frame(place: int) -> None:
    rig = Rig()
    start = rig.now + CHARACTER
    for index, byte in enumerate(frame(0)):
        rig.send_symbol((byte, index != place, start + index * CHARACTER))
    rig.run_to(rig.line_free + 3 * CHARACTER)
    assert rig.counters == (0, 0, 0)


def test_a_damaged_frame_is_counted_and_the_next_one_taken() -> None:
    rig = Rig()
    data = bytearray(frame(0))
    data[LEAD + 6] ^= 0x10
    rig.frame(bytes(data))
    assert rig.counters == (0, 1, 0)
    rig.frame(frame(1))
    assert rig.counters == (1, 1, 0)


def test_a_frame_is_taken_whatever_comes_right_before_it() -> None:
    rig = Rig()
    for seq, garbage in enumerate([b"\x2d\xd4", b"\x2d", frame(0)[:-1], bytes(range(256)), b"\x2d\xd4" * 20]):
        last = rig.send(garbage + frame(seq))
        rig.run_to(last + 5 * CHARACTER)
        assert rig.counters[0] == seq + 1


def test_two_frames_that_follow_at_once_are_both_taken() -> None:
    rig = Rig()
    last = rig.send(frame(0) + frame(1))
    rig.run_to(last + 5 * CHARACTER)
    assert rig.counters == (2, 0, 0)


@pytest.mark.parametrize(("steps", "counters"), [
    ([0, 1, 9], (3, 0, 0)),
    ([0, 0], (1, 0, 1)),
    ([5, 14], (1, 0, 1)),
    ([63, 0, 8], (3, 0, 0)),
    ([3, 2], (1, 0, 1)),
])  # fmt: skip
def test_only_one_to_eight_steps_forward_are_fresh(steps: list[int], counters: tuple[int, int, int]) -> None:
    rig = Rig()
    for seq in steps:
        rig.frame(frame(seq))
    assert rig.counters == counters


def stream(seed: int, n: int, frames: int) -> list[Symbol]:
    """Frames, garbage, cuts, wrong bits, wrong stop bits and pauses of at most 20 us or at least 80 us."""
    draw = random.Random(seed)
    symbols: list[Symbol] = []
    tick = 0

    def put(byte: int, stop_good: bool = True, pause_us: int = 0) -> None:
        nonlocal tick
        symbols.append((byte, stop_good, tick))
        tick += CHARACTER + pause_us * US

    seq = draw.randrange(64)
    for _ in range(frames):
        for _ in range(draw.choice([0, 0, 1, 3, 30])):
            pause_us = draw.choice([0, 0, draw.randrange(20), draw.randrange(80, 3000)])
            put(draw.choice([0x2D, 0xD4, 0xFF, draw.randrange(256)]), draw.random() > 0.05, pause_us)
        seq = (seq + draw.choice([1, 1, 1, 2, 0, 9])) % 64
        data = bytearray(frame(seq, n, draw.randint(-32767, 32767), draw.choice([0, 3])))
        for _ in range(draw.choice([0, 0, 0, 1, 3])):
            data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
        del data[draw.choice([len(data), len(data), draw.randrange(len(data))]) :]
        flaw = draw.choice([-1, -1, draw.randrange(len(data) + 1)])
        pause = draw.choice([-1, -1, draw.randrange(len(data) + 1)])
        for index, byte in enumerate(data):
            long = draw.randrange(80, 2000)
            put(byte, index != flaw, long if index == pause else draw.choice([0, 0, draw.randrange(20)]))
    return symbols


Reception = tuple[tuple[int, int, int], int | None]


def python_receives(symbols: list[Symbol], n: int) -> Reception | None:
    """Counters and last fresh number; None if a frame comes within 0.2 ms of 150 ms after the last fresh one.

    The firmware measures that from a decoding time that interrupts stretch by up to 0.1 ms.
    """
    decoder, freshness = Decoder(n), Freshness()
    for symbol in symbols:
        for event in decoder.feed_symbols([symbol]):
            if isinstance(event, Received):
                age = event.last_tick - freshness.last_tick
                if freshness.last_seq is not None and abs(age - FRESH_AGAIN_TICKS) <= 200 * US:
                    return None
                freshness.judge(event.seq, event.last_tick)
    return (freshness.accepted, decoder.rejected, freshness.stale), freshness.last_seq


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from([3, 5]))
def test_firmware_and_python_agree_on_damaged_streams(seed: int, n: int) -> None:
    rig = Rig(n=n)
    symbols = [(byte, good, tick + rig.now + CHARACTER) for byte, good, tick in stream(seed, n, 25)]
    for symbol in symbols:
        rig.send_symbol(symbol)
    rig.run_to(rig.line_free + 6 * CHARACTER)
    expected = python_receives(symbols, n)
    assume(expected is not None)
    counters, last_seq = expected or ((), None)
    assert rig.counters == counters
    assert last_seq is None or rig.u8("_last_hdr") & 63 == last_seq


def test_random_levels_without_a_carrier_never_make_a_frame() -> None:
    rig = Rig()
    draw = random.Random(1)
    for slot in range(10_000):
        rig.pending.append((rig.now + 100 + slot * BIT, draw.getrandbits(1)))
    rig.run_ms(1050)
    assert rig.counters == (0, 0, 0)
