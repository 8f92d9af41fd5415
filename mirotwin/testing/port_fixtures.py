"""The pytest fixtures for a robot at a port: `world` and `link` as a PC has them; what no port shows is skipped.

pytest --mirotwin-port=/dev/ttyUSB0 --mirotwin-allow-motion
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any, NoReturn, cast

import pytest

from miro_exact.bad_input import BadInput
from miro_sim.world.waits import WaitExpired
from mirotwin.desk.guard import DeskOptions
from mirotwin.desk.robot_port import NotObservable, RobotPort, check_observable
from mirotwin.testing.link import Link
from mirotwin.testing.waiting import WaitFailed
from mirotwin.verify.rig_options import rig_options

if TYPE_CHECKING:
    from miro_sim.world.world import World

NAME = "mirotwin-port"
"""Of the plugin that has these fixtures."""


def desk_of(config: pytest.Config) -> DeskOptions:
    """What the command line says of a port."""
    given = {name: config.getoption(f"mirotwin_{name}", None) for name in DeskOptions.__struct_fields__}
    return DeskOptions(**{name: value for name, value in given.items() if value is not None})


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
            asked = rig_options(marks, request.node.path.parent, None, _mirotwin_seed)
            check_observable(asked.scenario)
            if asked.scenario.expect:
                names = ", ".join(asked.scenario.expect)
                request.node.add_report_section("call", "mirotwin", f"{names}: not observable on a port")
            with RobotPort(self.desk, asked.scenario, request.node.name) as port:
                port.greet()
                yield port
        except NotObservable as error:
            pytest.skip(str(error))
        except BadInput as error:
            raise pytest.fail.Exception(str(error), pytrace=False) from None

    @pytest.fixture
    def links(self, world: RobotPort) -> list[Link]:
        return [Link(cast("World", world))]

    @pytest.fixture
    def robots(self) -> NoReturn:
        pytest.skip("not observable on a port: the inside of a robot")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, Any, Any]:
        """What turns out to need a robot's inside is skipped, too; a wait that ran out is told in words."""
        try:
            return (yield)
        except NotObservable as error:
            pytest.skip(str(error))
        except WaitExpired as error:
            world = getattr(item, "funcargs", {})["world"]
            raise WaitFailed.of(error, world).with_traceback(error.__traceback__) from None
