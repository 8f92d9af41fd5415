"""The child of `benchmarks.against`: measures one tree's packages, in its own process, whenever it is asked.

A line on stdin is a task's name; the answer on stdout is one line: processor seconds of one execution, and what the
result of both trees has to share.
"""

from __future__ import annotations

import io
import sys
import time
from collections.abc import Callable, Iterator
from copy import copy
from importlib import import_module
from importlib.util import find_spec
from itertools import cycle
from typing import Any

SCENARIO = "fig6"
MANY = 200
"""Executions of a task that takes microseconds."""
WARM_PERIODS = 30

NEW = {
    "runner": "mirotwin.rerun.runner",
    "recording": "mirotwin.recording.recorder",
    "scenario": "miro_sim.scenario.file",
    "world": "miro_sim.world.world",
}
OLD = {**NEW, "runner": "mirotwin.rerun.runner"}
"""Before `mirotwin` became a top folder."""


def without_editable_installs() -> None:
    """Takes away the finders by which an editable install would lend this tree's packages to another one."""
    sys.meta_path[:] = [
        finder for finder in sys.meta_path if not getattr(finder, "__module__", "").startswith("__editable__")
    ]


class Tasks:
    """What is measured. Each method returns (processor seconds of one execution, result to compare)."""

    def __init__(self) -> None:
        layout = NEW if find_spec("mirotwin.rerun") else OLD
        self.parts: dict[str, Any] = {name: import_module(module) for name, module in layout.items()}
        self.load_hex = import_module("miro_robot.image").load_hex
        self.image_path = import_module("miro_robot.firmware").image_path
        load = self.parts["scenario"].load
        self.text = load(SCENARIO)
        if 'kind = "pixels"' in self.text.text:  # the same run as in trees that had no pictures yet
            self.text = load(SCENARIO, ('camera={kind="gaussian"}',))
        self.image = self.load_hex(self.image_path())
        self.warm: Any = self.new_world()
        for _ in range(WARM_PERIODS):
            self.warm.step()

    def new_world(self) -> Any:
        return self.parts["world"].World(self.text.scenario, 0, self.image)

    def recorded(self) -> tuple[float, str]:
        """The loop over control periods with the default recording into memory."""
        recording, world = self.parts["recording"], self.new_world()
        source = recording.Source(
            SCENARIO, self.text.text, 0, self.image.path.read_bytes(), self.image.sha256
        )
        with recording.Recorder(io.BytesIO(), source) as recorder:
            return _timed(lambda: self.parts["runner"].run(world, recorder)), _ended(world)

    def unrecorded(self) -> tuple[float, str]:
        world = self.new_world()
        return _timed(lambda: self.parts["runner"].run(world)), _ended(world)

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
    counters = world.counters()
    return repr((counters["link"], counters["firmware"], world.last.robots[0].truth))


def _timed(work: Callable[[], object], times: int = 1) -> float:
    begin = time.process_time()
    for _ in range(times):
        work()
    return (time.process_time() - begin) / times


def main() -> None:
    without_editable_installs()
    tasks = Tasks()
    print("ready", flush=True)
    for line in sys.stdin:
        elapsed_s, result = getattr(tasks, line.strip())()
        print(elapsed_s, result, flush=True)


if __name__ == "__main__":
    main()
