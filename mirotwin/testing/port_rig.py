"""The rig of one test at a port: the robots there, which get a stop command at its end."""

from __future__ import annotations

from contextlib import ExitStack
from io import BytesIO
from typing import NoReturn

import pytest

from miro_sim.world.machine import why_not
from mirotwin.desk.guard import DeskOptions
from mirotwin.desk.robot_port import LACKS, port_for_test
from mirotwin.runs.at_port import twin_source
from mirotwin.runs.result import Line, Result
from mirotwin.shell.command import command_line, operand
from mirotwin.shell.outputs import RECORDING
from mirotwin.testing.link import Link
from mirotwin.testing.rig import Left, last_events
from mirotwin.testing.rig_options import RigOptions
from mirotwin.verify.checks.interface import at


class PortRig:
    """Robots at `desk.port`, as a `Rig`. Raises BadInput, and NotObservable for a test that needs more than a port."""

    def __init__(self, options: RigOptions, desk: DeskOptions, name: str) -> None:
        self.spec, self.desk, self.tick = options.spec, desk, -1
        self.notes: list[str] = []
        self.recording = BytesIO()
        self.opened = ExitStack()
        scenario = self.spec.robot_scenario
        source = twin_source(scenario, 0, self.spec.image)  # it may fail: not while the port is open
        self.machine = self.opened.enter_context(port_for_test(desk, scenario, name, self.notes.append))
        self.machine.record(self.recording, source)
        self.links = [Link(self.machine)]

    @property
    def robots(self) -> NoReturn:
        pytest.skip(f"robot: not observable {LACKS['inside']}")

    def close(self) -> None:
        """Stops the robots; nothing is sent afterwards."""
        self.tick = self.machine.tick if self.tick < 0 else self.tick
        self.opened.close()

    def judge(self) -> Result:
        self.close()
        return self.result()

    def result(self) -> Result:
        names = self.spec.scenario.expect
        lines = [why_not(self.machine, f"expectation {name}", "inside") for name in names]
        reported: list[Line] = [("not observable", line) for line in (*lines, *self.notes)]
        return Result(verdict="passed", verdict_lines=reported, tick=self.tick)

    def located(self, caught: BaseException | None, result: Result) -> Result:
        """The result unchanged: a port does not show which C line a robot executes."""
        return result

    def head(self) -> list[str]:
        return [f"scenario {self.spec.scenario.name}, {at(self.tick)}", f"robots at {self.desk.port}"]

    def last_events(self) -> list[str]:
        return last_events(self.machine, self.tick)

    def left(self, caught: BaseException | None, where: str) -> Left:
        """The recording; `replay` compares it with a twin's run."""
        return {RECORDING: self.recording.getvalue()}, [command_line("replay", operand(where))]
