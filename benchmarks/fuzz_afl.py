"""Executions of firmware per second as afl-fuzz says them: `python -m benchmarks.fuzz_afl`.

One job, for each class of `benchmarks.fuzz`; afl-fuzz is held to the length of the class. Beside its own figure, which
is in wall time and says nothing on a machine that does other things, stands the processor time of afl-fuzz and of the
target process. Needs AFL++.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.fuzz import classes
from miro_exact import engine
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from mirotwin.fuzz.afl.run import AflRun
from mirotwin.fuzz.engine import EngineInput, write_seeds
from mirotwin.fuzz.making import make_target
from mirotwin.fuzz.spec import TargetSpec

WARM = 500
"""Executions before the clock starts: seeds are calibrated."""


def processor_s(process: int) -> float:
    """What a process has used of processors (Linux, sched-stats.rst: the first number is nanoseconds)."""
    return int(Path(f"/proc/{process}/schedstat").read_text().split()[0]) / 1e9


def child_of(process: int) -> int:
    """The only child of a process."""
    return int(Path(f"/proc/{process}/task/{process}/children").read_text().split()[0])


def last_said(job: Path) -> dict[str, str]:
    """The last whole row of what afl-fuzz writes about itself, by the names of its columns."""
    head, *rows = (job / "plot_data").read_text().split("\n")[:-1]
    return dict(zip(head.removeprefix("# ").split(", "), rows[-1].split(", "), strict=True))


def measured(folder: Path, spec: TargetSpec, inputs: list[bytes], wall_s: float) -> str:
    """A row of the table."""
    write_seeds(folder / "seeds", inputs)
    lengths = min(map(len, inputs)), max(map(len, inputs))
    given = EngineInput(spec.text(), folder / "seeds", folder / "out", lengths=lengths)
    with AflRun(given, make_target(spec)) as run:
        while run.progress().executions < WARM:
            time.sleep(0.1)
        both = run.jobs[0].process.pid, child_of(run.jobs[0].process.pid)
        began, before = run.progress(), [processor_s(process) for process in both]
        time.sleep(wall_s)
        ended, after = run.progress(), [processor_s(process) for process in both]
    made = ended.executions - began.executions
    afl_us, target_us = (1e6 * (end - begin) / made for begin, end in zip(before, after, strict=True))
    said = last_said(run.jobs[0].folder)
    per_core = 1e6 / (afl_us + target_us)
    cells = f"{float(said['execs_per_sec']):12.0f}{per_core:16.0f}{afl_us:12.1f}{target_us:12.1f}"
    return f"{cells}{said['edges_found']:>7}{said['saved_crashes']:>9}"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20.0, help="wall time for each class")
    wall_s = parser.parse_args().seconds
    if engine.active() != "compiled":
        sys.exit("the compiled modules are missing: " + engine.REMEDY)
    times = f"{'per wall s':>12}{'per core s':>16}{'afl us':>12}{'target us':>12}"
    print(f"{'':22}{times}{'edges':>7}{'crashes':>9}")
    for name, (target, inputs) in classes(load_hex(image_path())).items():
        with TemporaryDirectory() as folder:
            row = measured(Path(folder), TargetSpec(input=target.input), inputs, wall_s)
        print(f"{name:22}{row}", flush=True)


if __name__ == "__main__":
    main()
