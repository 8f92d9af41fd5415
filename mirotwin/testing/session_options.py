"""The options of a pytest session for its worlds: command line and ini file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from mirotwin.desk.guard import DeskOptions

_INI = {
    "mirotwin_firmware": "the firmware of the tests (default: the robot's own)",
    "mirotwin_seed": "the seed of tests whose marker names none (default: 0)",
    "mirotwin_artifacts": "where failed tests leave their folders",
    "mirotwin_repeat": "how often each test runs, with seeds that count up",
}
_OPTIONS: tuple[tuple[str, str, type, str], ...] = (
    ("--mirotwin-firmware", "IMAGE.ihx", str, _INI["mirotwin_firmware"]),
    ("--mirotwin-seed", "N", int, "the seed of all tests"),
    ("--mirotwin-artifacts", "DIR", str, _INI["mirotwin_artifacts"]),
    ("--mirotwin-repeat", "N", int, _INI["mirotwin_repeat"]),
    ("--mirotwin-part", "FILE.py:CLASS", list, "a part of your own that boards name"),
    ("--mirotwin-law", "FILE.py:CLASS", list, "a law of your own that scenarios name"),
    ("--mirotwin-estimator", "FILE.py:CLASS", list, "an estimator of your own that scenarios name"),
    ("--mirotwin-pages", "", bool, "make the page of each failed test, too: some seconds each"),
    (
        "--mirotwin-sanitize",
        "",
        bool,
        "fail the session for what firmware does without noticing, such as races",
    ),
    ("--mirotwin-sanitize-kind", "KIND", list, "only findings of this kind, such as race"),
    (
        "--mirotwin-sanitize-allow",
        "FILE",
        str,
        "findings that are meant: lines `race robot.c:77 stamp  # why`",
    ),
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
"""Name, placeholder of its value in the help, type (bool: a switch; list: may be repeated), help."""


FILES_OF = ("part", "law", "estimator")
"""Kinds of plug-ins that the command line brings in files, by `--mirotwin-KIND`."""


def add_options(parser: pytest.Parser) -> None:
    """Registers the options with pytest."""
    group = parser.getgroup("mirotwin", "worlds for tests, firmware coverage (mirotwin)")
    for name, metavar, kind, help_text in _OPTIONS:
        if kind is bool:
            group.addoption(name, action="store_true", help=help_text)
        elif kind is list:
            group.addoption(name, metavar=metavar, action="append", default=[], help=help_text)
        else:
            group.addoption(name, metavar=metavar, type=kind, help=help_text)
    for name, help_text in _INI.items():
        parser.addini(name, help_text, type="string")


def check_options(config: pytest.Config) -> None:
    """Raises UsageError for an impossible combination."""
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
    given = {f"{kind}s": config.getoption(f"--mirotwin-{kind}") for kind in FILES_OF}
    if any(given.values()):
        from mirotwin.shell.plugin_files import PluginFiles

        here = config.invocation_params.dir
        files = {field: tuple(f"{Path(here, name)}" for name in listed) for field, listed in given.items()}
        try:
            PluginFiles(**files).bring("--mirotwin-")
        except ValueError as error:
            raise pytest.UsageError(f"{error}") from None
    workers = config.getoption("numprocesses", None) or 0
    if workers > 1 and config.getoption("--mirotwin-port"):
        raise pytest.UsageError(f"--mirotwin-port: {workers} workers cannot share one port; give -n 0")
    for option in ("--mirotwin-sanitize-kind", "--mirotwin-sanitize-allow"):
        if config.getoption(option) and not config.getoption("--mirotwin-sanitize"):
            raise pytest.UsageError(f"{option}: goes with --mirotwin-sanitize")
    share = config.getoption("--firmware-coverage-fail-under") or 0.0
    if not 0.0 <= share <= 100.0:
        raise pytest.UsageError(f"--firmware-coverage-fail-under: {share} is no percentage; give 0 to 100")
    if share and not config.getoption("--firmware-coverage"):
        raise pytest.UsageError("--firmware-coverage-fail-under: goes with --firmware-coverage=FILE.info")


def number_option(config: pytest.Config, name: str, default: int) -> int:
    """The value of an option, else of the ini file, else `default`."""
    given = config.getoption(f"--mirotwin-{name}")
    if given is not None:
        return int(given)
    text = config.getini(f"mirotwin_{name}") or str(default)
    try:
        return int(text)
    except ValueError:
        raise pytest.UsageError(f"mirotwin_{name}: {text!r} is no whole number") from None


def path_option(config: pytest.Config, name: str) -> Path | None:
    """A path: relative to where pytest was called for an option, to the ini file's folder for an ini file."""
    given = config.getoption(f"--mirotwin-{name}")
    if given is not None:
        return Path(config.invocation_params.dir, given)
    text = config.getini(f"mirotwin_{name}")
    return Path(config.rootpath, text) if text else None


def first_seed(item: pytest.Item) -> int:
    """From the command line, else from the innermost marker that has one, else from the ini file."""
    if item.config.getoption("--mirotwin-seed") is None:
        for mark in item.iter_markers("mirotwin"):
            if isinstance(mark.kwargs.get("seed"), int):
                return int(mark.kwargs["seed"])
    return number_option(item.config, "seed", 0)


def desk_of(config: pytest.Config) -> DeskOptions:
    """The port options of the command line."""
    from mirotwin.desk.guard import DeskOptions  # loads the command line's machinery

    given = {name: config.getoption(f"mirotwin_{name}", None) for name in DeskOptions.__struct_fields__}
    return DeskOptions(**{name: value for name, value in given.items() if value is not None})
