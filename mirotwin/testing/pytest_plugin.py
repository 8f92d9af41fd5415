"""pytest plugin: a world for each test, and which lines of the firmware a session ran.

    def test_a_poll_is_answered(link, robot):
        link.poll(slot=0)
        answer = link.expect(Telemetry, within=ms(40))

    pytest --mirotwin-firmware=mine.ihx --mirotwin-seed=7 --firmware-coverage=fw.info

Sessions that use none of it import nothing else of ours.
"""

from __future__ import annotations

import os
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from miro_sim.world.world import World
    from mirotwin.testing.link import Link
    from mirotwin.testing.rig import Rig
    from mirotwin.testing.robot import RobotUnderTest

_INI = {
    "mirotwin_firmware": "the firmware of the tests (default: the robot's own)",
    "mirotwin_seed": "the seed of tests whose marker names none (default: 0)",
    "mirotwin_artifacts": "where failed tests leave their folders",
    "mirotwin_repeat": "how often each test runs, with seeds that count up",
}
_SEED, _RIG = "_mirotwin_seed", "mirotwin_rig"


_OPTIONS: tuple[tuple[str, str, type, str], ...] = (
    ("--mirotwin-firmware", "IMAGE.ihx", str, _INI["mirotwin_firmware"]),
    ("--mirotwin-seed", "N", int, "the seed of all tests"),
    ("--mirotwin-artifacts", "DIR", str, _INI["mirotwin_artifacts"]),
    ("--mirotwin-repeat", "N", int, _INI["mirotwin_repeat"]),
    ("--mirotwin-pages", "", bool, "make the page of each failed test, too: some seconds each"),
    ("--mirotwin-port", "URL", str, "run against the robots at this port, not against their twin"),
    ("--mirotwin-allow-motion", "", bool, "with a port: send what moves a robot"),
    ("--mirotwin-max-speed", "M_S", float, "with a port: refuse faster wheels (default: 0.5)"),
    (
        "--firmware-coverage",
        "FILE.info",
        str,
        "write which lines of the firmware the tests ran, as an lcov tracefile",
    ),
    ("--firmware-image", "IMAGE.ihx", str, "the image to watch (default: the robot's own)"),
    ("--firmware-sources", "DIR", list, "where its C files are"),
    ("--firmware-coverage-fail-under", "PERCENT", float, "fail when fewer of the lines ran"),
)
"""Name, what stands for its value in the help, type (bool: a switch; list: may be repeated), help."""


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("mirotwin", "worlds for tests, firmware coverage (mirotwin)")
    for name, metavar, kind, what in _OPTIONS:
        if kind is bool:
            group.addoption(name, action="store_true", help=what)
        elif kind is list:
            group.addoption(name, metavar=metavar, action="append", default=[], help=what)
        else:
            group.addoption(name, metavar=metavar, type=kind, help=what)
    for name, what in _INI.items():
        parser.addini(name, what, type="string")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "mirotwin(scenario=, settings=, firmware=, seed=, expect=, boot=): the world of the test (mirotwin)",
    )
    _check_options(config)
    if config.getoption("--mirotwin-port"):
        workers = config.getoption("numprocesses", None) or 0
        if workers > 1:
            raise pytest.UsageError(f"--mirotwin-port: {workers} workers cannot share one port; give -n 0")
        from mirotwin.testing import port_fixtures

        config.pluginmanager.register(port_fixtures.PortFixtures(config), port_fixtures.NAME)
    share = config.getoption("--firmware-coverage-fail-under") or 0.0
    if not 0.0 <= share <= 100.0:
        raise pytest.UsageError(f"--firmware-coverage-fail-under: {share} is no percentage; give 0 to 100")
    if share and not config.getoption("--firmware-coverage"):
        raise pytest.UsageError("--firmware-coverage-fail-under: goes with --firmware-coverage=FILE.info")
    if config.getoption("--firmware-coverage") and not config.getoption("--collect-only"):
        from mirotwin.testing.session_coverage import FirmwareCoverage

        config.pluginmanager.register(FirmwareCoverage(config), "mirotwin-firmware-coverage")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """A scenario file is a test."""
    if not file_path.name.endswith(".scenario.toml"):
        return None
    from mirotwin.testing.scenario_items import ScenarioFile

    return ScenarioFile.from_parent(parent, path=file_path)


# Options


