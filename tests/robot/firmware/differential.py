"""Feeds random, damaged and valid streams to the real firmware and to the Python decoder, and compares.

    python -m tests.robot.firmware.differential [FRAMES] [SEED]

The characters go to the firmware bit by bit on RXD, to the decoder as symbols. After every valid frame both must have
the same frame, to the last bit of its contents, and the same counters.

The test run does a CI-sized part of the same, on streams that Hypothesis draws (test_reception.py); this goes on to any
number of frames with their garbage, 100 000 unless told. Exit code 1 at the first difference, with the seed that
shows it.
"""

import random
import sys

from miro_protocol.decoder import Decoder, Received
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.robot_receiver import Freshness
from miro_protocol.table import FRESH_AGAIN_TICKS, downlink
from tests.robot.firmware.rig import CHARACTER, MS, US, Rig, iram

FRAMES_PER_RIG = 100
LOOKING = 4 * MS  # the firmware has looked at a frame so long after its last character


def frame(seq, n=3, velocity=1234, kind=0):
    return encode(TeamFrame(kind, seq, ((velocity, -velocity),) * n), n)


def drawn_stream(seed, n, frames):
    """Frames, garbage, cuts, wrong bits, wrong stop bits and pauses of at most 20 us or at least 80 us."""
    draw = random.Random(seed)
    symbols = []
    tick = 0

    def put(byte, stop_good=True, pause_us=0):
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


def at_the_edge(tick, freshness):
    """Whether a frame comes within 0.2 ms of 150 ms after the last fresh one.

    The firmware measures that from a decoding time that interrupts stretch by up to 0.1 ms.
    """
    return freshness.last_seq is not None and abs(tick - freshness.last_tick - FRESH_AGAIN_TICKS) <= 200 * US


def compare(symbols, n, sent=None):
    """AssertionError unless firmware and Python make the same of `symbols` (the firmware is sent `sent` instead).

    False if it ended early because a frame came right at the 150 ms edge.
    """
    rig = Rig(n=n)
    begin = rig.now + CHARACTER
    for byte, good, tick in sent or symbols:
        rig.send_symbol((byte, good, tick + begin))
    decoder, freshness = Decoder(n), Freshness()
    for byte, good, tick in symbols:
        for event in decoder.feed_symbols([(byte, good, tick + begin)]):
            if isinstance(event, Received):
                if at_the_edge(event.last_tick, freshness):
                    return False
                fresh = freshness.judge(event.seq, event.last_tick)
                rig.run_to(event.last_tick + CHARACTER + LOOKING)
                _same(rig, decoder, freshness)
                _same_frame(rig, event, n, fresh)
    rig.run_to(max(rig.line_free, rig.now) + 6 * CHARACTER)
    _same(rig, decoder, freshness)
    return True


def _same(rig, decoder, freshness):
    expected = (freshness.accepted, decoder.rejected, freshness.stale)
    assert rig.counters == expected, f"tick {rig.now}: firmware counts {rig.counters}, Python {expected}"


def _same_frame(rig, event, n, fresh):
    address = iram("_body")
    body = bytes(rig.cpu.peek_iram(address + place) for place in range(downlink(n).body_size))
    assert body == event.body, f"firmware has {body.hex(' ')}, Python {event.body.hex(' ')}"
    assert not fresh or rig.u8("_last_hdr") == event.body[0]


def main():
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    done = cut = 0
    while done < frames:
        n = 3 if seed % 2 else 5
        try:
            whole = compare(drawn_stream(seed, n, FRAMES_PER_RIG), n)
        except AssertionError as error:
            print(f"firmware and Python differ: seed {seed}: {error}")
            return 1
        done += FRAMES_PER_RIG * whole
        cut += not whole
        seed += 1
        if sys.stderr.isatty():
            print(f"\r{done} frames", end="", file=sys.stderr)
    print(
        f"{done} damaged and valid frames: firmware and Python agree ({cut} streams more ended at the 150 ms edge)"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
