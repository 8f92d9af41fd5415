"""pytest plugin: a world for each test, and firmware line coverage of a session.

    def test_a_poll_is_answered(link, robot):
        link.poll(slot=0)
        answer = link.expect(Telemetry, within=ms(40))

    pytest --mirotwin-firmware=mine.ihx --mirotwin-seed=7 --firmware-coverage=fw.info

Sessions that do not use it import no other module of ours.
"""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from mirotwin.testing.session_options import (
    add_options,
    check_options,
    first_seed,
    number_option,
)

if TYPE_CHECKING:
    from miro_sim.world.machine import Machine
    from mirotwin.testing.board import BoardUnderTest, SerialUnderTest
    from mirotwin.testing.link import Link
    from mirotwin.testing.port_rig import PortRig
    from mirotwin.testing.rig import Rig
    from mirotwin.testing.robot import RobotUnderTest

_SEED, _RIG = "_mirotwin_seed", "mirotwin_rig"
NO_BOARD = (
    'the test is of robots: mark it @pytest.mark.mirotwin(board="NAME.board.toml", firmware="IMAGE.hex")'
)


def pytest_addoption(parser: pytest.Parser) -> None:
    add_options(parser)


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "mirotwin(scenario=, board=, settings=, firmware=, seed=, expect=, boot=): the world of the test (mirotwin)",
    )
    check_options(config)
    if config.getoption("--mirotwin-sanitize") and not config.getoption("--collect-only"):
        from mirotwin.testing.session_sanitizer import SanitizedSession

        config.pluginmanager.register(SanitizedSession(config), "mirotwin-sanitizer")
    if config.getoption("--firmware-coverage") and not config.getoption("--collect-only"):
        from mirotwin.testing.session_coverage import FirmwareCoverage

        config.pluginmanager.register(FirmwareCoverage(config), "mirotwin-firmware-coverage")


def pytest_report_header(config: pytest.Config) -> str | None:
    port = config.getoption("--mirotwin-port")
    return f"mirotwin: robots at {port}; what a port does not show is skipped" if port else None


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """A scenario file is a test."""
    if not file_path.name.endswith(".scenario.toml"):
        return None
    from mirotwin.testing.scenario_items import ScenarioFile

    return ScenarioFile.from_parent(parent, path=file_path)


# Which tests run, and with which seed


@pytest.hookimpl(trylast=True)
def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    repeat = number_option(metafunc.config, "repeat", 1)
    if repeat > 1 and _SEED in metafunc.fixturenames:
        first = first_seed(metafunc.definition)
        seeds = range(first, first + repeat)
        metafunc.parametrize(_SEED, seeds, indirect=True, ids=[f"seed{seed}" for seed in seeds])


@pytest.fixture(name=_SEED)
def _seed_of_the_test(request: pytest.FixtureRequest) -> int:
    return int(request.param) if hasattr(request, "param") else first_seed(request.node)


# Fixtures


@pytest.fixture(name=_RIG)
def _rig_of_the_test(
    request: pytest.FixtureRequest, _mirotwin_seed: int
) -> Generator[Rig | PortRig, None, None]:
    """The machine of the test and all that belongs to it."""
    from mirotwin.testing import items

    rig = items.rig_for(request.node, _mirotwin_seed)
    yield rig
    rig.close()


@pytest.fixture
def world(mirotwin_rig: Rig | PortRig) -> Machine:
    """A world of the test's own: one robot that is up, a silent host, an ideal radio; see the marker `mirotwin`. At a
    port: the robots there.
    """
    return mirotwin_rig.machine


@pytest.fixture
def links(mirotwin_rig: Rig | PortRig) -> list[Link]:
    """The hosts' ends of all networks."""
    return mirotwin_rig.links


@pytest.fixture
def link(links: list[Link]) -> Link:
    """The host's end of the first network: sends, polls, expects."""
    if not links:
        pytest.fail("the test is of a board, which has no radio: use the fixtures board and serial", False)
    return links[0]


@pytest.fixture
def robots(mirotwin_rig: Rig | PortRig) -> list[RobotUnderTest]:
    """All robots, by network and slot."""
    return mirotwin_rig.robots


@pytest.fixture
def robot(robots: list[RobotUnderTest]) -> RobotUnderTest:
    """The first robot: wheels, memory, breakpoints, switches."""
    if not robots:
        pytest.fail("the test is of a board, and no robot: use the fixtures board and serial", False)
    return robots[0]


@pytest.fixture
def board(mirotwin_rig: Rig | PortRig) -> BoardUnderTest:
    """The board of the marker `mirotwin(board=, firmware=)`: puts, presses, pins, values, waits, memory."""
    device: BoardUnderTest | None = getattr(mirotwin_rig, "board", None)
    if device is None:
        pytest.fail(NO_BOARD, False)
    return device


@pytest.fixture
def serial(mirotwin_rig: Rig | PortRig) -> SerialUnderTest:
    """A terminal at the board's serial port: write, expect, read."""
    device: SerialUnderTest | None = getattr(mirotwin_rig, "serial", None)
    if device is None:
        pytest.fail(NO_BOARD, False)
    return device


# Judging and reporting


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    """Judges a completed test by the checks."""
    if _RIG not in getattr(item, "funcargs", ()):
        return (yield)
    from mirotwin.testing import items

    try:
        result = yield
    except items.REPORTED as error:
        shown = items.as_the_test_sees_it(item, error)
        if shown is error:
            raise
        raise shown from None
    items.judge(item)
    return result


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if call.when != "setup" and _RIG in getattr(item, "funcargs", ()):
        from mirotwin.testing import items

        if call.when == "call":
            items.tell(item, report, call.excinfo)
        else:
            items.let_go(item)
    return report
