"""The child of `benchmarks.against`: measures one tree's packages, in its own process, whenever it is asked.

A line on stdin is a task's name; the answer on stdout is one line: processor seconds of one execution, and what the
result of both trees has to share.
"""

from __future__ import annotations

import io
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from copy import copy
from importlib import import_module
from importlib.util import find_spec
from itertools import cycle
from pathlib import Path
from typing import Any

SCENARIO = "fig6"
GAUSSIAN = 'camera={kind="gaussian"}'
TEAMS_PERIODS = 60
"""Control periods of two teams: two simulated seconds."""
FRAME = bytes([0, 0x64, 0, 0x9C, 0xFF]) + bytes(8)
"""A team frame as the fuzzer's target `frames` reads it; the firmware accepts it."""
MANY = 200
"""Executions of a task that takes microseconds."""
WARM_PERIODS = 30

PARTS = {
    "runner": ("mirotwin.runs.runner", "mirotwin.recording.runner"),
    "recording": ("mirotwin.recording.recorder",),
    "scenario": ("miro_sim.scenario.file",),
    "world": ("miro_sim.world.world",),
    "fuzz": ("mirotwin.fuzz.target",),
}
"""Where each part is, and where it was before."""


def without_editable_installs() -> None:
    """Takes away the finders by which an editable install would lend this tree's packages to another one."""
    sys.meta_path[:] = [
        finder for finder in sys.meta_path if not getattr(finder, "__module__", "").startswith("__editable__")
    ]


def _there(names: tuple[str, ...]) -> str:
    """The first of these modules that the checkout has."""
    for name in names:
        with suppress(ModuleNotFoundError):  # a package above it is not there
            if find_spec(name):
                return name
    raise ModuleNotFoundError(names[0])


class Tasks:
    """What is measured. Each method returns (processor seconds of one execution, result to compare)."""

    def __init__(self, folder: Path) -> None:
        self.parts: dict[str, Any] = {name: import_module(_there(names)) for name, names in PARTS.items()}
        self.load_hex = import_module("miro_robot.image").load_hex
        self.image_path = import_module("miro_robot.firmware").image_path
        load = self.parts["scenario"].load
        self.pixels, self.gaussian = load(SCENARIO), load(SCENARIO, (GAUSSIAN,))
        self.teams = load(str(folder / "examples" / "two_teams.toml"))
        self.image = self.load_hex(self.image_path())
        self.warm: Any = self.new_world()
        for _ in range(WARM_PERIODS):
            self.warm.step()
        RobotTarget = self.parts["fuzz"].RobotTarget
        draws = import_module("miro_exact.rng").Stream(1997, "benchmarks.fuzz")
        self.random = [bytes(draws.u32(8 * one + place) & 0xFF for place in range(8)) for one in range(64)]
        self.bytes, self.frames = RobotTarget(self.image, "bytes"), RobotTarget(self.image, "frames")

    def new_world(self, text: Any = None) -> Any:
        return self.parts["world"].World((text or self.gaussian).scenario, 0, self.image)

    def recorded(self) -> tuple[float, str]:
        """The loop over control periods with the default recording into memory."""
        return self._recorded(self.gaussian)

    def recorded_pixels(self) -> tuple[float, str]:
        return self._recorded(self.pixels)

    def _recorded(self, text: Any) -> tuple[float, str]:
        recording, world = self.parts["recording"], self.new_world(text)
        make = getattr(recording, "RunSource", None) or recording.Source
        source = make(SCENARIO, text.text, 0, self.image.path.read_bytes(), self.image.sha256)
        with recording.Recorder(io.BytesIO(), source) as recorder:
            return _timed(lambda: self.parts["runner"].run(world, recorder)), _ended(world)

    def unrecorded(self) -> tuple[float, str]:
        world = self.new_world()
        return _timed(lambda: self.parts["runner"].run(world)), _ended(world)

    def unrecorded_pixels(self) -> tuple[float, str]:
        world = self.new_world(self.pixels)
        return _timed(lambda: self.parts["runner"].run(world)), _ended(world)

    def two_teams(self) -> tuple[float, str]:
        """A control period of six robots before two cameras."""
        world = self.new_world(self.teams)
        return _timed(world.step, TEAMS_PERIODS), _ended(world)

    def harness_bytes(self) -> tuple[float, str]:
        """The fuzzer's target with 8 random bytes."""
        inputs = cycle(self.random)
        return _timed(lambda: self.bytes.run(next(inputs)), MANY), ""

    def harness_frame(self) -> tuple[float, str]:
        """The fuzzer's target with a frame that the firmware accepts."""
        return _timed(lambda: self.frames.run(FRAME), MANY), str(self.frames.accepted)

    def construction(self) -> tuple[float, str]:
        return _timed(self.new_world), ""

    def known_image(self) -> tuple[float, str]:
        """`load_hex` of an image that this process has read before."""
        return _timed(lambda: self.load_hex(self.image_path())), self.image.sha256

    def save(self) -> tuple[float, str]:
        return _timed(self.warm.save, MANY), ""

    def load(self) -> tuple[float, str]:
        saved = self.warm.save()
        return _timed(lambda: self.warm.load(saved), MANY), ""

    def load_other(self) -> tuple[float, str]:
        """Other bytes than last time, so that nothing is known of them."""
        copies = _copies(self.warm.save())
        return _timed(lambda: self.warm.load(next(copies)), MANY), ""

    def board_snapshot(self) -> tuple[float, str]:
        return _timed(self._state_of_board()[0], MANY), ""

    def board_restore(self) -> tuple[float, str]:
        save, load = self._state_of_board()
        state = save()
        return _timed(lambda: load(state), MANY), ""

    def board_restore_other(self) -> tuple[float, str]:
        save, load = self._state_of_board()
        copies = _copies(save())
        return _timed(lambda: load(next(copies)), MANY), ""

    def _state_of_board(self) -> tuple[Callable[[], Any], Callable[[Any], object]]:
        """What saves the board's state, and what puts it back: a `Flat`, before there were tables its own methods."""
        if find_spec("miro_exact") is None or find_spec("miro_exact.state") is None:
            return self._board().snapshot, self._board().restore
        flat = import_module("miro_exact.state").Flat(self._board())
        return flat.save, flat.load

    def _board(self) -> Any:
        return self.warm.networks[0].robots[0].board


def _copies(state: Any) -> Iterator[Any]:
    """Two equal states in turn."""
    return cycle((state, bytes(bytearray(state)) if isinstance(state, bytes) else copy(state)))


def _ended(world: Any) -> str:
    """How a run ended, whatever its digest is made of."""
    sent = [(network.frames_sent, network.bit_errors) for network in world.networks]
    robots = [robot for network in world.networks for robot in network.robots]
    counted = [(*map(robot.counter, range(3)), robot.board.fault_count) for robot in robots]
    executed = [(cpu.instructions, cpu.cycles, cpu.idle_cycles) for cpu in (one.board.cpu for one in robots)]
    return repr((sent, counted, executed, world.last.robots[0].truth))


def _timed(work: Callable[[], object], times: int = 1) -> float:
    begin = time.process_time()
    for _ in range(times):
        work()
    return (time.process_time() - begin) / times


def main() -> None:
    without_editable_installs()
    tasks = Tasks(Path(sys.argv[1]))
    print("ready", flush=True)
    for line in sys.stdin:
        elapsed_s, result = getattr(tasks, line.strip())()
        print(elapsed_s, result, flush=True)


if __name__ == "__main__":
    main()
