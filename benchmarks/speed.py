"""How fast the CPU is beside ucsim's `s51`, and the robot and the whole loop beside real time:

    python -m benchmarks.speed [--rounds 3]

Three C programs (`programs/`) run to their end on both machines by turns, with a timer interrupt every millisecond
and, on ours, all fault checks. Both must leave the same checksum in RAM. Times are of the simulation alone: "Host
usage" as `s51` prints it, which is wall time, and ours by the same clock; for a machine that is not idle there is
also the ratio of processor times, where the simulator's start (some milliseconds) counts on its side. Each figure
is the best of the rounds. Needs sdcc and s51.
"""

from __future__ import annotations

import argparse
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import geometric_mean
from typing import NamedTuple

from benchmarks.realtime import ratio
from miro_exact import engine
from miro_exact.clock import NEVER_TICK
from miro_robot.board import Board
from miro_robot.firmware import image_path
from miro_robot.harness.recording_bus import RecordingBus
from miro_robot.image import Image, load_hex
from miro_robot.mcs51.cpu import BREAKPOINT, Cpu
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring
from tests.robot.ucsim import s51

PROGRAMS = ("crc", "arithmetic", "mix")
FOLDER = Path(__file__).with_name("programs")
ROBOT_SECONDS = 20
_TICKS_PER_SECOND = 24_000_000
_HOST_USAGE = re.compile(rb"Host usage: ([0-9.]+) sec")
_EXECUTED = re.compile(rb"Inst= (\d+)")


class Run(NamedTuple):
    """One program on one machine."""

    wall_s: float
    processor_s: float
    checksum: bytes
    instructions: int


def compile_program(name: str, folder: Path) -> Image:
    """Its image, with symbols."""
    target = folder / f"{name}.ihx"
    subprocess.run(
        ["sdcc", "-mmcs51", "--model-small", str(FOLDER / f"{name}.c"), "-o", str(target)], check=True
    )
    return load_hex(target)


def address(image: Image, name: str) -> int:
    symbol = image.symbols.find(name)
    assert symbol is not None, f"{image.path} has no {name}"
    return symbol.address


def ours(image: Image) -> Run:
    bus = RecordingBus()
    cpu = Cpu(bus)
    cpu.load(image.code, image.used)
    wall, processor = time.perf_counter(), time.process_time()
    reason = cpu.run_until_any((address(image, "_finish"),), NEVER_TICK)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    if reason != BREAKPOINT or bus.fault_kind:
        sys.exit(f"{image.path.name}: ended with reason {reason} and fault {bus.fault_kind}")
    first = address(image, "_checksum")
    checksum = bytes([cpu.peek_iram(first + place) for place in range(4)])
    return Run(wall, processor, checksum, cpu.instructions)


def ucsims(image: Image) -> Run:
    first = address(image, "_checksum")
    dump = f"dump /b iram {first} {first + 3}"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = s51.run(image.code, [f"run 0 {address(image, '_finish'):#x}", "state", dump])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    usage, executed = _HOST_USAGE.search(output), _EXECUTED.search(output)
    if usage is None or executed is None:
        sys.exit(f"s51 printed something else: {output[-800:]!r}")
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Run(float(usage[1]), processor, s51.Reader(output).raw(dump, 4), int(executed[1]))


def best(runs: list[Run]) -> Run:
    return runs[0]._replace(
        wall_s=min(run.wall_s for run in runs), processor_s=min(run.processor_s for run in runs)
    )


def beside_s51(rounds: int) -> None:
    """The table of the three programs, and the geometric means."""
    walls, processors = [], []
    print("program     million instructions   s51 MIPS   ours MIPS   ratio   of processor times")
    with tempfile.TemporaryDirectory() as folder:
        for name in PROGRAMS:
            image = compile_program(name, Path(folder))
            pairs = [(ucsims(image), ours(image)) for _ in range(rounds)]
            checksums = {run.checksum for pair in pairs for run in pair}
            if len(checksums) != 1:
                sys.exit(f"{name}: the machines disagree, checksums {[sum.hex() for sum in checksums]}")
            theirs, own = (best([pair[side] for pair in pairs]) for side in (0, 1))
            walls.append(theirs.wall_s / own.wall_s)
            processors.append(theirs.processor_s / own.processor_s)
            millions = own.instructions / 1e6
            print(
                f"{name:12}{millions:19.1f}{theirs.instructions / 1e6 / theirs.wall_s:11.2f}"
                f"{millions / own.wall_s:12.1f}{walls[-1]:8.1f}{processors[-1]:21.1f}",
                flush=True,
            )
    print(f"{'geometric mean':55}{geometric_mean(walls):7.1f}{geometric_mean(processors):21.1f}")


def robot_ratio() -> float:
    """Simulated seconds per second of a robot that hears nothing: booted, then mostly idle, its motors off."""
    image = load_hex(image_path())
    board = Board(load_wiring(), Plant(), 0, 3)
    board.cpu.load(image.code, image.used)
    begin = time.perf_counter()
    board.run(ROBOT_SECONDS * _TICKS_PER_SECOND)
    return ROBOT_SECONDS / (time.perf_counter() - begin)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3, help="how often each program runs on each machine")
    rounds = parser.parse_args().rounds
    if engine.active() != "compiled":
        sys.exit("the compiled modules are missing: " + engine.REMEDY)
    beside_s51(rounds)
    robot = max(robot_ratio() for _ in range(rounds))
    print(f"idle robot {robot:14.0f} x real time, simulated seconds per second")
    for name in ("fig6", "fig8"):
        print(f"whole loop, {name} {max(ratio(name, False) for _ in range(rounds)):8.1f} x real time")


if __name__ == "__main__":
    main()