def _check_options(config: pytest.Config) -> None:
    if config.getoption("--mirotwin-port") == "":
        raise pytest.UsageError("--mirotwin-port: is empty; name the port of the robots, or leave it out")
    if number_option(config, "repeat", 1) < 1:
        raise pytest.UsageError(
            f"--mirotwin-repeat: {number_option(config, 'repeat', 1)} is too few; give 1 or more"
        )
    if number_option(config, "seed", 0) < 0:
        raise pytest.UsageError(f"--mirotwin-seed: {number_option(config, 'seed', 0)}: give 0 or more")
    artifacts = path_option(config, "artifacts")
    if artifacts is not None and os.path.exists(artifacts) and not os.path.isdir(artifacts):
        raise pytest.UsageError(f"--mirotwin-artifacts: {artifacts} is no folder")
    firmware = path_option(config, "firmware")
    if firmware is not None:
        from mirotwin.shell.firmware_image import load_firmware

        try:
            load_firmware(firmware)
        except ValueError as error:
            raise pytest.UsageError(f"--mirotwin-firmware: {error}") from None


def number_option(config: pytest.Config, name: str, default: int) -> int:
    """An option, else what the ini file says."""
    given = config.getoption(f"--mirotwin-{name}")
    if given is not None:
        return int(given)
    text = config.getini(f"mirotwin_{name}") or str(default)
    try:
        return int(text)
    except ValueError:
        raise pytest.UsageError(f"mirotwin_{name}: {text!r} is no whole number") from None


def path_option(config: pytest.Config, name: str) -> Path | None:
    """The same for paths: an option's goes from where pytest was called, an ini file's from where that lies."""
    given = config.getoption(f"--mirotwin-{name}")
    if given is not None:
        return Path(config.invocation_params.dir, given)
    text = config.getini(f"mirotwin_{name}")
    return Path(config.rootpath, text) if text else None


# Which tests run, and with which seed


@pytest.hookimpl(trylast=True)
def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    repeat = number_option(metafunc.config, "repeat", 1)
    if repeat > 1 and _SEED in metafunc.fixturenames:
        first = _first_seed(metafunc.definition)
        seeds = range(first, first + repeat)
        metafunc.parametrize(_SEED, seeds, indirect=True, ids=[f"seed{seed}" for seed in seeds])


def _first_seed(item: pytest.Item) -> int:
    """From the command line, else from the innermost marker that has one, else from the ini file."""
    if item.config.getoption("--mirotwin-seed") is None:
        for mark in item.iter_markers("mirotwin"):
            if isinstance(mark.kwargs.get("seed"), int):
                return int(mark.kwargs["seed"])
    return number_option(item.config, "seed", 0)


@pytest.fixture(name=_SEED)
def _seed_of_the_test(request: pytest.FixtureRequest) -> int:
    return int(request.param) if hasattr(request, "param") else _first_seed(request.node)


# Fixtures


@pytest.fixture(name=_RIG)
def _rig_of_the_test(request: pytest.FixtureRequest, _mirotwin_seed: int) -> Rig:
    """The world of the test and all that belongs to it."""
    from mirotwin.testing import items

    return items.rig_for(request.node, path_option(request.config, "firmware"), _mirotwin_seed)


@pytest.fixture
def world(mirotwin_rig: Rig) -> World:
    """A world of the test's own: one robot that is up, a silent host, an ideal radio; see the marker `mirotwin`."""
    return mirotwin_rig.world


@pytest.fixture
def links(mirotwin_rig: Rig) -> list[Link]:
    """The hosts' ends of all networks."""
    return mirotwin_rig.links


@pytest.fixture
def link(links: list[Link]) -> Link:
    """The host's end of the first network: sends, polls, expects."""
    return links[0]


@pytest.fixture
def robots(mirotwin_rig: Rig) -> list[RobotUnderTest]:
    """All robots, by network and slot."""
    return mirotwin_rig.robots


@pytest.fixture
def robot(robots: list[RobotUnderTest]) -> RobotUnderTest:
    """The first robot: wheels, memory, breakpoints, switches."""
    return robots[0]


# Judging and reporting


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    """The checks judge a test that has come to its end."""
    if _RIG not in getattr(item, "funcargs", ()):
        return (yield)
    from mirotwin.testing import items

    try:
        result = yield
    except (ValueError, TimeoutError) as error:
        raise items.at_the_tests_line(item, error) from None
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
            paths = path_option(item.config, "firmware"), path_option(item.config, "artifacts")
            items.tell(item, report, call.excinfo, *paths, item.config.getoption("--mirotwin-pages"))
        else:
            items.let_go(item)
    return report
