"""The compiled decoder is fast enough for any capture, and garbage costs no more than frames.

CPU time, best of a few: `python -m benchmarks.codec` measures properly and beside others.
"""

import pytest

from benchmarks.codec import best_time, own_jobs
from miro_exact import engine

SLOWEST_MB_S = 20


@pytest.mark.skipif(engine.active() != "compiled", reason="the compiled decoder is not installed")
def test_twenty_megabytes_a_second_of_frames_of_noise_and_of_the_worst_input():
    rates = {
        name: length / best_time(job) / 1e6 for name, length, job in own_jobs(500_000) if "decoder" in name
    }
    assert len(rates) == 5
    assert min(rates.values()) >= SLOWEST_MB_S, rates
