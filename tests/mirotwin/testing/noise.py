"""Slicer noise and no host, through the real firmware, for MINUTES of virtual time.

    python -m tests.mirotwin.testing.noise [MINUTES]

No frame may be accepted, and the firmware's counters must be the Python decoder's. An hour at the symbol level is
`python -m benchmarks.undetected noise`.
"""

import sys
import time

from miro_sim.radio.params import Radio
from mirotwin.testing.bench import MS, Bench


def listen(seconds: int, n: int, seed: int = 0) -> Bench:
    """A robot that heard noise for so long."""
    bench = Bench(n, 0, Radio(bit_error_rate=0.0), seed)
    bench.wait(1000 * seconds * MS)
    return bench


def main() -> None:
    minutes = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for n in (3, 5):
        begun = time.monotonic()
        bench = listen(60 * minutes, n)
        heard, spent = len(bench.heard), time.monotonic() - begun
        print(
            f"N={n}: {minutes} min, {heard} characters, (accepted, rejected, stale) {bench.counters}, {spent:.0f} s"
        )


if __name__ == "__main__":
    main()
