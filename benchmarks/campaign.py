"""What a campaign costs beside its runs: `python -m benchmarks.campaign --runs 40`.

Prints two ratios. `run`: processor time of one run of a campaign over that of the bare loop of the same world, made in
turns. `parallel`: runs a second of a campaign on two processes over those of two single processes, which do nothing but
these runs, made in turns, too, so that what else the machine does concerns both. On a machine that is busy only the
first says much.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from miro_sim.world.world import World
from mirotwin import campaign
from mirotwin.campaign.single import prepared, run_single
from mirotwin.shell.firmware_image import load_firmware

TEXT = 'scenario = "fig6"\nseeds = "0-9999"\n'
WARM = 8
"""Runs in which processes load what they need."""
ALONE = """
import sys
from benchmarks.campaign import TEXT
from mirotwin import campaign
from mirotwin.campaign.single import run_single
from mirotwin.shell.firmware_image import load_firmware

plan = campaign.parse(TEXT, "benchmark.toml")
first, count = map(int, sys.argv[1:])
run_single(plan.work(first))
print("ready", flush=True)
sys.stdin.readline()
for run in range(first, first + count):
    run_single(plan.work(run))
print("done", flush=True)
"""


def run_ratio(runs: int) -> float:
    """Median over the runs, each of them beside its bare loop."""
    plan = campaign.parse(TEXT, "benchmark.toml")
    run_single(plan.work(runs))
    ratios = []
    for run in range(runs):
        job = plan.work(run)
        began_s = time.process_time()
        run_single(job)
        whole_s = time.process_time() - began_s
        world = World(prepared(job.origin, job.text, job.settings)[0].scenario, job.seed, load_firmware())
        began_s = time.process_time()
        while not world.finished:
            world.step()
        ratios.append(whole_s / (time.process_time() - began_s))
    return statistics.median(ratios)


def together(runs: int) -> float:
    """Runs a second of a campaign on two processes, once they are warm."""
    plan = campaign.parse(TEXT.replace("9999", f"{runs + WARM - 1}"), "benchmark.toml")
    times_s: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        campaign.run(
            plan,
            Path(folder) / "benchmark.parquet",
            campaign.Processes(2),
            on_outcome=lambda tally, outcome: times_s.append(time.perf_counter()),
        )
    return runs / (times_s[-1] - times_s[WARM - 1])


def apart(runs: int) -> float:
    """Runs a second of two processes by themselves, once they are warm."""
    children = [
        subprocess.Popen(
            [sys.executable, "-c", ALONE, f"{first}", f"{runs // 2}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for first in (0, runs // 2)
    ]
    for child in children:
        assert child.stdout is not None
        child.stdout.readline()
    began_s = time.perf_counter()
    for child in children:
        assert child.stdin is not None
        child.stdin.write("\n")
        child.stdin.flush()
    for child in children:
        assert child.stdout is not None
        child.stdout.readline()
    took_s = time.perf_counter() - began_s
    for child in children:
        child.wait()
    return runs / took_s


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--runs", type=int, default=40, help="for each measurement; 40 unless told")
    parser.add_argument("--times", type=int, default=3, help="pairs of parallel measurements; 3 unless told")
    options = parser.parse_args()
    print(f"run: {run_ratio(options.runs):.3f} x the processor time of its loop", flush=True)
    pairs = [(together(options.runs), apart(options.runs)) for _ in range(options.times)]
    for ours, theirs in pairs:
        print(f"parallel: {ours:.2f} against {theirs:.2f} runs/s: {ours / theirs:.3f}")
    print(f"parallel, median: {statistics.median(ours / theirs for ours, theirs in pairs):.3f}")


if __name__ == "__main__":
    main()
