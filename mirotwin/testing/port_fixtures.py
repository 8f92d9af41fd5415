"""The pytest fixtures for a robot at a port: `world` and `link` as a PC has them; what no port shows is skipped.

pytest --mirotwin-port=/dev/ttyUSB0 --mirotwin-allow-motion
"""

from __future__ import annotations

from collections.abc import Generator
from functools import partial
from typing import Any, NoReturn

import pytest

from miro_exact.bad_input import BadInput
from miro_sim.world.machine import NotObservable, why_not
from miro_sim.world.waits import WaitExpired
from miro_sim.world.world import World
from mirotwin.desk.robot_port import LACKS, RobotPort, port_for_test
from mirotwin.testing.link import Link
from mirotwin.testing.rig_options import rig_options
from mirotwin.testing.session_options import desk_of
from mirotwin.testing.waiting import WaitFailed

NAME = "mirotwin-port"
"""Of the plugin that has these fixtures."""
OF_A_TWIN = {*dir(World), *World.STATE, *World.NOT_STATE}


class PortFixtures:
    """A plugin whose fixtures stand in for those of the twin. The port is opened for each test."""

    def __init__(self, config: pytest.Config) -> None:
        self.desk = desk_of(config)

    def pytest_report_header(self) -> str:
        return f"mirotwin: robots at {self.desk.port}; what a port does not show is skipped"

    @pytest.fixture
    def world(self, request: pytest.FixtureRequest, _mirotwin_seed: int) -> Generator[RobotPort, None, None]:
        """The robots at the port, standing, and told to stand again when the test is over."""
        try:
            marks = request.node.iter_markers("mirotwin")
            asked = rig_options(marks, request.node.path.parent, None, _mirotwin_seed).spec
            note = partial(request.node.add_report_section, "call", "mirotwin")
            with port_for_test(self.desk, asked.scenario, request.node.name, note) as port:
                for name in asked.scenario.expect:
                    note(why_not(port, f"check {name}", "inside"))
                yield port
        except NotObservable as error:
            pytest.skip(str(error))
        except BadInput as error:
            raise pytest.fail.Exception(str(error), pytrace=False) from None

    @pytest.fixture
    def links(self, world: RobotPort) -> list[Link]:
        return [Link(world)]

    @pytest.fixture
    def robots(self) -> NoReturn:
        pytest.skip(f"robot: not observable {LACKS['inside']}")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, Any, Any]:
        """What turns out to need a robot's inside is skipped, too; a wait that ran out is told in words."""
        try:
            return (yield)
        except NotObservable as error:
            pytest.skip(str(error))
        except AttributeError as error:
            if isinstance(error.obj, RobotPort) and error.name in OF_A_TWIN:
                pytest.skip(f"world.{error.name}: not observable on a port: only a twin has it")
            raise
        except WaitExpired as error:
            world = getattr(item, "funcargs", {})["world"]
            raise WaitFailed.of(error, world).with_traceback(error.__traceback__) from None
