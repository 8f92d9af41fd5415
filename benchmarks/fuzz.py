"""Executions of firmware per second and core, with edges counted and judged: `python -m benchmarks.fuzz`.

The harness alone, by classes of input: 8 random bytes, one accepted frame, a session of 10 frames; and the car of
examples/boards on its board, in runs of 50 ms with characters and distances, without and with the checks of its
scenario. By turns with
restarts of ucsim's `s51` (start, load the image, run to `main`, end): the way to put firmware back that it offers.
Processor time; each figure is the median of the rounds. Needs s51.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median

from miro_exact import engine
from miro_exact.rng import Stream
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_sim.scenario.board_scenario import load_any
from mirotwin.fuzz.board_target import BoardTarget, wired_target
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import RobotTarget, Target
from mirotwin.shell.firmware_image import image_for
from tests.robot.ucsim import s51

CALLS = 400
RANDOM = 64
FRAME = bytes([0, 0x64, 0, 0x9C, 0xFF]) + bytes(8)
SESSION = b"".join(bytes([0, 50 + place, 0, 60 + place, 0]) for place in range(10))


CAR = Path(__file__).parents[1] / "examples" / "boards" / "car" / "stops.scenario.toml"
CAR_INPUTS = [
    b"\x09\0g\x01\0" + distance.to_bytes(2, "little") + b"\x0a\x20\x09\0?\x0a\xb8"
    for distance in (0, 2_560, 25_345, 51_200)
]
"""`g`, a distance after it, `?` 7 ms later, and 40 ms of silence."""


def car(checks: bool) -> BoardTarget:
    text = load_any(str(CAR))
    tables = {key: value for key, value in (text.tables or {}).items() if checks or key != "expect"}
    image = str(image_for(text).path)
    target = wired_target(
        TargetSpec(board="wired", image=image, after_ticks=0, parameters={"tables": tables, "steps": 1})
    )
    target.run(CAR_INPUTS[0])
    assert 0.049 < (target.end_tick() - target.harness.begin_tick) / text.scenario.clock < 0.051
    return target


def classes(image: Image) -> dict[str, tuple[Target, list[bytes]]]:
    """Name -> target and its inputs."""
    draws = Stream(1997, "benchmarks.fuzz")
    random = [bytes(draws.u32(8 * one + place) & 0xFF for place in range(8)) for one in range(RANDOM)]
    return {
        "8 random bytes": (RobotTarget(image, "bytes"), random),
        "one accepted frame": (RobotTarget(image, "frames"), [FRAME]),
        "session of 10 frames": (RobotTarget(image, "session"), [SESSION]),
        "car, 50 ms": (car(False), CAR_INPUTS),
        "car, 50 ms, [expect]": (car(True), CAR_INPUTS),
    }


def execution_s(target: Target, inputs: list[bytes]) -> float:
    """Processor seconds of an execution."""
    begin = time.process_time()
    for call in range(CALLS):
        target.run(inputs[call % len(inputs)])
    return (time.process_time() - begin) / CALLS


def restart_s(image: Image) -> float:
    """Processor seconds of `s51` from its start to `main`."""
    main = image.symbols.find("_main")
    assert main is not None
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    s51.run(image.code[: image.used[-1][1]], [f"run 0 {main.address:#x}"])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=11)
    rounds = parser.parse_args().rounds
    if engine.active() != "compiled":
        sys.exit("the compiled modules are missing: " + engine.REMEDY)
    image = load_hex(image_path())
    tasks: dict[str, Callable[[], float]] = {"restart of s51": partial(restart_s, image)}
    for name, (target, inputs) in classes(image).items():
        if any(target.run(data) for data in inputs) or (
            isinstance(target, RobotTarget) and inputs[0] in (FRAME, SESSION) and not target.accepted
        ):
            sys.exit(f"{name}: {target.failure}, or no frame accepted")
        tasks[name] = partial(execution_s, target, inputs)
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            times[name].append(task())
    restart = median(times["restart of s51"])
    print(f"{'':22}  executions/s          us   beside a restart of s51")
    for name, seconds in times.items():
        one = median(seconds)
        print(f"{name:22}{1 / one:14.0f}{1e6 * one:12.1f}{restart / one:14.0f} x")


if __name__ == "__main__":
    main()
