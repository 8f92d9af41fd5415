"""Feeds random, damaged and valid streams to the real firmware and to the Python decoder, and compares.

    python -m tests.robot.firmware.differential [FRAMES] [SEED]

The test run does a CI-sized part of the same (test_reception.py); this goes on to any number of streams of one
frame with its garbage each, 100 000 unless told. Exit code 1 at the first difference, with the seed that shows it.
"""

import sys

from tests.robot.firmware.rig import CHARACTER, Rig
from tests.robot.firmware.test_reception import python_receives, stream

FRAMES_PER_RIG = 100


def agree(seed: int) -> bool | None:
    """Whether both accept, reject and call stale the same; None if a frame came right at the 150 ms edge."""
    n = 3 if seed % 2 else 5
    rig = Rig(n=n)
    symbols = [
        (byte, good, tick + rig.now + CHARACTER) for byte, good, tick in stream(seed, n, FRAMES_PER_RIG)
    ]
    for symbol in symbols:
        rig.send_symbol(symbol)
    expected = python_receives(symbols, n)
    if expected is None:
        return None
    counters, last_seq = expected
    rig.run_to(rig.line_free + 6 * CHARACTER)
    return rig.counters == counters and (last_seq is None or rig.u8("_last_hdr") & 63 == last_seq)


def main() -> int:
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    done = left_out = 0
    while done < frames:
        outcome = agree(seed)
        if outcome is False:
            print(f"firmware and Python differ: seed {seed}")
            return 1
        if outcome is None:
            left_out += 1
        else:
            done += FRAMES_PER_RIG
        seed += 1
        if sys.stderr.isatty():
            print(f"\r{done} frames", end="", file=sys.stderr)
    print(
        f"{done} damaged and valid frames: firmware and Python agree ({left_out} streams left out at the 150 ms edge)"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
